"""Motions with an unknown more, at points that are no solutions, and differences there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.free_duration import FreeDurationProblem
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.planning.plan import Plan
import numpy as np
from plan_checks import problem_of, solution_of

Extended = FreeDurationProblem | FreePayloadProblem


def extended(plan: Plan, which: type[Any]) -> tuple[Extended, CollocationSolution]:
    """Return a problem with an unknown more, and a point of it that is no solution."""
    problem = problem_of(plan.model, plan.task)
    made = (FreeDurationProblem(problem, 1.7) if which is FreeDurationProblem
            else FreePayloadProblem(plan.problem, 3.0))
    return made, made.extend(solution_of(plan))


def differences(function: Callable[[Array], Array], z: Array, steps: Array) -> Array:
    """Return the Jacobian by differences of fourth order, shape (n, m)."""
    columns = []
    for k, h in enumerate(steps):
        change = np.zeros_like(z)
        change[k] = h
        values = [function(z + count * change) for count in (-2, -1, 1, 2)]
        columns.append(np.tensordot([1, -8, 8, -1], values, 1) / (12 * h))
    return np.stack(columns, axis=-1)


def steps_of(problem: Extended) -> Array:
    return 1e-3 * np.maximum(problem.scale, 1e-3)
