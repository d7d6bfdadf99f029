"""The slacks of an arm's limits on the way as array functions, with their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.compiled_library import content_key
from flex_planner.base.validation import Array
from flex_planner.dynamics.cache_key import cache_key
from flex_planner.dynamics.compiled_functions import BatchFunction, load_functions
from flex_planner.optimal_control.path_constraints.path_constraint import (
    PathConstraint,
    SlackLabel,
)
import numpy as np

# of slacks: less than what counts as rounding
_RESERVE = 3e-7
_SOURCES = 'optimal_control/path_constraints'
# functions by their keys: those of a map's thousands of tasks are one
_LOADED: dict[str, dict[str, BatchFunction]] = {}


class PathSlacks:
    """
    The slacks s(q, q') of constraints, n_c of them.

    Values as radii and bounds are parameters of the compiled functions, so that a constraint that
    moves or grows compiles nothing.

    Parameters
    ----------
    arm : Arm
        n_t coordinates.
    constraints : tuple of PathConstraint
        In the order of their slacks.
    relief : numpy.ndarray, shape (n_c,), optional
        Added to the slacks, see `relieve`; none by default.

    Attributes
    ----------
    labels : tuple of SlackLabel
        Of all slacks.
    count : int
        n_c.

    """

    def __init__(self, arm: Arm, constraints: tuple[PathConstraint, ...],
                 relief: Array | None = None) -> None:
        self.arm, self.constraints = arm, constraints
        self.labels: tuple[SlackLabel, ...] = tuple(
            label for one in constraints for label in one.labels(arm))
        self.count = len(self.labels)
        self.relief: Array = np.zeros(self.count) if relief is None else relief
        self._numbers = np.array([entry for one in constraints for entry in one.numbers(arm)],
                                 dtype=float)
        self._functions = _load(arm, constraints) if self.count else {}

    def reconstruction_arguments(self) -> tuple[object, ...]:
        """Return what a saved plan keeps."""
        return self.arm, self.constraints, self.relief

    @classmethod
    def reconstruct(cls, *arguments: object) -> PathSlacks:
        """Return what a plan has kept."""
        return cls(*arguments)  # type: ignore[arg-type]

    def owners(self) -> list[int]:
        """Return the index of the constraint that each slack belongs to."""
        return [i for i, one in enumerate(self.constraints) for _ in one.labels(self.arm)]

    def relieved(self, ends: Array, least: float) -> PathSlacks:
        """
        Return slacks that are at least so much in given states (k, 2 n_t).

        A motion may start or end on a limit, where a barrier is infinite; so little of the limit
        is given up then. All others have a reserve for what is between the points of a mesh.

        """
        lowest = self.evaluate(ends).min(axis=0)
        return self.with_relief(np.maximum(least - lowest, -_RESERVE))

    def with_relief(self, relief: Array) -> PathSlacks:
        """Return the same slacks with something else added to them."""
        return PathSlacks(self.arm, self.constraints, relief)

    def __call__(self, states: Array) -> Array:
        """Return the slacks in states (k, 2 n_t), shape (k, n_c)."""
        slacks: Array = self.evaluate(states) + self.relief
        return slacks

    def evaluate(self, states: Array) -> Array:
        """Return the slacks in states (k, 2 n_t) without relief, shape (k, n_c)."""
        if not self._functions:
            return np.zeros((len(states), 0))
        return self._functions['slacks'](states, self._numbers)[0]

    def linearise(self, states: Array, multipliers: Array) -> tuple[Array, Array, Array]:
        """
        Return slacks and derivatives at states (k, 2 n_t).

        Parameters
        ----------
        states : numpy.ndarray, shape (k, 2 n_t)
            (q, q').
        multipliers : numpy.ndarray, shape (k, n_c)
            lam.

        Returns
        -------
        slacks, slopes, curvature : numpy.ndarray
            s (k, n_c), ds/dx (k, n_c, 2 n_t), and the second derivative of lam . s
            (k, 2 n_t, 2 n_t).

        """
        slacks, slopes, curvature = self.differentiate(states, multipliers)
        return slacks + self.relief, slopes, curvature

    def differentiate(self, states: Array, multipliers: Array) -> tuple[Array, Array, Array]:
        """Return slacks without relief and derivatives, see `linearise`."""
        count, half = states.shape
        if not self._functions:
            return (np.zeros((count, 0)), np.zeros((count, 0, half)),
                    np.zeros((count, half, half)))
        slacks, slopes, curvature = self._functions['linearised_slacks'](
            states, multipliers, self._numbers)
        return slacks, slopes.reshape(count, slacks.shape[1], -1), curvature


def _load(arm: Arm, constraints: Sequence[PathConstraint]) -> dict[str, BatchFunction]:
    """Return the functions of constraints of an arm."""
    key = content_key(cache_key(arm, _SOURCES), *(one.structure(arm) for one in constraints))
    if key not in _LOADED:
        _LOADED[key] = load_functions(key, partial(_build, arm, constraints))
    return _LOADED[key]


def _build(arm: Arm, constraints: Sequence[PathConstraint]) -> dict[str, tuple[Any, int]]:
    """Derive the functions; CasADi is imported only here."""
    import casadi as ca
    from flex_planner.dynamics.dynamics_functions import batch
    from flex_planner.optimal_control.path_constraints.symbolic_arm import SymbolicArm

    at = SymbolicArm.of(arm)
    state, numbers, slacks = ca.vertcat(at.coordinates, at.rates), [], []
    for i, one in enumerate(constraints):
        own = ca.SX.sym(f'c{i}', len(one.numbers(arm)))
        numbers.append(own)
        slacks += one.express(at, ca.vertsplit(own))
    s, p = ca.vertcat(*slacks), ca.vertcat(*numbers)
    multipliers = ca.SX.sym('lam', s.numel())
    return {
        'slacks': batch('slacks', [state], p, [s]),
        # transposed: CasADi stores columns, NumPy rows
        'linearised_slacks': batch('linearised_slacks', [state, multipliers], p, [
            s, ca.jacobian(s, state).T, ca.hessian(ca.dot(multipliers, s), state)[0]])}
