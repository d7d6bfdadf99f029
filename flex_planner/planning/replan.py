"""
Planning again in motion: to another goal, or from where the arm really is, within milliseconds.

What is left of the running plan is the guess, on a mesh so coarse that Newton's method takes
milliseconds. How exact the solution is nobody estimates; a simulation shows where its torque
leads.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array, number, vector
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.collocation.mesh import switching_times
from flex_planner.collocation.newton import newton
from flex_planner.dynamics.statics import residual_vibration
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion, slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import MAX_DURATION
from flex_planner.optimal_control.torque_offset import OffsetProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.certificate import Certificate, simulate_to_goal
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.verdict import find_refusal
import numpy as np

REPLANNED = 'planned again in motion'
TIP_TOLERANCE = 1e-3
MIN_BUDGET, MAX_BUDGET = 1e-3, 60.0
# points of an interval, and how many intervals are tried
_STAGES, _INTERVALS = 8, (12, 24, 40)
_NEWTON_TOLERANCE, _MOST_ITERATIONS = 1e-4, 15
_RTOL = 1e-6
# of what is left: times that are tried where the arrival may be later
_LATER = 1.0, 1.5, 2.25
# below which nothing is planned any more [s]
_LEAST_LEFT = 1e-3


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

    """

    plan: Plan
    at: float
    torque_step: Array

    @property
    def solved(self) -> bool:
        """Return whether it may replace the running plan, which goes on otherwise."""
        return self.plan.solved


def replan(plan: Plan, at: float, *, state: Array | None = None, goal: Array | None = None,
           keep_time: bool = False, budget: float = 0.05, tip_tolerance: float = TIP_TOLERANCE,
           monitor: Monitor | None = None) -> Replan:
    """
    Plan again while a plan is carried out.

    Parameters
    ----------
    plan : Plan
        That runs; solved, to a goal where the arm comes to rest, without via points, limits
        on the way that bend it, a free duration, torque rates, or robustness. It stays as it is.
    at : float
        When the new plan begins, at least 1 ms before the arrival of the running one [s].
    state : numpy.ndarray, shape (2 n_t,), optional
        x = (q, q') of the arm then, bending included; by default what the running plan has.
    goal : numpy.ndarray, shape (n,), optional
        Joint angles to come to rest at; those of the running plan by default [rad].
    keep_time : bool
        Whether the arm must arrive when the running plan would; otherwise 1.5 and 2.25 times what
        is left are tried, too, if that is too little.
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
        ``LIMIT_VIOLATED`` and ``BENT_TOO_FAR`` for limits of the arm.

    Raises
    ------
    InvalidTaskError
        If the plan is none that can be planned again.
    InvalidValueError
        If a value breaks its bound, or the goal those of the joints.
    HoldingError
        If a motor is too weak to hold the arm at the goal.

    """
    _check(plan)
    end, watch = plan.task.duration, monitor or Monitor(
        time_limit=number('budget', budget, at_least=MIN_BUDGET, at_most=MAX_BUDGET, unit='s'))
    at = number('at', at, at_least=0, at_most=end - _LEAST_LEFT, unit='s')
    number('tip_tolerance', tip_tolerance, above=0, unit='m')
    begin = _begin(plan, at, state)
    best: Plan | None = None
    for factor in _LATER[:1] if keep_time else _LATER:
        duration = factor * (end - at)
        if duration > MAX_DURATION:
            break
        best = _plan_rest(_problem(plan, begin, goal, duration), plan, at, watch, tip_tolerance)
        if best.solved or best.status in STOP_STATUS.values():
            break
    assert best is not None
    return Replan(plan=best, at=at, torque_step=_torque_step(plan, at, best))


def _check(plan: Plan) -> None:
    """Refuse a plan whose rest is not a motion like any other."""
    problem, task = plan.problem, plan.task
    reasons = {'is not solved': not plan.solved,
               'does not end at rest': not task.ends_at_rest,
               'has via points': bool(task.via_points),
               'has a free duration': bool(task.time_weight),
               'has limits on the way': bool(task.path_constraints)
               or isinstance(problem, ConstrainedMotion),
               'has prices or limits of torque rates': bool(
                   task.torque_rate_weight.size or task.max_torque_rate.size),
               'forgives errors of the model': isinstance(problem, OffsetProblem)}
    for reason, holds in reasons.items():
        if holds:
            raise InvalidTaskError(f'the running plan {reason}, and such a plan is not planned '
                                   'again in motion: let it end, or plan with plan_path')


def _begin(plan: Plan, at: float, state: Array | None) -> Array:
    """Return the state that the new plan begins in, shape (2 n_t,)."""
    assert plan.solution is not None
    size = 2 * plan.arm.n_coordinates
    if state is None:
        return plan.solution(np.array([at]))[0, :size]
    return vector('state', state, size)


def _problem(plan: Plan, begin: Array, goal: Array | None, duration: float) -> MotionProblem:
    """Return the motion from a state to joint angles."""
    n, n_t = plan.arm.n_joints, plan.arm.n_coordinates
    angles = plan.problem.goal[:n] if goal is None else goal
    none: Any = ()
    task = replace(plan.task, start_positions=begin[:n], start_velocities=begin[n_t:],
                   start_modal_displacements=begin[n:n_t], start_point=none, goal_point=none,
                   goal_positions=angles, duration=duration)
    return MotionProblem(plan.model, task, task_parameters(task))


def _plan_rest(problem: MotionProblem, running: Plan, at: float, monitor: Monitor,
               tip_tolerance: float) -> Plan:
    """Return the plan of what is left, on the first mesh that leads to the goal."""
    plan = Plan(task=problem.task, status=PlanStatus.NOT_CONVERGED, strategy=REPLANNED,
                message='', problem=problem, solution=None)
    try:
        for solution, message in _solve(problem, running, at, monitor):
            plan = replace(plan, message=message) if solution is None else _look_at(
                plan, solution, monitor, tip_tolerance)
            if plan.status not in (PlanStatus.NOT_CONVERGED, PlanStatus.CERTIFICATE_FAILED):
                break
    except StoppedError as error:
        plan = replace(plan, status=STOP_STATUS[error.reason], message=str(error))
    return replace(plan, iterations=monitor.iteration, planning_time=monitor.elapsed)


def _solve(problem: MotionProblem, running: Plan, at: float, monitor: Monitor,
           ) -> Iterator[tuple[CollocationSolution | None, str]]:
    """Yield solutions on finer and finer meshes, None with a message where there is none."""
    guess = _remainder(running, at, _INTERVALS[0], problem.task.duration)
    for intervals in _INTERVALS:
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


def _remainder(running: Plan, at: float, intervals: int, duration: float) -> CollocationSolution:
    """Return what is left of a plan, stretched to a duration, on an even mesh."""
    assert running.solution is not None
    known, rule = running.solution, GaussRule.of(_STAGES)
    left = running.task.duration - at
    mesh = np.linspace(0, left, intervals + 1, dtype=np.float64)
    times = (mesh[:-1, None] + left / intervals * rule.nodes).ravel() + at
    stages = known.rate(times).reshape(intervals, _STAGES, -1)
    return CollocationSolution(mesh, known(mesh + at), stages, rule).stretched(duration / left)


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


def _torque_step(running: Plan, at: float, again: Plan) -> Array:
    """Return by how much torques jump from one plan to the other, shape (n,) [N m]."""
    if again.solution is None:
        return np.full(running.arm.n_joints, np.nan)
    step: Array = again.sample(0.0).torques[0] - running.sample(at).torques[0]
    return step
