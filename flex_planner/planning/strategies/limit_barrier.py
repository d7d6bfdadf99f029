"""
The limit of a payload or a duration in one run, at a price that is nearly endless.

With the motors' limits as a barrier the payload that is worth its price comes to the limit while
mu falls, and so does the duration; no switch is placed and no price is walked. The motion is then
solved as it is, within the limits, at the lower price that leaves the gap that is wanted.

"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from flex_planner.base.errors import FlexPlannerError
from flex_planner.collocation import CollocationSolution, GaussRule, INTERRUPTED, Solver
from flex_planner.collocation.interior_point import (
    BarrierOutcome,
    BarrierSchedule,
    solve_barrier,
)
from flex_planner.optimal_control.barrier_problem import PayloadBarrier
from flex_planner.optimal_control.duration_barrier import DurationBarrier
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.extremals import Extremal, TargetGap
from flex_planner.planning.strategies.free_parameters import DURATION, FreeParameter, PAYLOAD
from flex_planner.planning.strategies.interior_point import applies, pass_barrier
import numpy as np

# of the method, and of its mesh, in those of `fewest_intervals`
STAGES, _FEWEST, _MESH = 4, 14, 0.65
# the mesh, and the next one, in units of it
_FINER = 1, 2
# price, in units of all effort that the motors can spend for what the price is of
_PRICE = 1e3
# mu at first and at last, of what is paid per time
_FIRST, _LAST = 0.15, 3e-4
_TOLERANCE = 0.1
_PATIENCE = 60
# mu at last at the lower price, of the effort that the motors can spend per time, and iterations
_AT_LAST, _FEW = 1e-4, 20
# the price, in units of all effort for the value, that leaves a gap of this share; the gap falls
# with the price to the power 1 / _POWER
_SURE, _GAP, _POWER, _FINEST = 80.0, 2e-4, 0.65, 1e-6


LimitBarrier: TypeAlias = PayloadBarrier | DurationBarrier


@dataclass(frozen=True, kw_only=True)
class _Limit:
    """
    How a value is pushed to its limit.

    Attributes
    ----------
    barrier : callable
        From a motion and a price to its barrier.
    amount : callable
        From a motion to about how much of it there is to pay for [kg, s].
    easier : tuple of float
        Shares of what was reached, tried in turn where there is no motion within the limits.
    cheap : int
        Intervals beyond which it takes longer than what a rigid motion leads to.

    """

    barrier: Callable[[MotionProblem, float], LimitBarrier]
    amount: Callable[[MotionProblem], float]
    easier: tuple[float, ...]
    cheap: int


def moved_mass(problem: MotionProblem) -> float:
    """Return about what the motors move [kg]."""
    return problem.task.payload_mass + problem.model.arm.link_mass


_LIMITS: Mapping[FreeParameter, _Limit] = {
    PAYLOAD: _Limit(barrier=PayloadBarrier, amount=moved_mass,
                    easier=(1.0, 0.99, 0.95), cheap=40),
    DURATION: _Limit(barrier=DurationBarrier, amount=lambda problem: problem.task.duration,
                     easier=(1.0, 1.01, 1.05), cheap=100)}


def reach_limit(parameter: FreeParameter, problem: MotionProblem, solver: Solver,
                target_gap: TargetGap) -> Extremal | None:
    """
    Return a motion with nearly the limit of a value; None if the method does not find one.

    Parameters
    ----------
    parameter : FreeParameter
        ``PAYLOAD`` or ``DURATION``.
    problem : MotionProblem
        With the least payload of interest or a duration that is long enough, and no weights but R.
    solver : Solver
        Of the motion within the limits; if its monitor interrupts it, the extremal says so.
    target_gap : callable
        See `continue_in_price`.

    """
    fallen = _fall_to_limit(parameter, problem, solver)
    if fallen is None:
        return None
    return _solve_there(parameter, problem, *fallen, solver, target_gap) or _solve_easier(
        parameter, problem, fallen[0].restrict(fallen[1].solution)[0], solver)


def reach_exactly(parameter: FreeParameter, problem: MotionProblem, solver: Solver,
                  target_gap: TargetGap) -> Extremal | None:
    """
    Return what `reach_limit` does, but no motion with a value that is easier; None without it.

    Parameters
    ----------
    parameter, problem, solver, target_gap
        As of `reach_limit`.

    """
    fallen = _fall_to_limit(parameter, problem, solver)
    return None if fallen is None else _solve_there(parameter, problem, *fallen, solver,
                                                    target_gap)


def _fall_to_limit(parameter: FreeParameter, problem: MotionProblem,
                   solver: Solver) -> tuple[LimitBarrier, BarrierOutcome] | None:
    """Return a barrier and its end if that is a value nearer to the limit, else None."""
    if not applies(problem, solver):
        return None
    most, limit = _most_effort(problem), _LIMITS[parameter]
    if not np.isfinite(most) or np.isfinite(problem.goal_weights).any():
        return None
    barrier = limit.barrier(problem, _PRICE * most / limit.amount(problem))
    met = _lower_mu(barrier, solver)
    value = np.nan if met is None else barrier.restrict(met.solution)[0]
    if met is None or not parameter.improves(value, parameter.value(problem)):
        return None
    return (barrier, met) if parameter.is_possible(value) else None


def _solve_there(parameter: FreeParameter, problem: MotionProblem, barrier: LimitBarrier,
                 met: BarrierOutcome, solver: Solver, target_gap: TargetGap) -> Extremal | None:
    """Return the motion within the limits at the lower price that leaves the gap wanted."""
    value = barrier.restrict(met.solution)[0]
    price = min(_find_price(problem, value, target_gap(value)), barrier.price)
    near, guess = _lower_price(_LIMITS[parameter].barrier(problem, price), barrier, met, solver)
    return parameter.solve_beyond(problem, near, lambda near: guess, price, solver)


def limit_from_guess(parameter: FreeParameter, problem: MotionProblem,
                     guess: CollocationSolution, solver: Solver) -> float | None:
    """
    Return nearly the limit of a value for the kind of motion that a guess leads to; None if none.

    Parameters
    ----------
    parameter, problem
        As of `reach_limit`.
    guess : CollocationSolution
        With the stages of the method.
    solver : Solver
        Its monitor may stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    most, limit = _most_effort(problem), _LIMITS[parameter]
    if not (applies(problem, solver) and np.isfinite(most)):
        return None
    problem.model.prepare_barrier(solver.monitor)
    barrier = limit.barrier(problem, _PRICE * most / limit.amount(problem))
    met = _fall(barrier, guess, solver)
    return barrier.restrict(met.solution)[0] if met is not None and met.converged else None


def _solve_easier(parameter: FreeParameter, problem: MotionProblem, value: float,
                  solver: Solver) -> Extremal | None:
    """Return the motion with a little less than what was reached with the barrier."""
    patient = solver.with_settings(max_iterations=_PATIENCE)
    for share in _LIMITS[parameter].easier:
        if not parameter.improves(share * value, parameter.value(problem)):
            break
        try:
            near = parameter.with_value(problem, share * value)
            attempt = pass_barrier(near, patient)
            assert attempt is not None  # the method is our own
            result = attempt.result
            price = parameter.price(near, result.solution) if result.converged else 0.0
        except FlexPlannerError:  # too heavy to hold, or the links buckle with hardly more
            continue
        if result.converged or result.status in INTERRUPTED:
            return Extremal(value=share * value, price=price, result=result, problem=near)
    return None


def is_cheap(parameter: FreeParameter, problem: MotionProblem) -> bool:
    """Return whether the method takes few intervals."""
    return _count(problem) <= _LIMITS[parameter].cheap


def _count(problem: MotionProblem) -> int:
    return max(_FEWEST, int(_MESH * problem.fewest_intervals(STAGES)))


def _lower_mu(barrier: LimitBarrier, solver: Solver) -> BarrierOutcome | None:
    """Return the motion at the end of the barrier, from a straight line."""
    problem = barrier.motion
    problem.model.prepare_barrier(solver.monitor)
    for finer in _FINER:
        count = min(finer * _count(problem), solver.settings.max_intervals)
        met = _fall(barrier, problem.straight_line(count, GaussRule.of(STAGES)), solver)
        if met is None or met.converged:
            return met
    return None


def _fall(barrier: LimitBarrier, guess: CollocationSolution,
          solver: Solver) -> BarrierOutcome | None:
    """Return where mu ended that fell from a guess; None if that had no equilibrium."""
    scale = _PRICE * _most_effort(barrier.motion) / barrier.motion.task.duration
    schedule = BarrierSchedule(first=_FIRST * scale, last=_LAST * scale, tolerance=_TOLERANCE,
                               max_iterations=_PATIENCE)
    try:
        first = barrier.extend(guess)
        return solve_barrier(barrier, first, barrier.guess(first, schedule.first), schedule,
                             solver.monitor)
    except FlexPlannerError:  # a payload that no equilibrium carries
        return None


def _find_price(problem: MotionProblem, value: float, wanted: float) -> float:
    """Return a price that leaves about the gap wanted."""
    share = max(wanted / value, _FINEST) if wanted else _FINEST
    return float(_SURE * (_GAP / share)**_POWER * _most_effort(problem) / value)


def _lower_price(cheaper: LimitBarrier, barrier: LimitBarrier, met: BarrierOutcome,
                 solver: Solver) -> tuple[float, CollocationSolution]:
    """Return the value at a lower price and its motion: the barrier's, or that of more mu."""
    ratio, multipliers = cheaper.price / barrier.price, np.ones(met.y.shape[-1])
    multipliers[barrier.free + (multipliers.size - barrier.free) // 2:] = ratio
    costates = np.ones(barrier.size)
    costates[barrier.motion.size // 2:barrier.motion.size] = costates[-1] = ratio
    start = CollocationSolution(met.solution.mesh, met.solution.nodes * costates,
                                met.solution.stages * costates, met.solution.rule)
    last = _AT_LAST * _most_effort(barrier.motion) / barrier.motion.task.duration
    schedule = BarrierSchedule(first=max(met.mu * ratio, last), last=last, tolerance=_TOLERANCE,
                               max_iterations=_FEW)
    try:
        found = solve_barrier(cheaper, start, met.y * multipliers, schedule, solver.monitor)
    except FlexPlannerError:
        return cheaper.restrict(start)
    return cheaper.restrict(found.solution if found.converged else start)


def barrier_price(problem: MotionProblem) -> float:
    """Return a price of payload that is nearly endless [1/kg]; inf without limits of motors."""
    return _PRICE * _most_effort(problem) / moved_mass(problem)


def _most_effort(problem: MotionProblem) -> float:
    """Return the effort of all motors at their limits all the time."""
    parameters = problem.parameters
    torques = parameters.torque_limits.standstill
    return float(parameters.effort_weights @ torques**2) * problem.task.duration / 2
