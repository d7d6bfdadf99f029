"""Where the unknowns of a collocation point stand, and what torques with rates are to it."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class PointLayout:
    """
    The order of y at a point: (q, q', q'', w), or (q, q', w, q'', w') where torques have rates.

    w = u + K_2 q' is what a motor gives at rest. States come first.

    Parameters
    ----------
    coordinates, joints : int
        n_t and n.
    with_rates : bool
        Whether w is a state.

    """

    coordinates: int
    joints: int
    with_rates: bool = False

    @property
    def states(self) -> int:
        """Return how many states there are, n_x: 2 n_t, or 2 n_t + n."""
        return 2 * self.coordinates + self.joints * self.with_rates

    @property
    def size(self) -> int:
        """Return how many unknowns a point has."""
        return 3 * self.coordinates + self.joints * (1 + self.with_rates)

    @property
    def accelerations(self) -> slice:
        """Return where q'' stands."""
        return slice(self.states, self.states + self.coordinates)

    @property
    def drives(self) -> slice:
        """Return where w stands."""
        first = 2 * self.coordinates if self.with_rates else 3 * self.coordinates
        return slice(first, first + self.joints)

    @property
    def drive_rates(self) -> slice:
        """Return where w' stands, empty where w is no state."""
        return slice(self.states + self.coordinates, self.size if self.with_rates else
                     self.states + self.coordinates)

    @property
    def derivatives(self) -> NDArray[np.intp]:
        """Return where the derivatives of the states stand, shape (n_x,)."""
        n_t, after = self.coordinates, self.accelerations
        found: NDArray[np.intp] = np.r_[n_t:2 * n_t, after.start:after.stop,
                                        self.drive_rates.start:self.drive_rates.stop]
        return found

    def join(self, states: Array, accelerations: Array, drives: Array,
             drive_rates: Array) -> Array:
        """Return y (k, size) of (q, q') (k, 2 n_t), q'' (k, n_t), w and w' (k, n)."""
        if self.with_rates:
            return np.hstack([states, drives, accelerations, drive_rates])
        return np.hstack([states, accelerations, drives])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueRates:
    """
    What rates of torques cost, their bounds, and the torques at both ends.

    Attributes
    ----------
    weights, bounds : numpy.ndarray, shape (n,)
        Diagonal of S, and the largest rates, infinite for none [N m/s].
    start, goal : numpy.ndarray, shape (n,)
        Torques that hold the arm [N m].

    """

    weights: Array
    bounds: Array
    start: Array
    goal: Array

    @classmethod
    def of(cls, motion: MotionProblem) -> TorqueRates | None:
        """Return those of a motion that rests at both ends; None where torques are no states."""
        held = motion.torque_ends
        if held is None:
            return None
        if not (held.start.size and held.goal.size):
            raise ValueError('the motion must rest at both ends')
        return cls(weights=motion.task.torque_rate_prices, bounds=motion.task.torque_rate_bounds,
                   start=held.start, goal=held.goal)
