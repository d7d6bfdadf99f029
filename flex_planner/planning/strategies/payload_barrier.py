"""
The largest payload in one run of the interior-point method, at a price that is nearly endless.

With the motors' limits as a barrier the payload that is worth its price comes to the limit while
mu falls; no switch is placed and no price is walked. The motion is then solved as it is, within
the limits, at the lower price that leaves the gap that is wanted.

"""

from __future__ import annotations

from flex_planner.base.errors import FlexPlannerError
from flex_planner.collocation import CollocationSolution, GaussRule, INTERRUPTED, Solver
from flex_planner.collocation.interior_point import BarrierSchedule, solve_barrier
from flex_planner.optimal_control.barrier_problem import PayloadBarrier
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.extremals import Extremal, TargetGap
from flex_planner.planning.strategies.free_parameters import PAYLOAD
from flex_planner.planning.strategies.interior_point import applies, pass_barrier
import numpy as np

# of the method, and of its mesh, in those of `fewest_intervals`
_STAGES, _FEWEST, _MESH = 4, 14, 0.65
# more of them take longer than what a rigid motion leads to
_CHEAP = 40
# price, in units of all effort that the motors can spend for the mass that is moved
_PRICE = 1e3
# mu at first and at last, of that price
_FIRST, _LAST = 0.15, 3e-4
_TOLERANCE = 0.1
_PATIENCE = 60
# where the motion within the limits is not found, those with these shares of the payload are tried
_LESS = (0.99, 0.95)
# the price, in units of all effort for the payload, that leaves a gap of this share; the gap falls
# with the price to the power 1 / _POWER
_SURE, _GAP, _POWER, _FINEST = 80.0, 2e-4, 0.65, 1e-6


def reach_limit(problem: MotionProblem, solver: Solver, target_gap: TargetGap) -> Extremal | None:
    """
    Return a motion with nearly the largest payload; None if the method does not find one.

    Parameters
    ----------
    problem : MotionProblem
        With the least payload of interest, and no weights but R.
    solver : Solver
        Of the motion within the limits; if its monitor interrupts it, the extremal says so.
    target_gap : callable
        See `continue_in_price`.

    """
    if not applies(problem, solver):
        return None
    most = _most_effort(problem)
    if not np.isfinite(most) or np.isfinite(problem.goal_weights).any():
        return None
    barrier = PayloadBarrier(problem, _PRICE * most / moved_mass(problem))
    found = _lower_mu(barrier, solver)
    if found is None:
        return None
    payload, motion = barrier.payload.restrict(found)
    if not PAYLOAD.improves(payload, PAYLOAD.value(problem)) or not PAYLOAD.is_possible(payload):
        return None
    price, guess = _cheapen(barrier, payload, motion, target_gap(payload))
    reached = PAYLOAD.solve_beyond(problem, payload, lambda near: guess, price, solver)
    return reached or _solve_below(problem, payload, solver)


def _solve_below(problem: MotionProblem, payload: float, solver: Solver) -> Extremal | None:
    """Return the motion with a little less than what was reached with the barrier."""
    patient = solver.with_settings(max_iterations=_PATIENCE)
    for share in _LESS:
        if not PAYLOAD.improves(share * payload, PAYLOAD.value(problem)):
            break
        try:
            near = PAYLOAD.with_value(problem, share * payload)
            attempt = pass_barrier(near, patient)
            assert attempt is not None  # the method is our own
            result = attempt.result
            price = PAYLOAD.price(near, result.solution) if result.converged else 0.0
        except FlexPlannerError:  # too heavy to hold, or the links buckle with hardly more
            continue
        if result.converged or result.status in INTERRUPTED:
            return Extremal(value=share * payload, price=price, result=result, problem=near)
    return None


def is_cheap(problem: MotionProblem) -> bool:
    """Return whether the method takes few intervals."""
    return _count(problem) <= _CHEAP


def _count(problem: MotionProblem) -> int:
    return max(_FEWEST, int(_MESH * problem.fewest_intervals(_STAGES)))


def _lower_mu(barrier: PayloadBarrier, solver: Solver) -> CollocationSolution | None:
    """Return the motion at the end of the barrier."""
    problem = barrier.motion
    problem.model.prepare_barrier(solver.monitor)
    count = min(_count(problem), solver.settings.max_intervals)
    guess = barrier.extend(problem.straight_line(count, GaussRule.of(_STAGES)))
    scale = barrier.price * moved_mass(problem) / problem.task.duration
    schedule = BarrierSchedule(first=_FIRST * scale, last=_LAST * scale, tolerance=_TOLERANCE,
                               max_iterations=_PATIENCE)
    try:
        met = solve_barrier(barrier, guess, barrier.guess(guess, schedule.first), schedule,
                            solver.monitor)
    except FlexPlannerError:  # a payload that no equilibrium carries
        return None
    return met.solution if met.converged else None


def _cheapen(barrier: PayloadBarrier, payload: float, motion: CollocationSolution,
             wanted: float) -> tuple[float, CollocationSolution]:
    """Return a price that leaves about the gap wanted, and the motion with its costates."""
    share = max(wanted / payload, _FINEST) if wanted else _FINEST
    price = _SURE * (_GAP / share)**_POWER * _most_effort(barrier.motion) / payload
    price = min(price, barrier.price)
    costates = np.ones(barrier.motion.size)
    costates[barrier.motion.size // 2:] = price / barrier.price
    return price, CollocationSolution(motion.mesh, motion.nodes * costates,
                                      motion.stages * costates, motion.rule)


def barrier_price(problem: MotionProblem) -> float:
    """Return a price of payload that is nearly endless [1/kg]; inf without limits of motors."""
    return _PRICE * _most_effort(problem) / moved_mass(problem)


def _most_effort(problem: MotionProblem) -> float:
    """Return the effort of all motors at their limits all the time."""
    parameters = problem.parameters
    torques = parameters.torque_limits.standstill
    return float(parameters.effort_weights @ torques**2) * problem.task.duration / 2


def moved_mass(problem: MotionProblem) -> float:
    """Return about what the motors move [kg]."""
    links = sum(link.mass for link in problem.model.arm.links)
    return problem.task.payload_mass + links
