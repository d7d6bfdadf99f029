"""The description of a robot, a URDF file as text, from a topic."""

from __future__ import annotations

import time

from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_PATIENCE, _PERIOD = 30.0, 0.05  # [s]


def hear_description(node: Node, topic: str) -> str:
    """
    Return the text that is latched on a topic, as robot_state_publisher does it.

    Parameters
    ----------
    node : Node
        Before anything spins it.
    topic : str
        Of std_msgs/String, latched.

    Raises
    ------
    InvalidValueError
        If there cannot be such a topic.
    FlexPlannerError
        If nothing comes within half a minute.

    """
    try:
        subscription = node.create_subscription(String, topic, _pass_over, _LATCHED)
    except (NameValidationException, RuntimeError) as error:
        raise InvalidValueError('robot_description_topic', topic,
                                f'the name of a topic: {error}') from error
    name, end = subscription.topic_name, time.monotonic() + _PATIENCE
    node.get_logger().info(f'waiting for a URDF on {name}')
    try:
        while time.monotonic() < end:
            with subscription.handle:
                taken = subscription.handle.take_message(String, False)
            if taken is not None:
                return str(taken[0].data)
            time.sleep(_PERIOD)
    finally:
        node.destroy_subscription(subscription)
    raise FlexPlannerError(f'nothing has come on {name} within {_PATIENCE:g} s: a URDF, latched, '
                           'is what robot_description_topic names; is robot_state_publisher '
                           'running, and is this its topic?')


def _pass_over(message: String) -> None:
    """Take no message: they are polled for."""
