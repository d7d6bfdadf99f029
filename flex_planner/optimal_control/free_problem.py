"""What the problems of motions with one more unknown have in common."""

from __future__ import annotations

from typing import Protocol

from flex_planner.base.validation import Array
from flex_planner.collocation import (
    BoundaryValueProblem,
    CollocationResult,
    CollocationSolution,
)
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np


class FreeProblem(BoundaryValueProblem, Protocol):
    """The optimality conditions of a motion with its payload or its duration free at a price."""

    def extend(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion with a given value as a guess."""

    def restrict(self, solution: CollocationSolution) -> tuple[float, CollocationSolution]:
        """Return the value, and the motion with it."""

    def restrict_result(self, result: CollocationResult) -> CollocationResult:
        """Return the result of the motion with the value found."""

    def fix(self, value: float) -> MotionProblem:
        """Return the same motion with the value given."""


def append_zeros(values: Array, count: int) -> Array:
    """Return an array with so many columns of zeros appended to its last axis."""
    return np.concatenate([values, np.zeros((*values.shape[:-1], count))], axis=-1)


def join_with_more(motion: MotionProblem, junction: int, before: Array,
                   after: Array) -> tuple[Array, Array]:
    """Return what holds at a via point where unknowns after those of a motion go on."""
    inner, size = motion.size, before.size
    residual, rows = after - before, np.hstack([-np.eye(size), np.eye(size)])
    residual[:inner], found = motion.join(junction, before[:inner], after[:inner])
    rows[:inner, :inner], rows[:inner, size:size + inner] = np.hsplit(found, 2)
    return residual, rows
