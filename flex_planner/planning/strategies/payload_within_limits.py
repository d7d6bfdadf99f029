"""
The largest payload within limits on the way, by the interior-point method.

Limits of motors and limits on the way are one barrier; the payload that is worth its price comes
to the limit while mu falls, see `limit_barrier`. A mesh that is too coarse for how often torques
switch gives a payload that is wrong by more than the barrier keeps of it, either way: it counts
once a finer mesh says the same.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, GaussRule, Solver
from flex_planner.collocation.barrier_mesh import cut_mesh, follow_barrier
from flex_planner.collocation.barrier_walk import lower_slowly, settle, walk_barrier
from flex_planner.collocation.interior_point import (
    BarrierOutcome,
    BarrierProblem,
    BarrierSchedule,
)
from flex_planner.optimal_control.barrier_problem import PayloadBarrier
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_barrier import PathBarrier
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.planning.strategies.easier_arm import ease_arm, Easier
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
# of mu at first, where a motion counts though mu falls no further
_ENOUGH = 0.01
# where Newton's method goes on without slacks and multipliers
_SETTLED = 1e-6
# mu from which it falls on a finer mesh, by that at last, one after the other, and at most by that
# at first, from which there may be no way; iterations to come to it
_RAISED, _HIGHEST, _RAISING = (1e3, 30.0), 0.01, 40
# meshes that are tried, and the share of the accuracy by which the payload may differ on the last
# two
_FINER, _STANDS = 3, 0.25


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
    if not _is_reachable(problem, solver):
        return None
    rule = GaussRule.of(STAGES)
    start = (problem.straight_line(first_count(problem, solver), rule) if near is None
             else near.on_mesh(first_mesh(problem, solver), rule))
    barrier, both = _barriers(problem, slacks)
    guess = barrier.extend(start)
    y = both.guess(guess, _first_mu(problem))
    met = _follow(both, guess, y, _schedule(both, y, accuracy), solver, slacks.count)
    return None if met is None else _reached(barrier, met, both.free)


def reach_from_easier_arm(problem: MotionProblem, slacks: PathSlacks, solver: Solver,
                          accuracy: float = _ACCURACY) -> ReachedLimit | None:
    """
    Return what `reach_largest_payload` does, from the motion of an arm that is easier to move.

    The barrier of soft links, or of friction that jumps, has no way from a straight line; that of
    the same arm ten times as stiff, or with smoother friction, has, and leads there.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    if not _is_reachable(problem, solver):
        return None
    for easier in ease_arm(problem):
        try:
            found = _reach_from(easier, problem, slacks, solver, accuracy)
        except FlexPlannerError:  # a payload that no equilibrium carries
            continue
        if found is not None:
            return found
    return None


def _reach_from(easier: Easier, problem: MotionProblem, slacks: PathSlacks, solver: Solver,
                accuracy: float) -> ReachedLimit | None:
    """Return the limit from that of easier arms, perhaps with a larger barrier than is wanted."""
    price, mu = barrier_price(problem), _first_mu(problem)

    def family(share: float) -> tuple[BarrierProblem, float]:
        return PathBarrier(PayloadBarrier(easier(share), price), slacks), mu

    easiest = PayloadBarrier(easier(0.0), price)
    met = _settle_on_line(PathBarrier(easiest, slacks), easiest, mu, solver)
    if met.converged:
        met = walk_barrier(family, met, solver.monitor)
    if not met.converged:
        return None
    barrier, both = _barriers(problem, slacks)
    met = lower_slowly(both, met, _schedule(both, met.y, accuracy).last, solver.monitor)
    if met.mu > _ENOUGH * mu:
        return None
    return _reached(barrier, replace(met, converged=True), both.free)  # it is, at its mu


def _settle_on_line(both: PathBarrier, barrier: PayloadBarrier, mu: float,
                    solver: Solver) -> BarrierOutcome:
    """Return what a straight line leads to at one mu."""
    motion = barrier.motion
    guess = barrier.extend(motion.straight_line(first_count(motion, solver), GaussRule.of(STAGES)))
    start = BarrierOutcome(guess, both.guess(guess, mu), mu, False, np.inf, 0, '')
    return settle(both, mu, start, solver.monitor, patience=_PATIENCE)


def refine_limit(problem: MotionProblem, slacks: PathSlacks, reached: ReachedLimit,
                 solver: Solver, accuracy: float = _ACCURACY) -> ReachedLimit | None:
    """
    Return the same limit on a mesh that resolves how torques come to their limits and leave them.

    Parameters
    ----------
    problem, slacks, solver, accuracy
        As of `reach_largest_payload`.
    reached : ReachedLimit
        What that returned.

    Returns
    -------
    ReachedLimit or None
        Its gap has what the last mesh changed besides what the barrier keeps. None where no mesh
        says the same as the one before, or it would be too fine.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    for _ in range(_FINER):
        finer = _refine(problem, slacks, reached, solver)
        if finer is None:
            return None
        change = abs(finer.value - reached.value)
        if change <= _STANDS * accuracy:
            return replace(finer, gap=finer.gap + change)
        reached = finer
    return None


def _refine(problem: MotionProblem, slacks: PathSlacks, reached: ReachedLimit,
            solver: Solver) -> ReachedLimit | None:
    """
    Return the same limit on a mesh at least twice as fine.

    Where mu is small what lies between the points of the coarse mesh is no start, so it is raised.

    """
    assert reached.met is not None
    (barrier, both), highest = _barriers(problem, slacks), _HIGHEST * _first_mu(problem)
    for raised in sorted({min(share * reached.met.mu, highest) for share in _RAISED},
                         reverse=True):
        try:
            met = _follow_from(raised, both, reached.met, solver)
        except FlexPlannerError:  # a payload that no equilibrium carries
            continue
        if met is not None and met.converged:
            return _reached(barrier, met, both.free)
    return None


def _follow_from(raised: float, both: PathBarrier, old: BarrierOutcome,
                 solver: Solver) -> BarrierOutcome | None:
    """Return where mu ends that is raised on a finer mesh, and falls to what it was."""
    limits = (old.y.shape[-1] - both.free) // 2
    schedule = BarrierSchedule(first=raised, last=old.mu, tolerance=_TOLERANCE,
                               max_iterations=_PATIENCE)
    start = settle(both, raised, old, solver.monitor, patience=_RAISING)
    halves = cut_mesh(both, start.solution, start.y, start.solution.steps > 0)
    met = _follow(both, *halves, schedule, solver, limits)
    return None if met is None else settle(both, old.mu, met, solver.monitor, _SETTLED)


def _is_reachable(problem: MotionProblem, solver: Solver) -> bool:
    """Return whether the method applies, and anything is a limit."""
    return applies(problem, solver) and bool(np.isfinite(barrier_price(problem)))


def _barriers(problem: MotionProblem, slacks: PathSlacks) -> tuple[PayloadBarrier, PathBarrier]:
    """Return the barrier of the motors' limits, and that of both."""
    barrier = PayloadBarrier(problem, barrier_price(problem))
    return barrier, PathBarrier(barrier, slacks)


def _first_mu(problem: MotionProblem) -> float:
    """Return mu at first."""
    return _FIRST * barrier_price(problem) * moved_mass(problem) / problem.task.duration


def _schedule(both: PathBarrier, y: Array, accuracy: float) -> BarrierSchedule:
    """Return how mu falls to what keeps a share of the accuracy."""
    limits, motion = (y.shape[-1] - both.free) // 2, both.inner.motion
    last = float(np.clip(_SHARE * accuracy / (limits * moved_mass(motion)), *_LAST))
    first = _first_mu(motion)
    return BarrierSchedule(first=first, last=last * first / _FIRST, tolerance=_TOLERANCE,
                           max_iterations=_PATIENCE)


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
