"""The controller that carries out plans, as the planner node sees it."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.base.errors import FlexPlannerError
from flex_planner.ros.planner.execution import ActionLink, Execution
from rclpy.action import ActionClient, get_action_names_and_types
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import NameValidationException
from rclpy.executors import Executor
from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectory

_PERIOD = 0.05  # [s]
_TYPE, _FEEDBACK = 'control_msgs/action/FollowJointTrajectory', '_FeedbackMessage'


class Controller:
    """
    The controller that plans are sent to.

    Parameters
    ----------
    node : Node
        The planner.
    action : str
        Name of the controller's action.

    Raises
    ------
    FlexPlannerError
        If control_msgs is not installed, or there can be no such action.

    """

    def __init__(self, node: Node, action: str) -> None:
        try:
            from control_msgs.action import FollowJointTrajectory
        except ImportError as error:
            raise FlexPlannerError(
                f'execute_action is {action!r}, but control_msgs, which has the type of this '
                f'action, is missing: install ros-jazzy-control-msgs ({error})') from error
        group = ReentrantCallbackGroup()
        try:
            name = node.resolve_service_name(action)
            client = ActionClient(node, FollowJointTrajectory, action, callback_group=group)
        except (NameValidationException, RuntimeError) as error:
            raise FlexPlannerError(f'execute_action is {action!r}, but must be the name of an '
                                   f'action: {error}') from error
        _check_topic(node, name)
        self._node, self._name = node, name
        self._link = ActionLink(
            name, client, FollowJointTrajectory.Goal,
            lambda: int(node.get_clock().now().nanoseconds), self._describe_absence)
        self._executions: dict[Execution, str] = {}
        node.create_timer(_PERIOD, self._advance, group, Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def busy(self) -> bool:
        """Return whether a plan is being carried out."""
        return bool(self._executions)

    def start(self, trajectory: JointTrajectory, timeout: float, executor: Executor,
              on_accepted: Callable[[], None], *, replaces: str = '',
              plan_id: str = '') -> Execution:
        """
        Let the controller carry out a plan.

        Parameters
        ----------
        trajectory : JointTrajectory
            The plan.
        timeout : float
            Time for each answer of the controller beyond what the motion takes [s].
        executor : Executor
            Runs what awaits the end.
        on_accepted : callable
            Called once the controller has accepted the plan.
        replaces, plan_id : str
            Identifier of the plan that it replaces in motion, if any, and its own.

        """
        old = [one for one, name in self._executions.items() if replaces and name == replaces]

        def accept() -> None:
            for one in old:
                one.end_replaced()
            on_accepted()

        execution = Execution(self._link, trajectory, timeout, executor, accept)
        self._executions[execution] = plan_id
        for one in old:
            one.replaced = True
        execution.future.add_done_callback(lambda _: _keep(old, execution))
        execution.advance()
        return execution

    def close(self) -> None:
        """Leave the action."""
        self._link.client.destroy()

    def _describe_absence(self) -> str:
        """Return what is there instead of the action, in words."""
        types = self._types(self._name)
        if types - {_TYPE}:
            return f'there is {self._name}, but its type is {", ".join(sorted(types))}'
        if types:
            return f'{self._name} is there, but not all of it was discovered in time'
        known = (name for name, kinds in get_action_names_and_types(self._node) if _TYPE in kinds)
        others = ', '.join(sorted(name for name in known if self._types(name)))
        return f'there is no action {self._name}; of its type there is {others or "none"}'

    def _types(self, action: str) -> set[str]:
        """Return the types of the servers of an action, empty without one."""
        servers = self._node.get_publishers_info_by_topic(f'{action}/_action/feedback')
        return {server.topic_type.removesuffix(_FEEDBACK) for server in servers}

    def _advance(self) -> None:
        for execution in list(self._executions):
            execution.advance()
            if execution.future.done():
                del self._executions[execution]


def _keep(old: list[Execution], new: Execution) -> None:
    """Let plans go on that a new one should have replaced, which was not accepted."""
    for one in old:
        one.replaced = one.replaced and new.future.result().accepted


def _check_topic(node: Node, action: str) -> None:
    """Raise FlexPlannerError if the controller also gets plans over the topic."""
    topic = node.resolve_topic_name('~/joint_trajectory')
    if topic.rpartition('/')[0] == action.rpartition('/')[0]:
        raise FlexPlannerError(
            f'execute_action is {action}, and the topic ~/joint_trajectory is {topic}: the same '
            'controller would get every plan twice; leave the remapping or the parameter out')
