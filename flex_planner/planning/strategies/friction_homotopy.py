"""
A homotopy in Coulomb friction: from one that changes sides slowly to the one of the arm.

Where a joint turns back its friction jumps within `coulomb_speed`. Newton's method has to place
such a jump to a share of a mesh interval, and finds no way from far; friction that changes sides
over the speeds of the whole motion is nearly viscous. Raising its torque from none instead meets
the jumps at their full steepness, and seldom comes to its end.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.collocation import CollocationResult, follow_homotopy, INTERRUPTED, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.initial_guesses import cold_start, lift_rigid_motion
from flex_planner.planning.strategies.strategy import Attempt
import numpy as np

# speeds within which friction changes sides at first, by the mean speed of the fastest joint
_SLOWLY = (4.0, 1.5)
_FIRST_STEP = 0.25

Softened = Callable[[float], MotionProblem]
"""From a share to a problem: friction changes sides slowly at 0, and is that of the arm at 1."""


def sharpen_friction(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """
    Start with Coulomb friction that changes sides slowly, and lower that speed to the arm's.

    None for an arm without Coulomb friction, or whose friction is as slow.

    """
    result = None
    for speed in _SLOWLY:
        softened = soften_friction(problem, speed)
        if softened is None:
            continue
        result = solve_softened(softened, solver)
        if result.converged:
            result = follow_homotopy(softened, result.solution, solver, _FIRST_STEP)
        if result.converged or result.status in INTERRUPTED:
            break
    return None if result is None else Attempt(result=result)


def find_easier_speed(problem: MotionProblem, solver: Solver) -> float | None:
    """Return how many times as large `coulomb_speed` leads to a motion at once; None if none."""
    for slowly in _SLOWLY[::-1]:
        softened = soften_friction(problem, slowly)
        if softened is not None and solve_softened(softened, solver).converged:
            larger = softened(0.0).parameters.coulomb_speed / problem.parameters.coulomb_speed
            return float(larger.max())
    return None


def soften_friction(problem: MotionProblem, slowly: float) -> Softened | None:
    """
    Return problems whose Coulomb friction changes sides slowly at first; None without any.

    Parameters
    ----------
    problem : MotionProblem
        Of the arm.
    slowly : float
        Speed within which it changes sides at first, by the mean speed of the fastest joint; of
        joints where it does so more slowly anyway nothing is changed.

    """
    parameters, n = problem.parameters, problem.model.arm.n_joints
    strokes = np.abs(problem.goal - problem.start)[:n]
    own = parameters.coulomb_speed
    first = np.maximum(own, slowly * strokes.max() / problem.task.duration)
    if not np.any((first > own) & (parameters.coulomb_friction > 0)):
        return None

    def at(share: float) -> MotionProblem:
        if share == 1:
            return problem
        slower = replace(parameters, coulomb_speed=first**(1 - share) * own**share)
        return MotionProblem(problem.model, problem.task, slower, via_times=problem.junctions)

    return at


def solve_softened(softened: Softened, solver: Solver) -> CollocationResult:
    """Return the motion of the first problem, by the first ways to one, loosely."""
    first, loose = softened(0.0), solver.loose()
    result = cold_start(first, loose).result
    if not result.converged and result.status not in INTERRUPTED:
        lifted = lift_rigid_motion(first, loose)
        result = result if lifted is None else lifted.result
    return result
