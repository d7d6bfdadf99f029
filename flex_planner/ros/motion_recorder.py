"""
Recordings of published motions: what the arm said from shortly before each one to its end.

They are logs for ``flex-planner identify``. Joint states are kept as they came, in bytes, so that
a publisher of 1 kHz costs the planner next to nothing.

"""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.text import printable
from flex_planner.ros.messages.plans import duration_seconds
from flex_planner.ros.messages.times import time_ns
from flex_planner.ros.recorded_motion import RecordedMotion
from flex_planner.ros.runtime.polled_topic import PolledTopic
from flex_planner.ros.settings.planner import PlannerSettings
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import JointState

_PERIOD = 0.05  # [s]
_BEFORE_NS = 500_000_000
_LEAVING = 0.5  # [s], for the last recording when the node ends


class MotionRecorder:
    """
    Listens to the joint states, and records those of each motion, if its parameter says so.

    A motion that another one replaces ends there.

    Parameters
    ----------
    node : Node
        The planner.
    settings : PlannerSettings
        With `record_motions`, and the topic of the joint states.
    write : callable
        Writes a motion, given the name of that topic, and returns where; called in a thread.

    """

    def __init__(self, node: Node, settings: PlannerSettings,
                 write: Callable[[RecordedMotion, str], Any]) -> None:
        self._node, self._write = node, write
        self._recent: list[tuple[int, bytes]] = []
        self._motion: RecordedMotion | None = None
        self._lock, self._thread = threading.Lock(), threading.Thread()
        self._topic: PolledTopic | None = None
        if not (settings.record_motions and settings.joint_states_topic):
            return
        self._topic = PolledTopic(node, JointState, settings.joint_states_topic)
        # by a clock that also goes on while a simulation is paused
        node.create_timer(_PERIOD, self.listen, MutuallyExclusiveCallbackGroup(),
                          Clock(clock_type=ClockType.STEADY_TIME))

    def begin(self, trajectory: Any, settings: PlannerSettings) -> None:
        """Record the motion of a trajectory that is published now."""
        if self._topic is None:
            return
        self.listen()
        with self._lock:
            self._end()
            now = self._now()
            begin = time_ns(trajectory.header.stamp) or now
            passes = duration_seconds(trajectory.points[-1].time_from_start)
            self._motion = RecordedMotion(
                settings, trajectory, now,
                begin + int((passes + settings.motion_settling) * 1e9), list(self._recent))

    def listen(self) -> None:
        """Take the messages that have come."""
        if self._topic is None:
            return
        with self._lock:
            taken, motion, now = self._topic.take(), self._motion, self._now()
            self._recent = [one for one in [*self._recent, *taken]
                            if 0 <= now - one[0] <= _BEFORE_NS]
            if motion is None:
                return
            motion.states += taken
            if motion.is_over(now):
                self._end()

    def close(self) -> None:
        """End the motion that is being recorded, and write it."""
        with self._lock:
            self._end()
        if self._thread.is_alive():
            self._thread.join(_LEAVING)

    def _end(self) -> None:
        """Write the motion that is being recorded."""
        motion, topic = self._motion, self._topic
        self._motion = None
        if motion is None or topic is None:
            return
        if not motion.states:
            self._node.get_logger().warning(
                f'the motion is not recorded: nothing has come on {topic.name}')
            return
        self._thread = threading.Thread(
            target=self._save, args=(motion, topic.name, self._thread), daemon=True)
        self._thread.start()

    def _save(self, motion: RecordedMotion, topic: str, before: threading.Thread) -> None:
        """Write a motion after the one before."""
        if before.ident is not None:
            before.join()
        try:
            path = self._write(motion, topic)
        except FlexPlannerError as error:
            self._node.get_logger().error(printable(f'the motion is not recorded: {error}'))
            return
        self._node.get_logger().info(printable(
            f'recorded the motion with {len(motion.states)} joint states in {path}'))

    def _now(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)
