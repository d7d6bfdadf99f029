"""The planner node's knowledge of where the arm is, and whether a plan starts there."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
import threading
import time
from typing import Any

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.optimal_control.task import Task
from flex_planner.ros.messages.measured_starts import ArmStateError
from flex_planner.ros.messages.measured_states import AngleTrack
from flex_planner.ros.planner.measured_joints import JointReading, MeasuredJoints
from flex_planner.ros.runtime.polled_topic import Polled
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import PlanReport
import numpy as np
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

_POLLING_PERIOD = 0.05  # [s]
_PATIENCE_STEP = 0.02  # [s]
# what comes in a period, also from several publishers of 1 kHz; heard from any kind of publisher
_QOS = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)


class Latest:
    """
    The latest message of a topic, which the executor has nothing to do with.

    Parameters
    ----------
    node : Node
        That listens.
    kind : type
        Of the messages.
    topic : str
        Its name.

    """

    def __init__(self, node: Node, kind: Any, topic: str) -> None:
        self._kind, self._message, self._lock = kind, None, threading.Lock()
        self._subscription = node.create_subscription(
            kind, topic, lambda message: None,
            QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
            callback_group=Polled())

    def take(self) -> Any:
        """Return it, None if there was none; from any thread."""
        with self._lock, self._subscription.handle:
            while (taken := self._subscription.handle.take_message(self._kind, False)) is not None:
                self._message = taken[0]
            return self._message


class ArmState:
    """
    Listens to the joint states of the arm and compares plans with them.

    Parameters
    ----------
    node : Node
        The planner; its clock tells how old a state is.
    settings : PlannerSettings
        With the topic and the names of the joints.

    Attributes
    ----------
    angles : AngleTrack
        Of the last moments.

    Raises
    ------
    InvalidValueError
        If there cannot be such a topic.

    """

    def __init__(self, node: Node, settings: PlannerSettings) -> None:
        self._node, self._lock, self._warned = node, threading.Lock(), False
        topic, self._subscription = settings.joint_states_topic, None
        self._joints = MeasuredJoints(settings.joint_names, topic)
        self.angles = AngleTrack(settings.joint_names)
        if not topic:
            return
        try:
            self._joints = MeasuredJoints(settings.joint_names, node.resolve_topic_name(topic))
            self._subscription = node.create_subscription(
                JointState, topic, self._hear, _QOS, callback_group=Polled())
        except (NameValidationException, RuntimeError) as error:
            raise InvalidValueError('joint_states_topic', topic,
                                    f'the name of a topic: {error}') from error
        # by a clock that also goes on while a simulation is paused
        node.create_timer(_POLLING_PERIOD, self.listen, callback_group=ReentrantCallbackGroup(),
                          clock=Clock(clock_type=ClockType.STEADY_TIME))

    def listen(self) -> None:
        """Take the messages that have come; from any thread."""
        subscription = self._subscription
        if subscription is None:
            return
        with self._lock, subscription.handle:
            while (taken := subscription.handle.take_message(JointState, False)) is not None:
                self._hear(taken[0])
        if self._joints.others and not self._joints.heard and not self._warned:
            self._warned = True
            self._node.get_logger().warning(
                f'the joint states that are heard name {self._joints.others}, but no joint of '
                'joint_names: whether plans start where the arm is cannot be checked')

    def find_rest(self, settings: PlannerSettings, canceled: Callable[[], bool]) -> Array:
        """
        Return where the arm is at rest [rad], shape (n,), once that is heard.

        Raises
        ------
        ArmStateError
            If it moves, or nothing usable is heard in time.

        """
        if not settings.joint_states_topic:
            raise ArmStateError(
                PlanReport.ARM_STATE_UNKNOWN, 'the motion should start where the arm is, but the '
                'parameter joint_states_topic is empty: name the topic of the arm')
        end = time.monotonic() + settings.joint_state_timeout
        while time.monotonic() < end and not canceled():
            with suppress(ArmStateError):
                self._read(settings)
                break
            time.sleep(_PATIENCE_STEP)
        reading = self._read(settings)
        _check_speeds(reading, np.zeros(reading.speeds.size), settings)
        return reading.positions

    def motion(self, settings: PlannerSettings) -> str:
        """Return how the arm moves, empty if it is at rest or not known."""
        with suppress(ArmStateError):
            reading = self._read(settings)
            try:
                _check_speeds(reading, np.zeros(reading.speeds.size), settings)
            except ArmStateError as error:
                return str(error)
        return ''

    def check(self, task: Task, settings: PlannerSettings, motion: str) -> list[float]:
        """
        Return where the arm is [rad], which is where a task starts.

        Where nothing is heard of the arm, or `check_start` is off, this is not checked, and empty.

        Parameters
        ----------
        task : Task
            The task.
        settings : PlannerSettings
            With the tolerances.
        motion : str
            How the arm moved when the plan was requested, empty if it did not.

        Raises
        ------
        ArmStateError
            If the arm is elsewhere, moves, or says nothing any more.

        """
        self.listen()
        if not (settings.check_start and self._joints.heard):
            return []
        n, given = task.arm.n_joints, np.asarray(task.start_velocities)
        speeds = given[:n] if given.size else np.zeros(n)
        try:
            if motion and not speeds.any():
                raise ArmStateError(PlanReport.ARM_MOVES,
                                    f'the arm moved when the plan was requested: {motion}')
            reading = self._read(settings)
            _check_speeds(reading, speeds, settings)
            _check_positions(reading, np.asarray(task.start_positions), settings)
        except ArmStateError as error:
            raise ArmStateError(error.code, f'planned, but not published: {error}') from error
        return [float(value) for value in reading.positions]

    def _hear(self, message: JointState) -> None:
        self._joints.hear(message, self._now())
        self.angles.hear(message)

    def _read(self, settings: PlannerSettings) -> JointReading:
        self.listen()
        return self._joints.read(self._now(), settings.joint_state_timeout)

    def _now(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)


def _check_speeds(reading: JointReading, wanted: Array, settings: PlannerSettings) -> None:
    """Raise ArmStateError unless the joints have the speeds that are wanted [rad/s]."""
    limit = settings.start_speed_tolerance
    errors = np.abs(reading.speeds - wanted)
    k = int(errors.argmax())
    if errors[k] > limit:
        raise ArmStateError(
            PlanReport.ARM_MOVES, f'{settings.joint_names[k]} moves at {reading.speeds[k]:.3g} '
            f'rad/s instead of {wanted[k]:.3g}, off by more than start_speed_tolerance = '
            f'{limit:g} rad/s')
    if wanted.any():
        return
    k = int(reading.drifts.argmax())
    if reading.drifts[k] > limit * reading.WINDOW:
        raise ArmStateError(
            PlanReport.ARM_MOVES, f'{settings.joint_names[k]} moves: its position changed by '
            f'{reading.drifts[k]:.3g} rad within {reading.WINDOW:g} s, more than '
            f'start_speed_tolerance = {limit:g} rad/s allows (where it stands still, more than '
            'one node publishes it)')


def _check_positions(reading: JointReading, start: Array, settings: PlannerSettings) -> None:
    """Raise ArmStateError unless the joints are at the start."""
    errors = np.abs(reading.positions - start)
    k, limit = int(errors.argmax()), settings.start_tolerance
    if errors[k] > limit:
        raise ArmStateError(
            PlanReport.NOT_AT_START, f'{settings.joint_names[k]} is at '
            f'{reading.positions[k]:.4g} rad, but the plan starts at {start[k]:.4g} rad, farther '
            f'away than start_tolerance = {limit:g} rad: bring the arm there, or plan with '
            'start = 1 (CURRENT)')
