"""A homotopy in via points: from where the motion without them is at their times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.arms.kinematics import tip_position
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    follow_homotopy,
    INTERRUPTED,
    Solver,
)
from flex_planner.collocation.junctions import place_junctions
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.planning.strategies.initial_guesses import cold_start, lift_rigid_motion
from flex_planner.planning.strategies.strategy import Attempt
import numpy as np

_FIRST_STEP = 0.5


def move_via_points(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """
    Start from the motion without via points, and move what it passes to where it should.

    None for a task without via points.

    """
    if not problem.junctions.size:
        return None
    bare = without_via_points(problem)
    free = solve_bare(bare, solver)
    if not free.converged:
        return Attempt(result=free)
    start = place_junctions(problem, free.solution)
    at = problems_between(problem, free.solution)
    return Attempt(result=follow_homotopy(at, start, solver, first_step=_FIRST_STEP))


def problems_between(problem: MotionProblem,
                     motion: CollocationSolution) -> Callable[[float], MotionProblem]:
    """Return problems from one whose via points a motion passes, at 0, to the one asked, at 1."""
    first = _passed_points(problem, motion)

    def at(share: float) -> MotionProblem:
        if share == 1:
            return problem
        points = tuple(_between(start, end, share) for start, end in zip(
            first, problem.task.via_points, strict=True))
        task = replace(problem.task, via_points=points)
        return MotionProblem(problem.model, task, problem.parameters,
                             via_times=problem.junctions)

    return at


def without_via_points(problem: MotionProblem) -> MotionProblem:
    """Return the problem of the same task without via points."""
    return MotionProblem(problem.model, replace(problem.task, via_points=()), problem.parameters)


def solve_bare(bare: MotionProblem, solver: Solver) -> CollocationResult:
    """Return the motion of a task without via points, by the first ways to one."""
    result = cold_start(bare, solver).result
    # rigid motions are lifted without their torques
    if not (result.converged or result.status in INTERRUPTED or bare.layout.torques):
        lifted = lift_rigid_motion(bare, solver)
        result = result if lifted is None else lifted.result
    return result


def _passed_points(problem: MotionProblem, motion: CollocationSolution) -> list[ViaPoint]:
    """Return what a motion passes at the times of the via points."""
    arm, points = problem.model.arm, []
    states = motion(problem.junctions)[:, :arm.n_coordinates]
    for via, q in zip(problem.task.via_points, states, strict=True):
        place = ({'point': tip_position(arm, q)} if via.point.size else
                 {'positions': np.where(np.isfinite(via.positions), q[:arm.n_joints], np.nan)})
        points.append(ViaPoint(**place, time=via.time))
    return points


def _between(start: ViaPoint, end: ViaPoint, share: float) -> ViaPoint:
    """Return a via point a share of the way from one to another."""
    return replace(end, positions=(1 - share) * start.positions + share * end.positions,
                   point=(1 - share) * start.point + share * end.point)
