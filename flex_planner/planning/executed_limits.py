"""
What limits on the way leave of a motion that a joint controller carries out.

The controller holds torques from one update to the next and follows points, so that the arm moves
a little beside the plan, and may pass a limit that the plan only just keeps.

"""

from __future__ import annotations

from typing import NamedTuple

from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import ControlledMotion
from flex_planner.optimal_control.path_constraints import PathSlacks
import numpy as np

# of the scale of a limit, by which an executed motion may pass it without a warning: plans are
# kept inside by a barrier that leaves about as much
TOLERANCE = 1e-3
# between two updates
_SHARES = np.array([0.0, 0.25, 0.5, 0.75])


class ExecutedSlack(NamedTuple):
    """
    The smallest slack of all limits along an executed motion.

    Attributes
    ----------
    slack : float
        As a share of the limit's scale, < 0 where the limit is passed; inf without limits,
        -inf where the arm has run away or nothing is known.
    name : str
        Of the limit; empty without limits.
    margin : float
        The same in `unit`.
    unit : str
        Of the margin.
    time : float
        When, from the start of the trajectory [s].

    """

    slack: float
    name: str = ''
    margin: float = np.nan
    unit: str = ''
    time: float = np.nan

    @property
    def kept(self) -> bool:
        """Return whether limits are kept up to the tolerance."""
        return self.slack >= -TOLERANCE

    def __str__(self) -> str:
        """Return the smallest slack in words."""
        if not self.name:
            return 'no limits' if self.slack > 0 else 'not known'
        side = 'left' if self.slack >= 0 else 'beyond the limit'
        return f'{self.name}: {abs(self.margin):.3g} {self.unit} {side} at {self.time:.4g} s'


def find_executed_slack(slacks: PathSlacks | None, motion: ControlledMotion) -> ExecutedSlack:
    """
    Return the smallest slack at the updates of the controller and at three moments in between.

    Parameters
    ----------
    slacks : PathSlacks or None
        Of the limits; None without any.
    motion : ControlledMotion
        Of the arm; what is between updates is interpolated by cubic polynomials.

    """
    if slacks is None:
        return ExecutedSlack(np.inf)
    if not np.isfinite(motion.states).all():
        return ExecutedSlack(-np.inf)
    times, states = _between_updates(motion)
    values = slacks(states)
    at, k = np.unravel_index(int(values.argmin()), values.shape)
    label, least = slacks.labels[int(k)], float(values[at, k])
    return ExecutedSlack(least, label.name, least * label.scale, label.unit, float(times[at]))


def _between_updates(motion: ControlledMotion) -> tuple[Array, Array]:
    """Return times (j,) and states (j, 2 n_t) at updates and between them."""
    n_t, steps = motion.states.shape[1] // 2, np.diff(motion.times)
    share, h = _SHARES[:, None, None], steps[:, None]
    q, v = motion.states[:, :n_t], motion.states[:, n_t:]
    change, first, last = np.diff(q, axis=0), v[:-1] * h, v[1:] * h
    second, third = 3 * change - 2 * first - last, first + last - 2 * change
    states = np.concatenate([
        q[:-1] + share * (first + share * (second + share * third)),
        (first + share * (2 * second + share * 3 * third)) / h], axis=-1)
    times = motion.times[:-1] + _SHARES[:, None] * steps
    return (np.append(times.T.ravel(), motion.times[-1]),
            np.vstack([states.swapaxes(0, 1).reshape(-1, 2 * n_t), motion.states[-1:]]))
