"""Effort that is measured from an offset in time: its problem for the collocation solver."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel, Controls
from flex_planner.optimal_control.boundary_conditions import BoundaryConditions
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.torque_conditions import ChosenTorque
import numpy as np

# so smooth, its knots cost the collocation no intervals: of degree 5 they do, of 9 fits are less
# exact than certificates ask for
DEGREE = 7


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueOffset:
    """
    A torque w(t) from which effort is measured: a spline.

    Parameters
    ----------
    breaks : numpy.ndarray, shape (k + 1,)
        Where its polynomials meet, from 0 to the duration of the motion [s].
    coefficients : numpy.ndarray, shape (k + degree, n)
        Of B-splines [N m], of degree 7 where they are fitted here.

    """

    breaks: Array
    coefficients: Array

    @classmethod
    def fit(cls, times: Array, torques: Array, breaks: Array) -> TorqueOffset:
        """
        Return the offset nearest to torques (m, n) at increasing times (m,), least squares.

        The first and last time must be those of the breaks (k + 1,), with m > k + 7 times spread
        over all of its intervals.

        """
        from scipy.interpolate import make_lsq_spline  # see `ArmDynamics.prepare`

        spline = make_lsq_spline(times, torques, _knots(breaks, DEGREE), DEGREE)
        return cls(breaks=breaks, coefficients=spline.c)

    @classmethod
    def zero(cls, duration: float, joints: int) -> TorqueOffset:
        """Return the offset zero."""
        return cls(breaks=np.array([0.0, duration]), coefficients=np.zeros((DEGREE + 1, joints)))

    @property
    def degree(self) -> int:
        """Return the degree of its polynomials."""
        return len(self.coefficients) - len(self.breaks) + 1

    def __call__(self, times: Array) -> Array:
        """Return the offset at times (m,), shape (m, n) [N m]."""
        values: Array = _spline(self)(times)
        return values

    def rate(self, times: Array) -> Array:
        """Return its rate at times (m,), shape (m, n) [N m/s]."""
        values: Array = _spline(self)(times, 1)
        return values


def _knots(breaks: Array, degree: int) -> Array:
    """Return the knots of the B-splines."""
    return np.concatenate([np.full(degree, breaks[0]), breaks, np.full(degree, breaks[-1])])


@lru_cache(maxsize=8)
def _spline(offset: TorqueOffset) -> Any:
    """Return the spline of an offset."""
    from scipy.interpolate import BSpline  # see `ArmDynamics.prepare`

    return BSpline(_knots(offset.breaks, offset.degree), offset.coefficients, offset.degree)


class OffsetProblem(MotionProblem):
    """
    The optimality conditions of a task whose effort is measured from an offset.

    Parameters
    ----------
    model, task, parameters
        Of `MotionProblem`.
    offset : TorqueOffset
        w, over the duration of the task.
    ends : BoundaryConditions, optional
        Of `MotionProblem`, too.

    """

    def __init__(self, model: ArmModel, task: Task, parameters: Parameters,
                 offset: TorqueOffset, *, ends: BoundaryConditions | None = None) -> None:
        super().__init__(model, task, parameters, ends=ends)
        self.offset = offset
        self._chosen = ChosenTorque(model, parameters)

    def rate(self, t: Array, z: Array) -> Array:
        """Return z'."""
        return self.model.offset_optimality(z, self.offset(t), self.p)

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return z' and its Jacobian."""
        rate, jacobian = self.model.offset_function('offset_optimality_jacobian')(
            z, self.offset(t), self.p)
        return rate, jacobian

    def controls(self, t: Array, z: Array) -> Controls:
        """Return torque, cost without the offset, and H with it."""
        return self.model.offset_controls(z, self.offset(t), self.p)

    def switches(self, t: Array, z: Array, p: Array | None = None) -> Array:
        """Return the distances of the unbounded torque from its bounds, 2 n columns or more."""
        return self._chosen.distances(self.controls(t, z).free_torque, z)

    def hamiltonian_rate(self, t: Array, z: Array) -> Array:
        """Return dH/dt, which the offset makes: -w'^T R u, shape (k,)."""
        torque = self.controls(t, z).torque
        rate: Array = -(self.offset.rate(t) * torque) @ self.parameters.effort_weights
        return rate
