"""
The largest payload within limits on the way, by the interior-point method.

Limits of motors and limits on the way are one barrier; the payload that is worth its price comes
to the limit while mu falls, see `limit_barrier`.

"""

from __future__ import annotations

from flex_planner.base.errors import FlexPlannerError
from flex_planner.collocation import CollocationSolution, GaussRule, Solver
from flex_planner.collocation.barrier_mesh import follow_barrier
from flex_planner.collocation.interior_point import BarrierSchedule
from flex_planner.optimal_control.barrier_problem import PayloadBarrier
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_barrier import PathBarrier
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.planning.strategies.interior_point import applies
from flex_planner.planning.strategies.limit_barrier import barrier_price, moved_mass
from flex_planner.planning.strategies.within_limits import first_count, first_mesh, STAGES
import numpy as np

# mu at first and at last, of the price of what is moved per second
_FIRST, _LAST = 0.15, 1e-5
_TOLERANCE, _PATIENCE = 1e-3, 80


def find_largest_payload(problem: MotionProblem, slacks: PathSlacks,
                         solver: Solver) -> float | None:
    """Return about the largest payload of a kind of motion [kg]; None if none is found."""
    found = reach_largest_payload(problem, slacks, solver)
    return None if found is None else found[0]


def reach_largest_payload(problem: MotionProblem, slacks: PathSlacks, solver: Solver,
                          near: CollocationSolution | None = None,
                          ) -> tuple[float, float, CollocationSolution] | None:
    """
    Return the payload [kg], what the barrier keeps of it at most [kg], and the motion.

    The second is the number of limits times mu and the duration, by the price: a bound where the
    task is convex, else the size of it.

    Parameters
    ----------
    problem : MotionProblem
        Of a task whose goal is met, with no weights but R.
    slacks : PathSlacks
        Of the limits on the way.
    solver : Solver
        Its monitor may interrupt the work.
    near : CollocationSolution, optional
        A motion to start from; a straight line if not given.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    price = barrier_price(problem)
    if not applies(problem, solver) or not np.isfinite(price):
        return None
    barrier = PayloadBarrier(problem, price)
    both = PathBarrier(barrier, slacks)
    rule, half = GaussRule.of(STAGES), problem.size // 2
    start = (problem.straight_line(first_count(problem, solver), rule) if near is None
             else near.on_mesh(first_mesh(problem, solver), rule))
    guess = barrier.extend(start)
    scale = price * moved_mass(problem) / problem.task.duration
    schedule = BarrierSchedule(first=_FIRST * scale, last=_LAST * scale, tolerance=_TOLERANCE,
                               max_iterations=_PATIENCE)
    try:
        met = follow_barrier(
            both, guess, both.guess(guess, schedule.first), schedule, solver.monitor,
            slacks=lambda z: slacks(z[:, :half]), count=slacks.count,
            most_intervals=solver.settings.max_intervals)
    except FlexPlannerError:  # a payload that no equilibrium carries
        return None
    if not met.converged:
        return None
    payload, motion = barrier.payload.restrict(met.solution)
    limits = (met.y.shape[-1] - both.free) // 2
    return payload, limits * schedule.last * problem.task.duration / price, motion
