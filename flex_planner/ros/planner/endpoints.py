"""A kind of request over ROS: a service, and an action of the same name."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any, NamedTuple

from flex_planner.ros.messages.payload_searches import fill_response, search_without_result
from flex_planner.ros.messages.plans import duration_message
from flex_planner.ros.planner.clients import action_readers, Audience, service_readers
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.request_queue import PendingRequest, Work
from flex_planner.ros.planner.request_state import RequestState
from flex_planner_interfaces.msg import MotionTask, PlanReport
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile

# [s], how long the result of a goal can be asked for: clients ask when the goal is accepted, and
# what is kept of trajectories is most of what the node grows by when goals come fast
RESULT_TIMEOUT = 5
# requests and answers on their way: with ROS's depth of 10, more at once would get lost
_MANY = QoSProfile(depth=1000)
_FEEDBACK_PERIOD, _PRESENCE_PERIOD = 0.1, 1.0  # [s]
_SERVICE, _ACTION = 0, 1  # the ways by which a request comes
_ABANDONED = 'given up: whoever sent the request has left the network'


class RequestHandlers(NamedTuple):
    """
    The operations of endpoints on requests.

    Attributes
    ----------
    submit : callable
        Adds a request to the queue.
    withdraw : callable
        Cancels it, for a reason if its client does not ask for that; returns whether it can.
    conclude : callable
        Coroutine that waits for the outcome and acts on it; never raises.

    """

    submit: Callable[[Work, MotionTask], PendingRequest]
    withdraw: Callable[[PendingRequest, str], bool]
    conclude: Callable[[PendingRequest, MotionTask], Coroutine[Any, Any, Outcome]]


class Endpoint:
    """
    Serves one kind of request.

    Parameters
    ----------
    node : Node
        Where.
    name : str
        Of the service and of the action.
    kinds : pair of types
        Of the service and of the action; the request has the fields of the goal, and the
        response those of the result.
    handlers : RequestHandlers
        Take and conclude requests.
    work : callable
        Returns the outcome of a request; runs in the thread of the worker.
    fill : callable
        Enters an outcome into a response or result, given the request.

    """

    def __init__(self, node: Node, name: str, kinds: tuple[Any, Any], handlers: RequestHandlers,
                 work: Callable[[Any, RequestState], Outcome],
                 fill: Callable[[Any, Any, Outcome], None]) -> None:
        self._handlers, self._work, self._fill = handlers, work, fill
        self._goals: dict[bytes, tuple[ServerGoalHandle, PendingRequest]] = {}
        self._audiences: dict[PendingRequest, tuple[int, Audience]] = {}
        self._readers = service_readers(node, name), action_readers(node, name)
        self._context = node.context
        service, self._action = kinds
        # in the group that all else is in, a request that waits would hold up the others
        group = ReentrantCallbackGroup()
        node.create_service(service, name, self._on_request, qos_profile=_MANY,
                            callback_group=group)
        self._server = ActionServer(
            node, self._action, name, self._execute, callback_group=group,
            handle_accepted_callback=self._on_goal, cancel_callback=self._on_cancel,
            goal_service_qos_profile=_MANY, result_service_qos_profile=_MANY,
            cancel_service_qos_profile=_MANY, result_timeout=RESULT_TIMEOUT)
        # by a clock that also goes on while a simulation is paused
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(_FEEDBACK_PERIOD, self._send_feedback, group, clock)
        node.create_timer(_PRESENCE_PERIOD, self._drop_abandoned, group, clock)

    def close(self) -> None:
        """End the action, which a node that is destroyed leaves to others."""
        self._server.destroy()

    async def _on_request(self, request: Any, response: Any) -> Any:
        """Serve a request of the service."""
        pending = self._submit(request, _SERVICE)
        outcome = await self._handlers.conclude(pending, request.task)
        self._audiences.pop(pending, None)
        self._fill(response, request, outcome)
        return response

    def _submit(self, request: Any, way: int) -> PendingRequest:
        """Submit a request, and note who may wait for the answer."""
        pending = self._handlers.submit(partial(self._work, request), request.task)
        self._audiences[pending] = way, Audience(self._readers[way]())
        return pending

    def _on_goal(self, goal: ServerGoalHandle) -> None:
        """Submit an accepted goal, which can be canceled from now on."""
        pending = self._submit(goal.request, _ACTION)
        self._goals[_key(goal)] = goal, pending
        goal.execute()

    async def _execute(self, goal: ServerGoalHandle) -> Any:
        """Wait for the outcome of a goal and return its result."""
        pending = self._goals[_key(goal)][1]
        outcome = await self._handlers.conclude(pending, goal.request.task)
        del self._goals[_key(goal)], self._audiences[pending]
        result = self._action.Result()
        self._fill(result, goal.request, outcome)
        try:
            _end(goal, outcome.report.error_code)
        except RuntimeError:
            if self._context.ok():
                raise
            # a signal has ended ROS meanwhile, and with it whoever would hear of the end
        return result

    def _on_cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        """Cancel a goal, unless it is concluded already."""
        entry = self._goals.get(_key(goal))
        if entry is None or not self._handlers.withdraw(entry[1], ''):
            return CancelResponse.REJECT
        return CancelResponse.ACCEPT

    def _drop_abandoned(self) -> None:
        """Drop what waits or is being planned, and nobody waits for."""
        if not self._audiences:
            return
        present = [readers() for readers in self._readers]
        for pending, (way, audience) in list(self._audiences.items()):
            if not pending.future.done() and audience.is_gone(present[way]):
                self._handlers.withdraw(pending, _ABANDONED)

    def _send_feedback(self) -> None:
        """Send every client the progress of its goal, also if that is unchanged."""
        for goal, pending in list(self._goals.values()):
            if pending.is_open:
                goal.publish_feedback(_feedback(self._action, pending.state))


def fill_plan(response: Any, request: Any, outcome: Outcome) -> None:
    """Enter the outcome of planning a path."""
    response.report, response.trajectory = outcome.report, outcome.trajectory


def fill_search(response: Any, request: Any, outcome: Outcome) -> None:
    """Enter the outcome of a search for the maximum payload."""
    fill_plan(response, request, outcome)
    fill_response(response, outcome.search or search_without_result(request))


def _feedback(action: Any, state: RequestState) -> Any:
    progress = state.progress
    return action.Feedback(
        phase=progress.phase, iteration=int(progress.iteration),
        residual=float(progress.residual), payload=float(progress.payload),
        elapsed=duration_message(state.elapsed_ns), intervals=int(progress.intervals),
        plan_id=state.plan_id)


def _key(goal: ServerGoalHandle) -> bytes:
    return bytes(goal.goal_id.uuid)


def _end(goal: ServerGoalHandle, code: int) -> None:
    """Bring a goal to its end state."""
    if code == PlanReport.NONE:
        goal.succeed()
    elif code == PlanReport.CANCELED and goal.is_cancel_requested:
        goal.canceled()
    else:
        goal.abort()
