"""
What is left of a published motion on arms that are not quite the one that was planned for.

Each of them carries the same trajectory out under the same joint controller: with two more modes
per link, which torque jumps excite as much as those of the model; with links softer and stiffer,
and payloads lighter and heavier, by as much as they may be off.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.progress import Monitor
from flex_planner.control.feedback_stability import feedback_growth
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.planning.execution import (
    describe_controller,
    Execution,
    ExecutionCertificate,
    RobustnessReport,
    UNSTABLE_GROWTH,
)
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.differing_arms import (
    differing_parameters,
    MORE_MODES,
    other_execution,
    plain_parameters,
    with_more_modes,
)
from flex_planner.planning.sampling import SampledPlan
from flex_planner.planning.uncertainty import ASSUMED, Uncertainty
from flex_planner.planning.warnings import PlanWarning, WarningKind
import numpy as np

# of the nominal vibration, and as a share of the reach: a vibration above both is told of
_FAR_ABOVE, _NOTABLE = 10.0, 1e-4
# growth of an error of the joints, above which efforts alone are said to be unstable
_AMPLIFIED = 10.0
_POSTURES = 5


def assess_robustness(plan: Plan, sampled: SampledPlan,
                      monitor: Monitor | None = None, *,
                      uncertainty: Uncertainty = ASSUMED) -> RobustnessReport:
    """
    Return what is left of a sampled plan on arms that are not quite that of the plan.

    The dynamics of the arm with more modes are compiled the first time, which takes some tenths
    of a second, see `prepare_robustness`.

    Parameters
    ----------
    plan : Plan
        With a solution.
    sampled : SampledPlan
        Its samples.
    monitor : Monitor, optional
        May stop it.
    uncertainty : Uncertainty
        Of stiffness and payload, a tenth by default.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    execution = Execution.of(plan, sampled.execution.controller, sampled.start_hold)
    given = plan.problem.parameters
    payload = given.payload_mass or given.payload_inertia
    stiffness_error = uncertainty.stiffness
    payload_error = uncertainty.payload_error(float(given.payload_mass))

    def worst(*changed: PhysicalParameters) -> float:
        return max(_vibration(execution, execution.dynamics, parameters, sampled, monitor)
                   for parameters in changed)

    nominal = sampled.execution.residual_vibration
    more, growth = nominal, sampled.execution.feedback_growth
    if plan.arm.n_modes:
        other = replace(execution, dynamics=ArmDynamics.of(with_more_modes(plan.arm)))
        more = _vibration(execution, other.dynamics, plain_parameters(given), sampled, monitor)
        positions = plan.uniform_samples(_POSTURES).coordinates[:, :plan.arm.n_joints]
        growth = feedback_growth(other.arm, positions)
    return RobustnessReport(
        nominal=nominal, more_modes=more, more_modes_growth=growth,
        stiffness_difference=stiffness_error, payload_difference=payload_error,
        stiffness_differs=worst(*(differing_parameters(given, error, 0.0) for error in (
            -stiffness_error, stiffness_error))) if plan.arm.n_modes else nominal,
        payload_differs=worst(*(differing_parameters(given, 0.0, error) for error in (
            -payload_error, payload_error))) if payload else nominal)


def prepare_robustness(arm: Arm) -> None:
    """Compile what `assess_robustness` takes for an arm, or load it."""
    if arm.n_modes:
        ArmDynamics.of(with_more_modes(arm))


def robustness_warnings(certificate: ExecutionCertificate, robustness: RobustnessReport,
                        reach: float, arm: Arm | None = None) -> list[PlanWarning]:
    """
    Return what a user should know before an arm carries a motion out.

    Parameters
    ----------
    certificate : ExecutionCertificate
        Of the trajectory.
    robustness : RobustnessReport
        Of it.
    reach : float
        Of the arm [m].
    arm : Arm, optional
        For the units of its joints; by default all turn.

    """
    found = [*_execution_warnings(certificate, reach), *_passed_limit(certificate)]
    if certificate.open_loop_amplification > _AMPLIFIED:
        found.append(PlanWarning(kind=WarningKind.OPEN_LOOP_UNSTABLE, sentence=(
            'without feedback the motion is unstable: an error '
            'of a joint at the start grows to '
            f'{certificate.open_loop_amplification:.2g} times its size until the arrival')))
    if robustness.more_modes_growth > UNSTABLE_GROWTH >= certificate.feedback_growth:
        found.append(PlanWarning(kind=WarningKind.FEEDBACK_UNSTABLE, sentence=(
            f'with {MORE_MODES} more modes per link the PD of the joints is unstable '
            f'({describe_controller(certificate.controller, arm)}): choose lower gains or a '
            'faster controller')))
    changes = {
        WarningKind.SENSITIVE_TO_MODES: (robustness.more_modes,
                                         f'links have {MORE_MODES} more modes'),
        WarningKind.SENSITIVE_TO_STIFFNESS: (robustness.stiffness_differs,
                                             'stiffness differs by '
                                             f'{share(robustness.stiffness_difference)}'),
        WarningKind.SENSITIVE_TO_PAYLOAD: (robustness.payload_differs,
                                           'the payload differs by '
                                           f'{share(robustness.payload_difference)}')}
    most = max(_FAR_ABOVE * robustness.nominal, _NOTABLE * reach)
    return found + [
        PlanWarning(kind=kind, value=vibration, sentence=(
            f'residual vibration if {change}: {_millimetres(vibration)}, but '
            f'{_millimetres(robustness.nominal)} as modelled'))
        for kind, (vibration, change) in changes.items() if vibration > most]


def _execution_warnings(certificate: ExecutionCertificate, reach: float) -> list[PlanWarning]:
    """Return what is to be known of a trajectory on the very arm that it was planned for."""
    worst = max(certificate.tip_error, certificate.residual_vibration)
    if worst <= _NOTABLE * reach:
        return []
    return [PlanWarning(kind=WarningKind.ARRIVES_ELSEWHERE, value=worst, sentence=(
        f'torques that are held for {1e3 * certificate.controller.period:.3g} ms leave the tip '
        f'{_millimetres(certificate.tip_error)} from its goal and '
        f'{_millimetres(certificate.residual_vibration)} of vibration, where the plan leaves '
        'none: a faster controller or a calmer motion leaves less'))]


def _passed_limit(certificate: ExecutionCertificate) -> list[PlanWarning]:
    """Warn of a limit on the way that the arm passes under its controller."""
    tightest = certificate.limits
    if tightest.kept or not tightest.name:
        return []
    sentence = ('under the joint controller the arm passes a limit that the plan keeps: '
                f'{tightest}; a faster controller, a calmer motion, or limits with some room keep '
                'it')
    return [PlanWarning(kind=WarningKind.LIMIT_PASSED, value=tightest.slack, time=tightest.time,
                        sentence=sentence)]


def share(value: float) -> str:
    """Return a share as a percentage of two digits."""
    return f'{100 * value:.2g}%'


def _millimetres(length: float) -> str:
    """Return a length in words."""
    return f'{length * 1e3:.2g} mm' if np.isfinite(length) else 'without bound'


def _vibration(nominal: Execution, dynamics: ArmDynamics, parameters: PhysicalParameters,
               sampled: SampledPlan, monitor: Monitor | None) -> float:
    """Return the residual vibration of another arm that follows the trajectory [m]."""
    try:
        other = other_execution(nominal, dynamics, parameters)
    except NoEquilibriumError:
        return float(np.inf)
    return other.vibration(other.arrive(sampled.reference, monitor))
