"""Checks by a method of another kind: direct collocation, solved by IPOPT from a straight line."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.validation import Array
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.result import DirectResult
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan, Samples
import numpy as np

_DEGREE = 6


def solve_by_ipopt(plan: Plan, intervals: int = 30) -> DirectResult:
    """Solve the task of a plan by IPOPT, which does not see the plan."""
    problem = plan.problem
    settings = DirectSettings(degree=_DEGREE, intervals=intervals)
    return DirectProblem(problem.model, settings).solve(
        problem.parameters, problem.start, problem.goal, problem.task.duration)


def maximize_payload(task: Task, plan: Plan, price: float, intervals: int = 30) -> DirectResult:
    """Maximize the payload at a price by IPOPT, starting from a light load."""
    light = replace(task, payload_mass=1.0)
    problem = MotionProblem(plan.model, light, task_parameters(light))
    settings = DirectSettings(degree=_DEGREE, intervals=intervals)
    return DirectProblem(plan.model, settings).solve(
        problem.parameters, problem.start, problem.goal, task.duration, free=Free.PAYLOAD,
        price=price)


def format_value(result: DirectResult, value: float, digits: int = 6) -> str:
    """Return a value of IPOPT's as text, or that it failed."""
    return f'{value:.{digits}g}' if result.converged else 'did not converge'


def swing_of(samples: Samples, joint: int) -> Array:
    """Return the distance of a joint from a straight line in time, as a share of its travel."""
    angle, times = samples.coordinates[:, joint], samples.times
    line = np.interp(times, times[[0, -1]], angle[[0, -1]])
    share: Array = np.abs(angle - line) / abs(angle[-1] - angle[0])
    return share
