"""
Planning again in motion: to another goal, or from where the arm really is, within milliseconds.

What is left of the running plan is the guess, on a mesh so coarse that Newton's method takes
milliseconds. How exact the solution is nobody estimates; a simulation shows where its torque
leads.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array, number
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.mesh import switching_times
from flex_planner.collocation.newton import newton
from flex_planner.dynamics.statics import residual_vibration
from flex_planner.optimal_control.constrained_motion import slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION, MIN_DURATION
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.certificate import Certificate, simulate_to_goal
from flex_planner.planning.largest_rates import find_largest_rates
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.rest_of_motion import Departure
from flex_planner.planning.verdict import find_refusal
import numpy as np
from numpy.typing import ArrayLike

REPLANNED = 'planned again in motion'
TIP_TOLERANCE = 1e-3
MIN_BUDGET, MAX_BUDGET = 1e-3, 60.0
# how many intervals are tried
INTERVALS = (12, 24, 40)
_NEWTON_TOLERANCE, _MOST_ITERATIONS = 1e-4, 15
_RTOL = 1e-6
# of the time to the arrival: what is tried where it may be later
_LATER = 1.0, 1.5, 2.25


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replan:
    """
    What came of planning again.

    Attributes
    ----------
    plan : Plan
        From where the arm is to the goal, on a clock of its own; check `solved`. Its certificate
        has what one simulation of its torque shows; errors are not estimated.
    at : float
        When it begins, on the clock of the running plan [s].
    torque_step : numpy.ndarray, shape (n,)
        By how much torques jump there; NaN without a solution [N m].
    delay : float
        By how much later than asked the arm arrives [s].

    """

    plan: Plan
    at: float
    torque_step: Array
    delay: float = 0.0

    @property
    def solved(self) -> bool:
        """Return whether it may replace the running plan, which goes on otherwise."""
        return self.plan.solved


def replan(plan: Plan, at: float, *, state: ArrayLike | None = None,
           goal: ArrayLike | None = None, duration: float | None = None, keep_time: bool = False,
           torque: ArrayLike | None = None, torque_rate_weight: ArrayLike | None = None,
           budget: float = 0.05, tip_tolerance: float = TIP_TOLERANCE,
           monitor: Monitor | None = None) -> Replan:
    """
    Plan again while a plan is carried out.

    Parameters
    ----------
    plan : Plan
        That runs; solved, to a goal where the arm comes to rest, without via points, limits
        on the way that bend it, a free duration, bounds of torque rates, or robustness. It stays
        as it is.
    at : float
        When the new plan begins, at least 1 ms before the arrival of the running one [s].
    state : array_like, shape (2 n_t,), optional
        x = (q, q') of the arm then, bending included; by default what the running plan has.
    goal : array_like, shape (n,), optional
        Joint angles to come to rest at; those of the running plan by default [rad].
    duration : float, optional
        From `at` to the arrival, 1e-9 to 1000 [s]; by default that of the running plan stays.
    keep_time : bool
        Whether the arm must arrive then; otherwise 1.5 and 2.25 times the duration are tried, too,
        if that is too little.
    torque : array_like, shape (n,), optional
        That acts at `at`; by default what the running plan has [N m].
    torque_rate_weight : array_like, a number or shape (n,), optional
        Price of the rates of the torques, see `Task`: they have no jumps then, and begin with the
        one that acts. By default that of the running plan; empty: torques may jump.
    budget : float
        Time that it may take, 0.001 to 60 [s].
    tip_tolerance : float
        How far from the goal the simulated tip may arrive, and how much links may vibrate then,
        > 0 [m].
    monitor : Monitor, optional
        In place of one with the budget.

    Returns
    -------
    Replan
        Where it failed, ``plan.status`` and ``plan.message`` say how: ``NOT_CONVERGED`` or
        ``CERTIFICATE_FAILED`` for want of time until the arrival, ``TIMEOUT`` for want of budget,
        ``LIMIT_VIOLATED`` and ``BENT_TOO_FAR`` for limits of the arm, or of its motors where
        torques have no jumps.

    Raises
    ------
    InvalidTaskError
        If the plan is none that can be planned again.
    InvalidValueError
        If a value breaks its bound, or the goal those of the joints.
    HoldingError
        If a motor is too weak to hold the arm at the goal.

    """
    departure = Departure.of(plan, at, state, torque, torque_rate_weight)
    watch = monitor or budgeted(budget)
    number('tip_tolerance', tip_tolerance, above=0, unit='m')
    asked = departure.left if duration is None else number(
        'duration', duration, at_least=MIN_DURATION, at_most=MAX_DURATION, unit='s')
    best: Plan | None = None
    for factor in _LATER[:1] if keep_time else _LATER:
        if factor * asked > MAX_DURATION:
            break
        problem = departure.problem(goal, factor * asked)
        best = plan_rest(departure, problem, watch, tip_tolerance)
        if best.solved or best.status in STOP_STATUS.values():
            break
    assert best is not None
    return Replan(plan=best, at=departure.at, torque_step=torque_step(departure, best),
                  delay=best.task.duration - asked)


def budgeted(budget: float) -> Monitor:
    """Return a monitor that stops work after a time [s]."""
    return Monitor(time_limit=number('budget', budget, at_least=MIN_BUDGET, at_most=MAX_BUDGET,
                                     unit='s'))


def plan_rest(departure: Departure, problem: MotionProblem, monitor: Monitor,
              tip_tolerance: float = TIP_TOLERANCE, until: float | None = None) -> Plan:
    """
    Return the plan of a motion from a departure, on the first mesh that leads to its goal.

    Parameters
    ----------
    departure : Departure
        Where it leaves the plan that runs.
    problem : MotionProblem
        Of `Departure.problem`.
    monitor : Monitor
        May stop it, which is a status of the plan.
    tip_tolerance : float
        As of `replan` [m].
    until : float, optional
        On the clock of the plan that runs: up to where that is the guess; to its end by
        default [s].

    """
    plan = Plan(task=problem.task, status=PlanStatus.NOT_CONVERGED, strategy=REPLANNED,
                message='', problem=problem, solution=None)
    try:
        guess = departure.guess(problem, INTERVALS[0], until)
        for solution, message in _solve(problem, guess, monitor):
            plan = replace(plan, message=message) if solution is None else _look_at(
                plan, solution, monitor, tip_tolerance)
            if plan.status not in (PlanStatus.NOT_CONVERGED, PlanStatus.CERTIFICATE_FAILED):
                break
    except StoppedError as error:
        plan = replace(plan, status=STOP_STATUS[error.reason], message=str(error))
    return replace(plan, iterations=monitor.iteration, planning_time=monitor.elapsed)


def torque_step(departure: Departure, again: Plan) -> Array:
    """Return by how much torques jump when a plan begins, NaN without one, shape (n,) [N m]."""
    if again.solution is None:
        return np.full(departure.torque.size, np.nan)
    step: Array = again.torques(0.0)[0] - departure.torque
    return step


def _solve(problem: MotionProblem, guess: CollocationSolution, monitor: Monitor,
           ) -> Iterator[tuple[CollocationSolution | None, str]]:
    """Yield solutions on finer and finer meshes, None with a message where there is none."""
    for intervals in INTERVALS:
        monitor.check()
        mesh = np.linspace(0, problem.task.duration, intervals + 1, dtype=np.float64)
        guess = guess.on_mesh(mesh) if guess.intervals != intervals else guess
        outcome = newton(problem, guess, tolerance=_NEWTON_TOLERANCE, monitor=monitor,
                         max_iterations=_MOST_ITERATIONS)
        if outcome.stopped is not None:
            raise StoppedError(outcome.stopped)
        yield (outcome.solution, '') if outcome.converged else (None, (
            f'{outcome.message}: a nearer goal or more time until the arrival may do'))
        if outcome.converged:
            guess = outcome.solution


def _look_at(plan: Plan, solution: CollocationSolution, monitor: Monitor,
             tip_tolerance: float) -> Plan:
    """Return a plan with a solution, judged by one simulation and the limits of the arm."""
    problem, n_t = plan.problem, plan.arm.n_coordinates
    final, target = simulate_to_goal(problem, solution, monitor, _RTOL)
    miss = final - target
    ends = tip_position(plan.arm, np.stack([final[:n_t], target[:n_t]]))
    tip_error = float(np.nan_to_num(np.linalg.norm(ends[1] - ends[0]), nan=np.inf))
    half = float(np.nan_to_num(miss @ miss / 2, nan=np.inf))
    vibration = _vibration(problem, miss)
    totals = integrate_totals(problem, solution)
    # limits on the way are looked at in the solution, not in the simulation
    known = np.inf if slacks_of(problem) is None else -np.inf
    plan = replace(plan, solution=solution, cost=totals.cost, effort=totals.effort,
                   energy=totals.energy, saturation=totals.saturation,
                   switching_times=switching_times(problem, solution),
                   torque_rates=find_largest_rates(problem, solution),
                   certificate=Certificate(tip_error=tip_error, boundary_error=half,
                                           residual_vibration=vibration, via_error=0.0,
                                           limit_slack=known))
    if not (max(tip_error, vibration) <= tip_tolerance and half <= plan.task.tolerance):
        return replace(plan, status=PlanStatus.CERTIFICATE_FAILED, message=(
            f'the simulated tip arrives {1e3 * tip_error:.2g} mm from the goal and leaves '
            f'{1e3 * vibration:.2g} mm of vibration, but may {1e3 * tip_tolerance:g} mm of '
            f'either; half of the squared error of the state is {half:.2g}, but may be '
            f'{plan.task.tolerance:g}: more time until the arrival may do'))
    refused = find_refusal(problem, solution)
    status, message = refused or (PlanStatus.SOLVED, (
        f'{REPLANNED}; the simulated tip arrives {1e3 * tip_error:.2g} mm from the goal'))
    return replace(plan, status=status, message=message)


def _vibration(problem: MotionProblem, miss: Array) -> float:
    """Return the bending that is left if the joints are locked on arrival [m]."""
    if not np.isfinite(miss).all():
        return np.inf
    rest = problem.goal[:miss.size // 2]
    return residual_vibration(problem.model, np.concatenate([rest, np.zeros_like(rest)]) + miss,
                              rest, problem.parameters)
