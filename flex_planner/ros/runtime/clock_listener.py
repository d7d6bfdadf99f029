"""The time of ``/clock``, for what does not wait for messages otherwise."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
import threading

from rclpy.executors import (
    ExternalShutdownException,
    ShutdownException,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock


class ClockListener:
    """
    Hands the time of ``/clock`` on, in its own thread, from the first time it is wanted.

    Parameters
    ----------
    node : Node
        Listens; nobody else lets it.
    tick : callable
        Takes the time [ns].

    """

    def __init__(self, node: Node, tick: Callable[[int], None]) -> None:
        self._node, self._tick = node, tick
        self._executor: SingleThreadedExecutor | None = None

    def start(self) -> None:
        """Listen from now on."""
        if self._executor is None:
            self._node.create_subscription(Clock, '/clock', self._on_clock, QoSProfile(
                depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
            self._executor = SingleThreadedExecutor()
            self._executor.add_node(self._node)
            threading.Thread(target=self._spin, name='clock', daemon=True).start()

    def close(self) -> None:
        """Listen no more."""
        if self._executor is not None:
            self._executor.shutdown(timeout_sec=0)

    def _on_clock(self, message: Clock) -> None:
        self._tick(message.clock.sec * 10**9 + message.clock.nanosec)

    def _spin(self) -> None:
        executor = self._executor
        with suppress(ExternalShutdownException, ShutdownException):
            while executor is not None:
                executor.spin_once()
