"""
The largest payload and the shortest duration of motions whose torques have bounds of their rates.

Limits of states and bounds of rates are one barrier; the value that is worth its price comes to
the limit while mu falls, see `limit_barrier`. What the task pays for rates is left out, as are all
weights but R: it does not change what the arm can do.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError
from flex_planner.collocation import CollocationSolution, GaussRule, Solver
from flex_planner.collocation.barrier_mesh import follow_barrier
from flex_planner.collocation.interior_point import BarrierSchedule
from flex_planner.optimal_control.constrained_motion import relieve_ends, slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_barrier import PathBarrier
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.state_duration_barrier import StateDurationBarrier
from flex_planner.optimal_control.state_payload_barrier import StatePayloadBarrier
from flex_planner.planning.strategies.free_parameters import FreeParameter, PAYLOAD
from flex_planner.planning.strategies.homotopies import drop_weights
from flex_planner.planning.strategies.limit_barrier import barrier_price, moved_mass
from flex_planner.planning.strategies.reached_limit import ReachedLimit
from flex_planner.planning.strategies.within_limits import first_count, first_mesh, STAGES
import numpy as np

# mu at first, and the bounds of it at last, of the price of the value per second
_FIRST, _LAST = 0.15, (1e-6, 1e-4)
# of the accuracy, that the barrier may keep
_SHARE = 0.5
_TOLERANCE, _PATIENCE = 1e-3, 80
# of the duration, over which torques may turn at least
_TURN = 1 / 200


def reach_limit_without_jumps(parameter: FreeParameter, problem: MotionProblem, solver: Solver,
                              accuracy: float, near: CollocationSolution | None,
                              ) -> ReachedLimit | None:
    """
    Return a motion with nearly the limit of a value; None if the method does not find one.

    Parameters
    ----------
    parameter : FreeParameter
        ``PAYLOAD`` or ``DURATION``.
    problem : MotionProblem
        Whose torques are states, some of them with bounds of their rates.
    solver : Solver
        Its monitor may interrupt the work.
    accuracy : float
        To which the limit is wanted [kg, s].
    near : CollocationSolution or None
        A motion to start from; a straight line without.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    bare = _without_prices(problem)
    slacks = slacks_of(bare)
    most = barrier_price(bare) * moved_mass(bare)
    if slacks is None or not np.isfinite(most):
        return None
    slacks = relieve_ends(bare, slacks)
    amount = moved_mass(bare) if parameter is PAYLOAD else bare.task.duration
    barrier, both = _barriers(parameter, bare, slacks, most / amount)
    rule = GaussRule.of(STAGES)
    start = (bare.straight_line(first_count(bare, solver), rule) if near is None
             else near.on_mesh(first_mesh(bare, solver), rule))
    scale, limits = most / bare.task.duration, slacks.count + 2 * _count_bounds(bare)
    last = float(np.clip(_SHARE * accuracy / (limits * amount), *_LAST))
    schedule = BarrierSchedule(first=_FIRST * scale, last=last * scale, tolerance=_TOLERANCE,
                               max_iterations=_PATIENCE)
    states = bare.layout.states
    try:
        met = follow_barrier(
            both, barrier.extend(start), both.guess(start, schedule.first), schedule,
            solver.monitor, slacks=lambda z: slacks(z[:, states]), count=slacks.count,
            most_intervals=solver.settings.max_intervals)
    except FlexPlannerError:  # a payload that no equilibrium carries
        return None
    if not met.converged:
        return None
    value, motion = barrier.restrict(met.solution)
    return ReachedLimit(value=value, gap=limits * last * amount, motion=motion, met=met,
                        free=_count_bounds(bare))


def _barriers(parameter: FreeParameter, problem: MotionProblem, slacks: PathSlacks, price: float,
              ) -> tuple[StatePayloadBarrier | StateDurationBarrier, PathBarrier]:
    """Return the barrier that frees the value, and the one with the limits of states."""
    if parameter is PAYLOAD:
        barrier = StatePayloadBarrier(problem, price)
        return barrier, PathBarrier(barrier, slacks)
    timed = StateDurationBarrier(problem, slacks, price)
    return timed, timed


def _without_prices(problem: MotionProblem) -> MotionProblem:
    """Return the problem with nothing but effort to count, and hardly a price on rates."""
    bare = drop_weights(problem)
    turn = _TURN * bare.task.duration
    task = replace(bare.task, torque_rate_weight=bare.task.effort_weights * turn**2)
    return MotionProblem(bare.model, task, bare.parameters,
                         via_times=bare.junctions if bare.junctions.size else None)


def _count_bounds(problem: MotionProblem) -> int:
    """Return how many torques have a bound of their rates."""
    return int(np.isfinite(problem.task.torque_rate_bounds).sum())
