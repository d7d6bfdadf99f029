"""
Motions by the interior-point method: the motors' limits as a barrier, then as they are.

A start far from any solution meets limits that switch on and off from one iterate to the next.
As a barrier they are smooth, and what comes out when it has vanished is so near the motion that
Newton's method, with the Jacobian of every stage, needs few iterations more. It finds most
motions of clamped links, whose inertia without a rotor is small, and saturated ones.

"""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.base.errors import InvalidTaskError
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    GaussRule,
    Solver,
    SolverStatus,
)
from flex_planner.collocation.interior_point import BarrierSchedule, solve_barrier
from flex_planner.collocation.junctions import place_junctions
from flex_planner.optimal_control.barrier_problem import MotionBarrier
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.initial_guesses import rigid_problem
from flex_planner.planning.strategies.quasi_static_lift import bend_quasi_statically
from flex_planner.planning.strategies.strategy import Attempt
import numpy as np

# of the method, and intervals of its coarsest mesh
_STAGES, _FEWEST = 4, 20
# meshes, in units of it, and mu at first, in units of the cost per time: from a straight line,
# and near a motion
_FAR, _NEAR = ((1.0, 0.1), (2.0, 0.1), (2.0, 100.0)), ((1.0, 1e-3), (2.0, 1e-3))
# mu at last, in the same units
_LAST = 1e-7
_TOLERANCE = 1e-2
# iterations after which another mesh is better
_PATIENCE = 60

MakeGuess = Callable[[int], CollocationSolution]
"""From a number of intervals to a guess."""


def applies(problem: MotionProblem, solver: Solver) -> bool:
    """
    Return whether the method is to be tried.

    Not where another method solves, nor without a compiler: it takes too many points for functions
    that are interpreted.

    """
    return solver.is_own and problem.compiled_rate() is not None


def pass_barrier(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """Start from a straight line with the motors' limits as a barrier; None if not `applies`."""
    if not applies(problem, solver):
        return None

    def guess(intervals: int) -> CollocationSolution:
        return problem.straight_line(intervals, GaussRule.of(_STAGES))

    return Attempt(result=_pass_on_meshes(problem, guess, _FAR, solver))


def pass_barrier_from_rigid(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """Start from the motion of the same arm made rigid, found by the same method."""
    if not problem.task.arm.n_passive:
        return None
    try:
        rigid = pass_barrier(rigid_problem(problem), solver)
    except InvalidTaskError:  # motors that hold the bent arm may be too weak for the straight one
        return None
    if rigid is None or not rigid.result.converged:
        return rigid
    return Attempt(result=pass_barrier_from(problem, rigid.result.solution, solver))


def pass_barrier_from(problem: MotionProblem, near: CollocationSolution,
                      solver: Solver) -> CollocationResult:
    """Solve a problem from a motion near it, perhaps of the same arm made rigid."""
    def guess(intervals: int) -> CollocationSolution:
        mesh = np.linspace(0, problem.task.duration, intervals + 1, dtype=np.float64)
        rule = GaussRule.of(_STAGES)
        return (near.on_mesh(mesh, rule) if near.nodes.shape[1] == problem.size
                else bend_quasi_statically(problem, near, mesh, rule))

    return _pass_on_meshes(problem, guess, _NEAR, solver)


def _pass_on_meshes(problem: MotionProblem, make_guess: MakeGuess,
                    tries: tuple[tuple[float, float], ...], solver: Solver) -> CollocationResult:
    """Return the solution that a guess leads to, on the first mesh and with the first mu."""
    problem.model.prepare_barrier(solver.monitor)
    barrier, exact = MotionBarrier(problem), solver.with_settings(exact=True)
    rate = barrier.cost_rate
    for share, first in tries:
        count = int(share * max(_FEWEST, problem.fewest_intervals(_STAGES)))
        guess = place_junctions(problem, make_guess(min(count, solver.settings.max_intervals)))
        schedule = BarrierSchedule(first=first * rate, last=_LAST * rate, tolerance=_TOLERANCE,
                                   max_iterations=min(_PATIENCE, solver.settings.max_iterations))
        met = solve_barrier(barrier, guess, barrier.guess(guess, schedule.first), schedule,
                            solver.monitor)
        if not met.converged:
            result = CollocationResult.failed(met.solution, f'with a barrier: {met.message}')
            continue
        result = exact.solve(problem, met.solution)
        if result.status is not SolverStatus.NEWTON_FAILED:
            break
    return result
