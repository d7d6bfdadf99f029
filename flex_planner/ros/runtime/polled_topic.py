"""A topic whose messages are taken as bytes, many at a time, not one by one by the executor."""

from __future__ import annotations

from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

# what comes between two looks, also from a publisher of 1 kHz; heard from any kind of publisher
_QOS = QoSProfile(depth=2000, reliability=ReliabilityPolicy.BEST_EFFORT)


class Polled(MutuallyExclusiveCallbackGroup):  # type: ignore[misc]
    """Keeps a subscription from the executor, which 1000 messages per second would keep busy."""

    def can_execute(self, entity: object) -> bool:
        """Return that the executor has nothing to do with it."""
        return False


class PolledTopic:
    """
    Messages of a topic, in CDR as they came.

    Parameters
    ----------
    node : Node
        That subscribes.
    kind : type
        Of the messages.
    topic : str
        Name.

    """

    def __init__(self, node: Node, kind: Any, topic: str) -> None:
        self.name, self._kind, self._clock = node.resolve_topic_name(topic), kind, node.get_clock()
        self._subscription = node.create_subscription(
            kind, topic, lambda _: None, _QOS, callback_group=Polled(), raw=True)

    def take(self) -> list[tuple[int, bytes]]:
        """Return what has come since the last time, with the time of its receipt [ns]."""
        taken, now = [], int(self._clock.now().nanoseconds)
        with self._subscription.handle:
            while (one := self._subscription.handle.take_message(self._kind, True)) is not None:
                data, info = one
                received = 0 if self._clock.ros_time_is_active else info['received_timestamp']
                taken.append((int(received or now), bytes(data)))
        return taken
