"""
A motion within its limits on the way, from one that leaves them.

The interior-point method takes slacks that are positive, whatever the motion does, and closes the
gap between both while mu falls; its mesh follows. Then the conditions with the barrier that is
left are solved exactly, as those of any motion.

"""

from __future__ import annotations

from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    GaussRule,
    INTERRUPTED,
    Solver,
)
from flex_planner.collocation.barrier_mesh import follow_barrier
from flex_planner.collocation.interior_point import BarrierOutcome, BarrierSchedule
from flex_planner.optimal_control.barrier_problem import MotionBarrier
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_barrier import PathBarrier
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.totals import integrate_totals
import numpy as np

# of the method, and intervals of its first mesh
_STAGES, _FEWEST = 4, 40
# mu at first and at last, in units of the cost per time of the motion that it starts from
_TRIES = ((1e-2, 1e-4), (1e-1, 1e-4), (1e-1, 1e-3))
_TOLERANCE = 1e-4
# iterations on a mesh, and of a first look from a motion like it
_PATIENCE, _FIRST_LOOK = 60, 10
# mu at first from there, in units of that at last
_NEAR = 10.0


def solve_within_limits(problem: MotionProblem, slacks: PathSlacks, near: CollocationSolution,
                        solver: Solver) -> tuple[ConstrainedMotion, CollocationResult]:
    """
    Return the conditions with a small barrier, and their solution if one was found.

    Parameters
    ----------
    problem : MotionProblem
        Without limits on the way.
    slacks : PathSlacks
        Of the limits.
    near : CollocationSolution
        A motion of the same task, which may leave the limits.
    solver : Solver
        Its monitor may interrupt the work.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    rate = find_cost_rate(problem, near)
    limited = ConstrainedMotion(problem, slacks, _TRIES[0][1] * rate)
    failed: CollocationResult | None = None
    for first, last in _TRIES:
        limited = limited.with_mu(last * rate)
        met = lower_barrier(problem, slacks, near, first * rate, last * rate, solver)
        if not met.converged:
            failed = failed or CollocationResult.failed(met.solution, met.message)
            continue
        result = finish(limited, met.solution, solver)
        if result.converged or result.status in INTERRUPTED:
            return limited, result
        failed = result
    assert failed is not None
    return limited, failed


def solve_again(problem: MotionProblem, slacks: PathSlacks, near: CollocationSolution,
                solver: Solver) -> tuple[ConstrainedMotion, CollocationResult]:
    """
    Return what `solve_within_limits` does, from a motion that limits have bent already.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    rate = _TRIES[0][1] * find_cost_rate(problem, near)
    limited = ConstrainedMotion(problem, slacks, rate)
    result = solver.with_settings(stages=_STAGES).patient(_FIRST_LOOK).solve(limited, near)
    if result.converged or result.status in INTERRUPTED:
        return limited, result
    met = lower_barrier(problem, slacks, near, _NEAR * rate, rate, solver)
    if not met.converged:
        return limited, CollocationResult.failed(met.solution, met.message)
    return limited, finish(limited, met.solution, solver)


def lower_barrier(problem: MotionProblem, slacks: PathSlacks, near: CollocationSolution,
                  first: float, last: float, solver: Solver) -> BarrierOutcome:
    """Return the motion at the end of a barrier that falls from one mu to another."""
    half = problem.size // 2
    barrier = PathBarrier(MotionBarrier(problem), slacks)
    count = min(max(_FEWEST, problem.fewest_intervals(_STAGES)), solver.settings.max_intervals)
    mesh = np.linspace(0, problem.task.duration, count + 1, dtype=np.float64)
    guess = near.on_mesh(mesh, GaussRule.of(_STAGES))
    schedule = BarrierSchedule(first=first, last=last, tolerance=_TOLERANCE,
                               max_iterations=min(_PATIENCE, solver.settings.max_iterations))
    return follow_barrier(
        barrier, guess, barrier.guess(guess, first), schedule, solver.monitor,
        slacks=lambda z: slacks(z[:, :half]), count=slacks.count,
        most_intervals=solver.settings.max_intervals)


def finish(limited: ConstrainedMotion, near: CollocationSolution,
           solver: Solver) -> CollocationResult:
    """Solve the conditions with their barrier from a motion within the limits."""
    quick = solver.with_settings(stages=_STAGES)
    result = quick.solve(limited, near)
    if result.converged or result.status in INTERRUPTED:
        return result
    return quick.with_settings(exact=True).solve(limited, near)


def find_cost_rate(problem: MotionProblem, near: CollocationSolution) -> float:
    """Return the cost per time of a motion, or what the motors may spend if it costs nothing."""
    cost = integrate_totals(problem, near).cost / problem.task.duration
    return cost if cost > 0 else MotionBarrier(problem).cost_rate
