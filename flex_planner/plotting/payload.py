"""The search for the maximum payload, and the motion that carries it."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.colours import ASIDE, CARRIED, FLEXIBLE, REFUSED
from flex_planner.base.validation import Array
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.plotting.figures import finish, Picture, plain, say
from flex_planner.plotting.motion import draw_tip, draw_torques, Motion
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
import numpy as np

_FEW = 12
# of the range of values: beyond the last, and above the others
_MARGIN = 0.1
_ABOVE = 10.0
_LEAST_ERROR = 1e-12  # less is rounding


def draw_max_payload(found: MaxPayload, motion: Motion | None = None) -> Picture:
    """
    Draw a search for the maximum payload.

    Parameters
    ----------
    found : MaxPayload
        The search, successful or not. Above: what each payload costs, and the price of more; or
        the payloads tried, and where their torques led.
    motion : Motion, optional
        With the largest payload (default: that of a search that is solved). Below: its torques,
        and the path of the tip.

    Returns
    -------
    Picture
        A Matplotlib figure.

    """
    if motion is None and found.plan is not None and found.plan.solved:
        motion = Motion.of(found.plan)
    rows = 1 if motion is None else 2
    figure = Picture(12.5, 0.5 + 4.25 * rows)
    axes = figure.subplots(rows, 2, squeeze=False)
    if found.method is PayloadMethod.DIRECT:
        _draw_front(axes[0], found)
    else:
        _draw_trials(axes[0], found)
    if motion is not None:
        draw_torques(axes[1, 0], motion)
        draw_tip(axes[1, 1], motion)
    figure.suptitle(f'{plain(found.task.arm.name)}\n{_result(found)}')
    return figure


def _result(found: MaxPayload) -> str:
    """Return the result in a line."""
    if not found.solved:
        return found.status.value
    return (f'largest payload {found.payload:.6g} kg, {found.upper_means} '
            f'{found.local_upper:.6g} kg')


def _draw_front(axes: Sequence[Axes], found: MaxPayload) -> None:
    """Draw effort and price against payload, up to what is too much."""
    front = found.front
    if not front.payloads.size:
        _leave_out(axes, 'the search solved no motion')
        return
    axes[1].set_yscale('log')
    for each, values in zip(axes, (front.efforts, front.prices), strict=True):
        each.plot(front.payloads, values, 'o-', color=FLEXIBLE, linewidth=1,
                  label='motions of the search')
        if found.payload:
            each.axvline(found.payload, color=CARRIED, linestyle='--', label='largest payload')
        if np.isfinite(found.local_upper):
            _shade(each, found.local_upper)
    finish(axes[0], 'least effort for each payload', 'J [N² m² s]', 'payload [kg]')
    finish(axes[1], 'price of more payload', '$dJ/dm_p$ [N² m² s/kg]', 'payload [kg]')


def _leave_out(axes: Sequence[Axes], reason: str) -> None:
    """Say why there is nothing to draw."""
    for each in axes:
        each.set_axis_off()
        say(each, reason)


def _shade(axes: Axes, upper: float) -> None:
    """Shade the payloads that are too much."""
    low, high = axes.get_xlim()
    high = max(high, upper + _MARGIN * (upper - low))
    axes.axvspan(upper, high, color=REFUSED, alpha=0.15, linewidth=0, label='too much')
    axes.set_xlim(low, high)
    axes.ticklabel_format(axis='x', useOffset=False)


def _draw_trials(axes: Sequence[Axes], found: MaxPayload) -> None:
    """Draw the payloads tried one after the other, and their boundary errors."""
    if not found.trials:
        _leave_out(axes, 'no heavier payload was tried')
        return
    payloads = np.array([trial.payload for trial in found.trials])
    axes[0].plot(_numbers(payloads), payloads, color=ASIDE)
    _mark(axes[0], found, payloads)
    if found.payload:
        axes[0].axhline(found.payload, color=CARRIED, linestyle='--', label='largest payload')
    _draw_errors(axes[1], found)
    for each in axes:
        each.xaxis.set_major_locator(MaxNLocator(_FEW, integer=True, min_n_ticks=1))
        each.set_xlim(0.5, payloads.size + 0.5)
    finish(axes[0], 'payloads tried', 'payload [kg]', 'trial')
    finish(axes[1], 'error at the goal under their torques', 'boundary error', 'trial',
           legend='upper left', columns=2)


def _draw_errors(axes: Axes, found: MaxPayload) -> None:
    """Draw the boundary errors; what is unknown lies above all others."""
    errors = np.array([max(trial.boundary_error, _LEAST_ERROR) for trial in found.trials])
    tolerance = found.task.tolerance
    known = np.append(errors[np.isfinite(errors)], tolerance)
    span = max(float(known.max() / known.min()), _ABOVE)
    unknown = known.max() * span**_MARGIN
    axes.set_yscale('log')
    axes.axhline(tolerance, color=ASIDE, linestyle=':', label='tolerance')
    if not np.isfinite(errors).all():
        axes.axhline(unknown, color=REFUSED, alpha=0.3, label='not known')
    _mark(axes, found, np.where(np.isfinite(errors), errors, unknown))
    axes.set_ylim(known.min() / span**_MARGIN, unknown * span**(3 * _MARGIN))  # room for a legend


def _numbers(values: Array) -> Array:
    return np.arange(1, values.size + 1, dtype=np.float64)


def _mark(axes: Axes, found: MaxPayload, values: Array) -> None:
    """Mark a value of each trial, by its result."""
    solved = np.array([trial.solved for trial in found.trials], dtype=bool)
    for chosen, style, color, label in ((solved, 'o', CARRIED, 'carried'),
                                        (~solved, 'X', REFUSED, 'not carried')):
        if chosen.any():
            axes.plot(_numbers(values)[chosen], values[chosen], style, color=color, label=label)
