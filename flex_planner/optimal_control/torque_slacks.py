"""The motors' limits as limits of states, for motions whose torque is a state."""

from __future__ import annotations

from collections.abc import Iterator

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint_units import units_of
from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.path_constraints.path_constraint import (
    PathConstraint,
    SlackLabel,
)
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np


class TorqueSlacks(PathSlacks):
    """
    Slacks s(q, q', tau): those of limits on the way, then of the motors' limits of eq. (15).

    Of each motor ``(K_1 -+ (tau + K_2 q')) / K_1``, and where it has a cap besides ``(cap -+ tau)
    / cap``; nothing where a limit is infinite. They are linear in the state.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    constraints : tuple of PathConstraint
        Limits on the way.
    limits : TorqueLimits
        Of the motors.
    relief : numpy.ndarray, shape (n_c,), optional
        See `PathSlacks`.

    """

    def __init__(self, arm: Arm, constraints: tuple[PathConstraint, ...], limits: TorqueLimits,
                 relief: Array | None = None) -> None:
        super().__init__(arm, constraints)
        self.limits = limits
        self._way = self.count
        rows = list(_rows(arm, limits))
        self.labels = (*self.labels, *(label for label, _ in rows))
        self.count = len(self.labels)
        self.relief = np.zeros(self.count) if relief is None else relief
        # ds/dx of the motors' limits, the same everywhere
        self._slopes: Array = np.array([row for _, row in rows]).reshape(
            len(rows), 2 * arm.n_coordinates + arm.n_joints)
        self._owners = [*super().owners(), *(
            len(constraints) + i for i in range(arm.n_joints) for _ in _sides(limits, i))]

    def reconstruction_arguments(self) -> tuple[object, ...]:
        """Return what a saved plan keeps."""
        return self.arm, self.constraints, self.limits, self.relief

    @classmethod
    def reconstruct(cls, *arguments: object) -> TorqueSlacks:
        """Return what a plan has kept."""
        return cls(*arguments)  # type: ignore[arg-type]

    def owners(self) -> list[int]:
        """Return the constraint that each slack belongs to; motors count on after the last."""
        return self._owners

    def with_relief(self, relief: Array) -> TorqueSlacks:
        """Return the same slacks with something else added to them."""
        return TorqueSlacks(self.arm, self.constraints, self.limits, relief)

    def evaluate(self, states: Array) -> Array:
        """Return the slacks in states (k, 2 n_t + n) without relief, shape (k, n_c)."""
        half = 2 * self.arm.n_coordinates
        return np.hstack([super().evaluate(states[:, :half]), 1 + states @ self._slopes.T])

    def differentiate(self, states: Array, multipliers: Array) -> tuple[Array, Array, Array]:
        """Return slacks without relief and derivatives, see `linearise`."""
        count, half = len(states), 2 * self.arm.n_coordinates
        way = super().differentiate(states[:, :half], multipliers[:, :self._way])
        slopes = np.zeros((count, self.count, states.shape[1]))
        slopes[:, :self._way, :half] = way[1]
        slopes[:, self._way:] = self._slopes
        curvature = np.zeros((count, states.shape[1], states.shape[1]))
        curvature[:, :half, :half] = way[2]
        return np.hstack([way[0], 1 + states @ self._slopes.T]), slopes, curvature


def _sides(limits: TorqueLimits, joint: int) -> Iterator[tuple[str, float, float, float]]:
    """Yield word, sign, scale and slope of the limits of a motor in both directions."""
    for scale, slope in ((limits.stall[joint], limits.slope[joint]), (limits.cap[joint], 0.0)):
        if np.isfinite(scale):
            yield 'largest', 1.0, float(scale), float(slope)
            yield 'lowest', -1.0, float(scale), float(slope)


def _rows(arm: Arm, limits: TorqueLimits) -> Iterator[tuple[SlackLabel, Array]]:
    """Yield label and gradient of each of the motors' slacks."""
    n_t = arm.n_coordinates
    for i in range(arm.n_joints):
        for word, sign, scale, slope in _sides(limits, i):
            row = np.zeros(2 * n_t + arm.n_joints)
            row[2 * n_t + i], row[n_t + i] = -sign / scale, -sign * slope / scale
            yield SlackLabel(name=f'{word} torque of joint {i + 1}',
                             unit=units_of(arm.joints[i]).torque, scale=scale), row
