"""
The largest payload within limits on the way, by the interior-point method.

Limits of motors and limits on the way are one barrier; the payload that is worth its price comes
to the limit while mu falls, see `limit_barrier`.

"""

from __future__ import annotations

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, GaussRule, Solver
from flex_planner.collocation.barrier_mesh import cut_mesh, follow_barrier
from flex_planner.collocation.interior_point import BarrierOutcome, BarrierSchedule
from flex_planner.optimal_control.barrier_problem import PayloadBarrier
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_barrier import PathBarrier
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.planning.strategies.interior_point import applies
from flex_planner.planning.strategies.limit_barrier import barrier_price, moved_mass
from flex_planner.planning.strategies.reached_limit import ReachedLimit
from flex_planner.planning.strategies.within_limits import first_count, first_mesh, STAGES
import numpy as np

# mu at first, and the bounds of it at last, of the price of what is moved per second
_FIRST, _LAST = 0.15, (1e-6, 1e-4)
# of the accuracy, that the barrier may keep
_SHARE, _ACCURACY = 0.5, 1e-3
_TOLERANCE, _PATIENCE = 1e-3, 80
# where Newton's method goes on without slacks and multipliers
_SETTLED = 1e-6


def find_largest_payload(problem: MotionProblem, slacks: PathSlacks,
                         solver: Solver) -> float | None:
    """Return about the largest payload of a kind of motion [kg]; None if none is found."""
    found = reach_largest_payload(problem, slacks, solver)
    return None if found is None else found.value


def reach_largest_payload(problem: MotionProblem, slacks: PathSlacks, solver: Solver,
                          near: CollocationSolution | None = None,
                          accuracy: float = _ACCURACY) -> ReachedLimit | None:
    """
    Return the motion with nearly the largest payload; None if none is found.

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
    accuracy : float
        To which the limit is wanted [kg].

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    price = barrier_price(problem)
    if not applies(problem, solver) or not np.isfinite(price):
        return None
    barrier = PayloadBarrier(problem, price)
    both, rule = PathBarrier(barrier, slacks), GaussRule.of(STAGES)
    start = (problem.straight_line(first_count(problem, solver), rule) if near is None
             else near.on_mesh(first_mesh(problem, solver), rule))
    guess, mass = barrier.extend(start), moved_mass(problem)
    scale = price * mass / problem.task.duration
    y = both.guess(guess, _FIRST * scale)
    limits = (y.shape[-1] - both.free) // 2
    last = float(np.clip(_SHARE * accuracy / (limits * mass), *_LAST))
    schedule = BarrierSchedule(first=_FIRST * scale, last=last * scale, tolerance=_TOLERANCE,
                               max_iterations=_PATIENCE)
    met = _follow(both, guess, y, schedule, solver, slacks.count)
    return None if met is None else _reached(barrier, met, both.free)


def refine_limit(problem: MotionProblem, slacks: PathSlacks, reached: ReachedLimit,
                 solver: Solver) -> ReachedLimit | None:
    """
    Return the same limit on a mesh that resolves how torques come to their limits and leave them.

    Parameters
    ----------
    problem, slacks, solver
        As of `reach_largest_payload`.
    reached : ReachedLimit
        What that returned.

    Returns
    -------
    ReachedLimit or None
        None where the mesh would be too fine.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    assert reached.met is not None
    barrier, old = PayloadBarrier(problem, barrier_price(problem)), reached.met
    both, limits = PathBarrier(barrier, slacks), (old.y.shape[-1] - reached.free) // 2
    schedule = BarrierSchedule(first=old.mu, last=old.mu, tolerance=_SETTLED,
                               max_iterations=_PATIENCE)
    met = _follow(both, old.solution, old.y, schedule, solver, limits)
    if met is None:
        return None
    halves = cut_mesh(both, met.solution, met.y, met.solution.steps > 0)
    finer = _follow(both, *halves, schedule, solver, limits)
    return None if finer is None else _reached(barrier, finer, both.free)


def _follow(both: PathBarrier, guess: CollocationSolution, y: Array, schedule: BarrierSchedule,
            solver: Solver, count: int) -> BarrierOutcome | None:
    """Return where mu ended on meshes cut for the last limits, None if it did not come there."""
    half = both.inner.motion.size // 2
    try:
        met = follow_barrier(
            both, guess, y, schedule, solver.monitor, slacks=lambda z: both.slacks(z[:, :half]),
            count=count, most_intervals=solver.settings.max_intervals)
    except FlexPlannerError:  # a payload that no equilibrium carries
        return None
    return met if met.converged else None


def _reached(barrier: PayloadBarrier, met: BarrierOutcome, free: int) -> ReachedLimit:
    """Return the limit at the end of a barrier."""
    payload, motion = barrier.payload.restrict(met.solution)
    limits, duration = (met.y.shape[-1] - free) // 2, barrier.motion.task.duration
    return ReachedLimit(value=payload, gap=limits * met.mu * duration / barrier.price,
                        motion=motion, met=met, free=free)
