"""Results of identification as text, and as what a file keeps of them."""

from __future__ import annotations

from typing import Any

from flex_planner.identification.identification import Estimate, Identification
from flex_planner.identification.plan_residuals import PlanResiduals
from flex_planner.reports.motion import columns, Row
import numpy as np


def identification_rows(found: Identification) -> list[Row]:
    """Return what was fitted and how well, as names and values."""
    rows = [('logs', f'{len(found.logs)}: {", ".join(found.logs)}'),
            ('method', found.method.value),
            ('fit', f'{found.best.fit_percent.min():.4g} % at least of each joint and log, '
             f'{found.best.evaluations} simulations'),
            ('errors', f'{found.best.rms:.3g} times the noise of the encoders')]
    if not np.isnan(found.left_out).all():
        rows.append(('left-out logs', f'{found.left_out.min():.4g} % explained, by fits to each '
                     'other log'))
    rows += [('payload', f'{found.payload_mass:.5g} kg: plan with it'),
             ('delay of the drive', f'{1e3 * found.delay:.3g} ms')]
    offsets = found.encoder_offsets
    if offsets.any():
        rows.append(('encoders say too much', ', '.join(
            f'{np.degrees(one):.3g} deg' for one in offsets)
            + ': correct the zero of the encoders'))
    return rows + [('warning', str(one)) for one in found.warnings]


def plan_residual_rows(residuals: PlanResiduals) -> list[Row]:
    """Return what a recorded plan left behind and what the next one will."""
    rows = [('residual of the plan', f'{_millimetres(residuals.before)}: motion of the tip in the '
             'second after the arrival, of the recorded trajectory on the arm that was found')]
    if residuals.message:
        return [*rows, ('  planned again', f'not found: {residuals.message}')]
    return [*rows, ('  planned again', f'{_millimetres(residuals.after)}, with the arm that was '
                    'found, least effort between the same ends, and the zero of the encoders '
                    'corrected')]


def _millimetres(length: float) -> str:
    return f'{1e3 * length:.3g} mm' if np.isfinite(length) else 'without bound'


def estimate_table(found: Identification) -> str:
    """Return all parameters, a line each."""
    return columns(('parameter', 'value', '95 %', 'spread', 'assumed', 'unit', ''),
                   [_cells(one) for one in found.estimates])


def _cells(one: Estimate) -> tuple[str, ...]:
    """Return the line of a parameter."""
    return (one.parameter.name, f'{one.value:.5g}', _uncertainty(one.half_width),
            _uncertainty(one.spread), f'{one.assumed:.5g}', one.parameter.unit or '-',
            one.verdict.value)


def _uncertainty(value: float) -> str:
    return '-' if np.isnan(value) else f'+-{value:.2g}'


def plain_identification(found: Identification,
                         residuals: PlanResiduals | None = None) -> dict[str, Any]:
    """Return the result as YAML can write it; what is withheld or not known is null."""
    return {
        'method': found.method.name.lower(), 'logs': list(found.logs),
        'values_with_more_modes': found.best is found.more_modes,
        'rms_over_noise': _plain(found.best.rms),
        'fit_percent': found.best.fit_percent.tolist(),
        'left_out_percent': [[_plain(one) for one in row] for row in found.left_out],
        'parameters': [_entry(one) for one in found.estimates],
        'plan_residual': residuals and {
            'log': residuals.name, 'before': _plain(residuals.before),
            'after': _plain(residuals.after)},
        'warnings': [{'code': one.code.value, 'text': one.text} for one in found.warnings]}


def _entry(one: Estimate) -> dict[str, Any]:
    """Return a parameter."""
    return {'name': one.parameter.name, 'unit': one.parameter.unit, 'value': _plain(one.value),
            'half_width': _plain(one.half_width), 'spread': _plain(one.spread),
            'assumed': _plain(one.assumed), 'verdict': one.verdict.value}


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
