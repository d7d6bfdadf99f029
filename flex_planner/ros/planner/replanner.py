"""From a request that replaces the plan that is carried out to an outcome, in the worker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.sentences import say_reason
from flex_planner.base.text import printable
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.quick_sampling import sample_quickly
from flex_planner.planning.replan_or_stop import Continuation, Course, replan_or_stop
from flex_planner.planning.rest_of_motion import LEAST_LEFT
from flex_planner.planning.sampling import judge_execution
from flex_planner.ros.messages.classes import FlexibleTrajectory, MotionTask, PlanReport
from flex_planner.ros.messages.plans import (
    add_execution,
    report_from_plan,
    report_trajectory,
    STATUS_CODES,
)
from flex_planner.ros.messages.replacements import (
    Replacement,
    replacement_from_message,
    with_motion,
)
from flex_planner.ros.messages.request_error import RequestError
from flex_planner.ros.messages.times import time_message, time_ns
from flex_planner.ros.planner.arm_bending import ArmBending, Bending
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.running_plan import RunningPlan, RunningPlans
from flex_planner.ros.settings.planner import PlannerSettings
import numpy as np


def check_start_time(start_ns: int, now_ns: int) -> None:
    """
    Refuse a time of the start that is over; 0 is none [ns].

    Raises
    ------
    RequestError
        If it is.

    """
    if start_ns and start_ns <= now_ns:
        raise RequestError(
            PlanReport.START_TIME_PASSED, f'start_time is {(now_ns - start_ns) * 1e-9:.3g} s ago, '
            'but must be later than the plan is published: give the planner more time')


class Replanner:
    """
    Plans again for the arm that moves.

    Parameters
    ----------
    running : RunningPlans
        What is carried out.
    now_ns : callable
        Returns the time of the node's clock [ns].
    bending : ArmBending, optional
        How the arm is bent; without it, as the plan that is carried out has it.

    """

    def __init__(self, running: RunningPlans, now_ns: Callable[[], int],
                 bending: ArmBending | None = None) -> None:
        self._running, self._now_ns, self._bending = running, now_ns, bending

    def plan(self, message: MotionTask, settings: PlannerSettings,
             monitor: Monitor) -> tuple[MotionTask, Outcome]:
        """
        Return what follows the plan that is carried out, and it as a task of its own.

        Parameters
        ----------
        message : MotionTask
            With `replaces`.
        settings : PlannerSettings
            Of the request.
        monitor : Monitor
            May stop it.

        Raises
        ------
        FlexPlannerError
            One of `ERROR_CODES`, or a `RequestError`, naming field, value and bound.

        """
        running = self._running.take(message.replaces)
        wish, now = replacement_from_message(message, running.plan, settings), self._now_ns()
        start_ns = time_ns(message.start_time) or now + round(settings.replan_lead * 1e9)
        check_start_time(start_ns, now)
        at = _time_on(running, start_ns)
        left = (start_ns - now) * 1e-9  # beyond it nothing can be published any more
        watch = replace(monitor, time_limit=min(monitor.time_limit, monitor.elapsed + left))
        bending = None if self._bending is None else self._bending.find(
            running, start_ns, now, settings)
        found = _go_on(running.plan, at, wish, bending, watch)
        outcome = self._outcome(running, found, settings, watch)
        outcome.report.start_time = time_message(start_ns)
        _enter_bending(outcome.report, bending, running.plan)
        whole = with_motion(message, found.plan.task)
        return whole, replace(outcome, start_ns=start_ns, replaces=running.plan_id)

    def check_start_time(self, start_ns: int) -> None:
        """Refuse a time of the start that is over, see the function of that name."""
        check_start_time(start_ns, self._now_ns())

    def check(self, outcome: Outcome) -> None:
        """
        Refuse to publish a plan too late.

        Raises
        ------
        InvalidTaskError
            If another one was published meanwhile.
        RequestError
            If the time of its start is over.

        """
        if outcome.replaces:
            self._running.take(outcome.replaces)
        check_start_time(outcome.start_ns, self._now_ns())

    def _outcome(self, running: RunningPlan, found: Continuation, settings: PlannerSettings,
                 monitor: Monitor) -> Outcome:
        """Return the outcome of what was found, with a trajectory if there is a new plan."""
        plan, course = found.plan, found.course
        report = report_from_plan(plan)
        report.replaced_plan, report.torque_step = running.plan_id, found.torque_step.tolist()
        report.arrival_delay = found.delay
        report.continuation_reason = printable(found.message)
        if course is Course.GOES_ON:
            return _goes_on(report, plan)
        try:
            reference = sample_quickly(plan, settings.replan_sampling(), monitor)
        except StoppedError as error:
            return _goes_on(report, replace(plan, status=STOP_STATUS[error.reason],
                                            message=str(error)))
        judged = judge_execution(plan, reference)
        if not judged.solved:
            add_execution(report, reference)
            report.continuation_reason = printable(judged.message)
            return _goes_on(report, judged)
        report.continuation = course.name
        if course is Course.STOPS:
            report.path_deviation = found.deviation
            report.error_code = PlanReport.STOPS
            report.error_msg = printable(f'no motion to the goal: {found.message}; the arm stops '
                                         'on the path of the plan before')
        trajectory = report_trajectory(report, plan, reference, settings)
        return Outcome(report=report, trajectory=trajectory, plan=plan, reference=reference)


def _go_on(plan: Plan, at: float, wish: Replacement, bending: Bending | None,
           monitor: Monitor) -> Continuation:
    """
    Return what the plan that is carried out is followed by.

    Joints begin where that plan has them, so that their reference does not jump: to lead the arm
    back to it is the business of their controller, which sees them. It does not see how links
    bend.

    """
    state = None
    if bending is not None and plan.solution is not None:
        n, n_t = plan.arm.n_joints, plan.arm.n_coordinates
        state = plan.solution(np.array([at]))[0, :2 * n_t]
        state[n:n_t] += bending.off[n:n_t]
        state[n_t + n:] += bending.off[n_t + n:]
    return replan_or_stop(
        plan, at, state=state, goal=wish.goal, duration=wish.duration, keep_time=wish.keep_time,
        torque_rate_weight=wish.torque_rate_weight, stops=wish.stops, monitor=monitor)


def _enter_bending(report: PlanReport, bending: Bending | None, plan: Plan) -> None:
    """Enter into a report where the bending is from."""
    n, n_t = plan.arm.n_joints, plan.arm.n_coordinates
    report.bending_source = 'PLAN' if bending is None else bending.source
    if bending is not None and bending.source != 'PLAN':
        report.bending_error = np.append(bending.off[n:n_t], bending.off[n_t + n:]).tolist()


def _goes_on(report: PlanReport, plan: Plan) -> Outcome:
    """Return that the plan before is carried out to its end."""
    report.continuation = Course.GOES_ON.name
    report.error_code = STATUS_CODES[plan.status]
    late = ' before start_time' if plan.status is PlanStatus.TIMEOUT else ''
    report.error_msg = (f'{say_reason(plan.status.value, plan.message)}{late}; '
                        f'{Course.GOES_ON.value}')
    return Outcome(report=report, trajectory=FlexibleTrajectory(), plan=plan)


def _time_on(running: RunningPlan, start_ns: int) -> float:
    """Return a time on the clock of a plan that runs [s], or raise InvalidTaskError."""
    at, end = (start_ns - running.begin_ns) * 1e-9, running.plan.task.duration - LEAST_LEFT
    if not 0 <= at <= end:
        raise InvalidTaskError(
            f'start_time is {at:.6g} s after the begin of the plan that is replaced, but must be '
            f'from 0 to {end:.6g} s after it, while it is carried out')
    return at
