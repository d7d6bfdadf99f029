"""A plan on its way to and through a controller, by its action FollowJointTrajectory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
import time
from typing import Any, NamedTuple

from action_msgs.msg import GoalStatus
from flex_planner.base.text import printable
from flex_planner.ros.messages.plans import duration_message, duration_seconds
from flex_planner.ros.messages.times import time_ns
from flex_planner_interfaces.msg import PlanReport
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.executors import Executor
from rclpy.task import Future
from trajectory_msgs.msg import JointTrajectory

_GONE = 2.0  # [s] without a server until it counts as gone
# error_code of a result
_NAMES = {-1: 'INVALID_GOAL', -2: 'INVALID_JOINTS', -3: 'OLD_HEADER_TIMESTAMP',
          -4: 'PATH_TOLERANCE_VIOLATED', -5: 'GOAL_TOLERANCE_VIOLATED'}


@dataclass(frozen=True, slots=True, kw_only=True)
class ExecutionEnd:
    """
    How the execution of a plan ended.

    Attributes
    ----------
    code : int
        Of PlanReport.
    sentence : str
        Empty if the plan was carried out.
    accepted : bool
        Whether the controller accepted the plan.
    error_code, error_string
        Of the controller's result.
    duration_ns : int
        From sending the plan to the end [ns].

    """

    code: int
    sentence: str = ''
    accepted: bool = False
    error_code: int = 0
    error_string: str = ''
    duration_ns: int = 0

    def enter(self, report: PlanReport) -> None:
        """Enter this into the report of a plan, which may be that of a stop."""
        if self.code != PlanReport.NONE:
            report.error_code, report.error_msg = self.code, printable(self.sentence)
        report.execution_accepted = self.accepted
        report.execution_error_code = self.error_code
        report.execution_error_string = printable(self.error_string)
        report.execution_time = duration_message(self.duration_ns)


class ActionLink(NamedTuple):
    """
    The way to a controller.

    Attributes
    ----------
    name : str
        Of its action.
    client : ActionClient
        Of the action.
    goal_type : type
        Of its goals.
    now_ns : callable
        Returns the time that the controller goes by, maybe simulated [ns].
    describe_absence : callable
        Returns what is there instead of the action, in words.

    """

    name: str
    client: ActionClient
    goal_type: Any
    now_ns: Callable[[], int]
    describe_absence: Callable[[], str]


class Execution:
    """
    A plan on its way to and through the controller; `advance` has to be called all the time.

    Attributes
    ----------
    future : Future
        Of the `ExecutionEnd`.
    replaced : bool
        Whether another plan is to take its place, for which the controller ends it.

    """

    def __init__(self, controller: ActionLink, trajectory: JointTrajectory, timeout: float,
                 executor: Executor, on_accepted: Callable[[], None]) -> None:
        self.future = Future(executor=executor)
        self._controller, self._trajectory, self._timeout = controller, trajectory, timeout
        self._on_accepted, self._began_ns = on_accepted, time.monotonic_ns()
        self._step: Callable[[], None] = self._send
        self._deadline = time.monotonic() + timeout
        self._answer: Future = Future()
        self._handle: ClientGoalHandle | None = None
        self._accepted_ns, self._server_seen = 0, time.monotonic()
        self._canceled = self.replaced = False

    def advance(self) -> None:
        """Do what is due."""
        if self.future.done():
            return
        try:
            self._step()
        except Exception as error:
            self._tell_to_cancel()
            self._end(PlanReport.UNKNOWN, f'{type(error).__name__}: {error}')

    def end_replaced(self) -> None:
        """End, as another plan has taken the place of this one at the controller."""
        if not self.future.done():
            self._end(PlanReport.EXECUTION_REPLACED, 'another plan replaced this one in motion')

    def cancel(self) -> None:
        """Tell the controller to cancel the motion."""
        if self._canceled:
            return
        self._canceled, self._deadline = True, time.monotonic() + self._timeout
        self._tell_to_cancel()

    @property
    def _late(self) -> bool:
        return time.monotonic() > self._deadline

    def _send(self) -> None:
        """Send the plan as soon as the action is there."""
        if self._canceled:
            self._end(PlanReport.CANCELED, 'canceled before the controller had the plan')
        elif self._controller.client.server_is_ready():
            goal = self._controller.goal_type(trajectory=self._trajectory)
            self._answer = self._controller.client.send_goal_async(goal)
            self._step, self._deadline = self._await_acceptance, time.monotonic() + self._timeout
        elif self._late:
            self._end(PlanReport.EXECUTION_NO_SERVER, 'planned, but neither carried out nor '
                      f'published: {self._controller.describe_absence()}')

    def _await_acceptance(self) -> None:
        """Wait for the controller to accept or refuse the plan."""
        if self._answer.done():
            self._take_acceptance(self._answer.result())
        elif self._late:
            # whatever it answers later, nobody counts on this motion any more
            self._answer.add_done_callback(_cancel_late)
            self._end(PlanReport.EXECUTION_NO_ANSWER, self._after_cancel(
                f'{self._controller.name} did not say within {self._timeout:g} s whether it '
                'accepts the plan; should it do so later, it is told to cancel'))

    def _take_acceptance(self, handle: ClientGoalHandle) -> None:
        if not handle.accepted:
            self._end(PlanReport.EXECUTION_REFUSED, 'planned, but neither carried out nor '
                      f'published: {self._controller.name} refused the plan; why is in its log '
                      '(names of joints, no effort interface, or not active)')
            return
        self._handle, self._accepted_ns = handle, self._controller.now_ns()
        self._server_seen = time.monotonic()
        self._answer = handle.get_result_async()
        self._step = self._await_result
        if self._canceled:
            self._tell_to_cancel()
        else:
            self._on_accepted()

    def _await_result(self) -> None:
        """Wait for the end of the motion; its time is that of the clock, maybe simulated."""
        now, name = time.monotonic(), self._controller.name
        if self._controller.client.server_is_ready():
            self._server_seen = now
        begin_ns = max(self._accepted_ns, time_ns(self._trajectory.header.stamp))
        passed = (self._controller.now_ns() - begin_ns) * 1e-9
        limit = duration_seconds(self._trajectory.points[-1].time_from_start) + self._timeout
        if self._answer.done():
            self._take_result(self._answer.result())
        elif now - self._server_seen > _GONE:
            self._end(PlanReport.EXECUTION_SERVER_GONE, self._after_cancel(
                f'{name} went away while it carried out the plan; where the arm is now is not '
                'known'))
        elif self._canceled and self._late:
            self._end(PlanReport.EXECUTION_NO_ANSWER, self._after_cancel(
                f'{name} did not end the motion within {self._timeout:g} s; the arm may move '
                'still'))
        elif not self._canceled and passed > limit:
            self._tell_to_cancel()
            self._end(PlanReport.EXECUTION_NO_ANSWER, f'{name} accepted the plan, but did not '
                      f'end it within {limit:.3g} s (the motion and execute_timeout); it was '
                      'told to cancel')

    def _take_result(self, response: Any) -> None:
        """Enter the controller's result; some succeed with an error code."""
        result, status = response.result, response.status
        own = partial(self._end, error_code=int(result.error_code),
                      error_string=result.error_string)
        reason = ': '.join(filter(None, (
            _NAMES.get(result.error_code, f'error {result.error_code}' if result.error_code
                       else ''), result.error_string)))
        if status == GoalStatus.STATUS_SUCCEEDED and result.error_code == 0:
            own(PlanReport.NONE, '')
        elif status == GoalStatus.STATUS_CANCELED and self._canceled:
            own(PlanReport.CANCELED, 'canceled; the controller has ended the motion')
        elif self.replaced:
            self.end_replaced()
        elif status == GoalStatus.STATUS_CANCELED:
            own(PlanReport.EXECUTION_CANCELED, 'somebody else canceled the motion at '
                f'{self._controller.name}')
        else:
            own(PlanReport.EXECUTION_ABORTED, f'{self._controller.name} gave up the motion'
                + (f': {reason}' if reason else ' and gives no reason: see its log'))

    def _after_cancel(self, sentence: str) -> str:
        return f'canceled, but {sentence}' if self._canceled else sentence

    def _tell_to_cancel(self) -> None:
        if self._handle is not None:
            self._handle.cancel_goal_async()

    def _end(self, code: int, sentence: str, **result: Any) -> None:
        end = ExecutionEnd(code=code, sentence=sentence, accepted=self._handle is not None,
                           duration_ns=time.monotonic_ns() - self._began_ns)
        self.future.set_result(replace(end, **result))


def _cancel_late(answer: Future) -> None:
    """Cancel a plan that was accepted too late."""
    handle = answer.result()
    if handle is not None and handle.accepted:
        handle.cancel_goal_async()
