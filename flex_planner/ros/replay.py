"""A node that publishes a recording again: the original bytes, topics, times and QoS."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from importlib import import_module
import time
from typing import Any

from flex_planner.base.errors import FlexPlannerError, InvalidValueError, RecordingError
from flex_planner.base.paths import expand_path
from flex_planner.base.text import printable
from flex_planner.recording import (
    check_encoding,
    Decoder,
    Definition,
    definition_folder,
    Durability,
    from_time,
    MessageTypes,
    QosProfile,
    read_metadata,
    read_serialized,
    Reliability,
    SerializedMessage,
    TopicSummary,
)
from flex_planner.ros.runtime.parameters import declare, warn_of_unknown
from flex_planner.ros.runtime.running import CannotGoOnError, run_node
from flex_planner.ros.settings.replay import ReplaySettings
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

_DELIVERY_TIMEOUT = Duration(seconds=1)
_SHORTEST_WAIT_NS = 1000


class Replay(Node):  # type: ignore[misc]
    """
    Publishes the messages of a recording, then ends.

    The topics are those of the recording, as they were remapped then. Those whose types are not
    installed, or differ, are left out, which is logged, and so is what else cannot be sent. Where
    the recording cannot be read any further, the node ends with code 1.

    Parameters
    ----------
    settings : ReplaySettings
        Defaults of the parameters.

    Raises
    ------
    FlexPlannerError
        If there is no such recording, or nothing of it can be published.

    """

    def __init__(self, settings: ReplaySettings) -> None:
        super().__init__('replay')
        warn_of_unknown(self, ReplaySettings)
        self._settings = declare(self, settings)
        self._path = expand_path(self._settings.recording)
        metadata = read_metadata(self._path)
        self._first_ns = metadata.start_ns + round(self._settings.start * 1e9)
        if self._first_ns > metadata.end_ns:
            raise InvalidValueError('start', self._settings.start, 'at most the duration of the '
                                    f'recording, {metadata.duration_ns * 1e-9:g} s')
        self._types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
        self._decoder = Decoder(self._types)
        self._kinds: dict[str, str] = {}
        for channel in metadata.foreign:
            self.get_logger().warning(f'left out: {channel}')
        self._outlets = self._publish_topics(metadata.topics)
        self.get_logger().info(
            f'replaying {printable(str(self._path))}: {len(self._outlets)} topics, '
            f'{(metadata.end_ns - self._first_ns) * 1e-9 / self._settings.rate:.3g} s')
        self._begin = time.monotonic() + self._settings.delay
        self._sent, self._messages = 0, self._passes()
        self._due, self._send = self._first()
        self._timer = self.create_timer(self._settings.delay, self._on_timer,
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _publish_topics(self, topics: tuple[TopicSummary, ...]) -> dict[str, Publisher]:
        """Return a publisher for each topic whose type is installed as it was recorded."""
        outlets: dict[str, Publisher] = {}
        for entry in topics:
            topic = entry.topic
            try:
                if topic.name in outlets:
                    raise RecordingError(f'it has the type {topic.type_name} as well')
                kind = message_class(topic.type_name)
                self._check_definition(entry.definition, kind)
                outlets[topic.name] = self.create_publisher(kind, topic.name, _profile(topic.qos))
                self._kinds[topic.name] = topic.type_name
            except Exception as error:  # also whatever the middleware has against a topic
                self.get_logger().warning(printable(f'{topic.name} is left out: {error}'))
        if not outlets:
            raise RecordingError(f'{self._path} holds no messages that could be published')
        return outlets

    def _check_definition(self, definition: Definition, kind: Any) -> None:
        """Raise RecordingError unless a type is installed as it was recorded."""
        name = definition.type_name
        try:
            types = self._decoder.types_of(definition)
        except RecordingError:
            if name in self._types:
                raise
            return  # a definition that cannot be read, of a type that is not known here either
        own = name in self._types and types is not self._types
        if own or list(types.fields(name)) != list(kind.get_fields_and_field_types()):
            raise RecordingError(f'{name} was recorded with another definition than the one that '
                                 'is installed')

    def _first(self) -> tuple[float, partial[None]]:
        """Return the first message."""
        first = next(self._messages, None)
        if first is None:
            raise RecordingError(f'{self._path} holds no messages that could be published')
        return first

    def _passes(self) -> Iterator[tuple[float, partial[None]]]:
        """Yield the time of each message from the beginning [s], and a call that sends it."""
        began, sent = 0.0, True
        while sent:
            due, sent = began, False
            messages = read_serialized(self._path, self._outlets.keys())
            for entry in from_time(messages, self._first_ns):
                if not self._can_be_sent(entry):
                    continue
                after = (entry.log_time_ns - self._first_ns) * 1e-9
                due, sent = began + after / self._settings.rate, True
                yield due, partial(self._outlets[entry.topic.name].publish, entry.data)
            if not self._settings.loop:
                return
            began = due + self._settings.delay

    def _can_be_sent(self, message: SerializedMessage) -> bool:
        """Return whether bytes are a message of their topic: no subscriber must get others."""
        topic = message.topic
        if self._kinds[topic.name] != topic.type_name:
            return False
        try:
            check_encoding(message.data)
            if topic.type_name in self._types:
                self._decoder.decode(message.definition, message.data)
        except RecordingError as error:
            self.get_logger().warning(f'a message of {topic.name} is left out: {error}',
                                      once=True)
            return False
        return True

    def _on_timer(self) -> None:
        """Send what is due, then wait for the next message."""
        while (left := self._begin + self._due - time.monotonic()) <= 0:
            self._send()
            self._sent += 1
            following = self._next()
            if following is None:
                self._finish()
                return
            self._due, self._send = following
        self._timer.timer_period_ns = max(round(left * 1e9), _SHORTEST_WAIT_NS)
        self._timer.reset()

    def _next(self) -> tuple[float, partial[None]] | None:
        """Return the next message, None after the last."""
        try:
            return next(self._messages, None)
        except FlexPlannerError as error:
            raise CannotGoOnError(f'the replay ends after {self._sent} messages: {error}') \
                from error

    def _finish(self) -> None:
        """End, once subscribers have got everything."""
        self._timer.cancel()
        for outlet in self._outlets.values():
            outlet.wait_for_all_acked(_DELIVERY_TIMEOUT)
        self.get_logger().info(f'{self._sent} messages sent')
        rclpy.try_shutdown()


def message_class(type_name: str) -> Any:
    """Return rclpy's class of a type, e.g. of ``sensor_msgs/msg/JointState``."""
    package, kind, name = type_name.split('/')
    if kind != 'msg':
        raise RecordingError(f'{type_name} is a part of a service or action')
    return getattr(import_module(f'{package}.msg'), name)


def _profile(qos: QosProfile) -> QoSProfile:
    """Return rclpy's profile for a recorded one."""
    reliable = qos.reliability is Reliability.RELIABLE
    latched = qos.durability is Durability.TRANSIENT_LOCAL
    return QoSProfile(
        depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


def replay(settings: ReplaySettings, args: list[str] | None = None) -> None:
    """Publish a recording and end the process; the code is 0 if all of it could be read."""
    run_node(lambda: Replay(settings), 'replay', args)


def main(args: list[str] | None = None) -> None:
    """Run the node ``replay`` with the parameters that it is given."""
    replay(ReplaySettings(), args)


if __name__ == '__main__':
    main()
