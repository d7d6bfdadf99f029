"""What a plan leaves behind on arms that differ from its model, as text and as plain values."""

from __future__ import annotations

from typing import Any

from flex_planner.planning.execution import describe_controller, UNSTABLE_GROWTH
from flex_planner.planning.feedback.differing_arm import Response
from flex_planner.planning.residuals import Residuals
from flex_planner.planning.robustness import share
from flex_planner.planning.uncertainty import Uncertainty
from flex_planner.reports.motion import columns, Row
import numpy as np

_MILLI = 1e3
HEADER = ('if', 'tip motion after the arrival [mm]', 'bending left [mm]',
          'tip error on arrival [mm]')


def uncertainty_text(uncertainty: Uncertainty, payload_mass: float) -> str:
    """Return how far stiffness and payload may be off, and who says so."""
    return (f'stiffness +-{share(uncertainty.stiffness)}, payload '
            f'+-{share(uncertainty.payload_error(payload_mass))} ({uncertainty.source})')


def residual_rows(found: Residuals, payload_mass: float) -> list[Row]:
    """Return for which controller and which errors the figures are, and the worst of them."""
    rows = [('errors of the model', uncertainty_text(found.uncertainty, payload_mass)),
            ('carried out with', describe_controller(found.controller))]
    if found.stable:
        return [*rows, ('worst of these arms', f'the tip moves by {_MILLI * found.worst:.3g} '
                        'mm in the second after the arrival')]
    shaken = [str(difference) for difference, response in zip(
        found.differences, found.responses, strict=True) if _is_unstable(response)]
    return [*rows, ('unstable', f'if {"; ".join(shaken)}: look for gains with flex-planner gains')]


def residual_cells(found: Residuals) -> list[list[str]]:
    """Return a line for each arm, under `HEADER`."""
    return [[str(difference), *_cells(response)] for difference, response in zip(
        found.differences, found.responses, strict=True)]


def residual_table(found: Residuals) -> str:
    """Return what is left on every arm."""
    return columns(HEADER, residual_cells(found))


def residual_values(found: Residuals) -> dict[str, Any]:
    """Return the figures as plain values in SI units; null where an arm is unstable."""
    gains = found.controller.gains
    return {
        'controller': {'rate': found.controller.rate, 'effort_hold': found.controller.hold.value,
                       'stiffness': gains.stiffness.tolist(), 'damping': gains.damping.tolist()},
        'uncertainty': {'stiffness': found.uncertainty.stiffness,
                        'payload': found.uncertainty.payload, 'source': found.uncertainty.source},
        'arms': [{'if': str(difference), 'stiffness_error': difference.stiffness,
                  'payload_error': difference.payload, 'more_modes': difference.more_modes,
                  'tip_motion': _plain(response, response.residual),
                  'bending': _plain(response, response.bending),
                  'tip_error': _plain(response, response.tip_error)}
                 for difference, response in zip(found.differences, found.responses, strict=True)]}


def _cells(response: Response) -> list[str]:
    """Return what is left on an arm."""
    if _is_unstable(response):
        return ['unstable', '-', '-']
    return [f'{_MILLI * value:.3g}' for value in (response.residual, response.bending,
                                                  response.tip_error)]


def _is_unstable(response: Response) -> bool:
    return response.growth > UNSTABLE_GROWTH or not np.isfinite(response.residual)


def _plain(response: Response, value: float) -> float | None:
    return None if _is_unstable(response) or not np.isfinite(value) else float(value)
