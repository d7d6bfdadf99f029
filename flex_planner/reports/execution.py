"""What a joint controller makes of a trajectory, as lines of text."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.planning.execution import (
    describe_controller,
    ExecutionCertificate,
    RobustnessReport,
)
from flex_planner.planning.robust.differing_arms import has_all_modes, MORE_MODES
from flex_planner.planning.robustness import share
from flex_planner.reports.motion import Row
import numpy as np


def execution_rows(certificate: ExecutionCertificate, arm: Arm | None = None) -> list[Row]:
    """Return the certificate of a trajectory; units of gains are those of the arm."""
    controller = describe_controller(certificate.controller, arm)
    rows = [
        ('published trajectory', f'carried out with {controller}'),
        ('  executed tip error', millimetres(certificate.tip_error)),
        ('  executed residual vibration', millimetres(certificate.residual_vibration)),
        ('  without feedback', f'tip error {millimetres(certificate.open_loop_tip_error)}, '
         f'residual vibration {millimetres(certificate.open_loop_residual_vibration)}; a small '
         f'error at the start grows to {certificate.open_loop_amplification:.2g} times its size')]
    return rows + _limit_rows(certificate)


def _limit_rows(certificate: ExecutionCertificate) -> list[Row]:
    """Return what limits on the way leave of the executed motion; none without limits."""
    if not np.isfinite(certificate.limit_slack):
        return []
    tightest = certificate.limits
    return [('  executed limits', str(tightest) if tightest.name else
             f'{certificate.limit_slack:.2g} of the scale of the tightest is left')]


def robustness_rows(robustness: RobustnessReport, arm: Arm) -> list[Row]:
    """Return the residual vibration on other arms: of a rigid arm there is none."""
    if not arm.n_modes:
        return []
    return [('residual vibration if', 'the arm is not quite the one of the plan, with feedback'),
            *((f'  {change}', length) for change, length in vibrations(robustness, arm))]


def vibrations(robustness: RobustnessReport, arm: Arm) -> list[Row]:
    """Return what differs, and the residual vibration then."""
    more = [] if has_all_modes(arm) else [
        (f'{MORE_MODES} more modes per link', millimetres(robustness.more_modes))]
    return [*more,
            (f'stiffness +-{share(robustness.stiffness_difference)}',
             millimetres(robustness.stiffness_differs)),
            (f'payload +-{share(robustness.payload_difference)}',
             millimetres(robustness.payload_differs)),
            ('nothing differs', millimetres(robustness.nominal))]


def millimetres(length: float) -> str:
    """Return a length [m] in words."""
    return f'{length * 1e3:.2g} mm' if np.isfinite(length) else 'without bound'
