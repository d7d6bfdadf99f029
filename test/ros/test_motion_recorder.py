"""Joint states of motions are recorded from before they begin to after they end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import time
from typing import Any

from builtin_interfaces.msg import Duration
from flex_planner.arms.arm import Arm
from flex_planner.base.errors import RecordingError
from flex_planner.logs.recorded_log import read_recorded_logs
from flex_planner.ros.motion_recorder import MotionRecorder
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.recorded_motion import RecordedMotion
from flex_planner.ros.settings.planner import PlannerSettings
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from ros_support import Client
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

NAMES = ['joint1', 'joint2']


class Arena(Client):
    """A node with a recorder, and joint states at 100 Hz of the way that has passed."""

    def __init__(self, write: Callable[[RecordedMotion, str], Any], **changes: Any) -> None:
        super().__init__()
        self.settings = PlannerSettings(joint_names=NAMES, effort_weights=[1.0, 1.0],
                                        controller_stiffness=[1.0, 1.0],
                                        controller_damping=[1.0, 1.0], record_motions=True,
                                        motion_settling=0.2, **changes)
        self.recorder = MotionRecorder(self.node, self.settings, write)
        self._publisher = self.node.create_publisher(JointState, 'joint_states', 10)
        self.wait('subscription', lambda: self._publisher.get_subscription_count() > 0)
        self.node.create_timer(0.01, self._say)
        self.said = 0

    def _say(self) -> None:
        state = JointState(name=NAMES, position=[0.01 * self.said, 0.0])
        state.header.stamp = self.node.get_clock().now().to_msg()
        self._publisher.publish(state)
        self.said += 1


def trajectory(seconds: float) -> JointTrajectory:
    """Return a motion that takes some time."""
    points = [JointTrajectoryPoint(
        positions=[at, 0.0], velocities=[0.0, 0.0], time_from_start=Duration(
            sec=int(at), nanosec=int(at % 1 * 1e9))) for at in (0.0, seconds)]
    return JointTrajectory(joint_names=NAMES, points=points)


def test_recording_is_a_log_of_the_motion(tmp_path: Path, rigid_arm: Arm) -> None:
    recorder, written = OutcomeRecorder(rigid_arm, '/flex_planner'), []
    with Arena(lambda *motion: written.append(recorder.write_motion(*motion)),
               recording_folder=str(tmp_path)) as arena:
        arena.wait('states', lambda: arena.said > 60)
        arena.recorder.begin(trajectory(0.5), arena.settings)
        began = time.time()
        arena.wait('the end', lambda: bool(written))
    log, = read_recorded_logs(written[0], 2)
    assert written[0].name.startswith('motion_')
    # to the end and the time after it, within a look of the recorder
    assert log.times[-1] - log.reference_start == pytest.approx(0.7, abs=0.15)
    assert log.reference_start_error > 0 and time.time() - began > 0.7
    assert log.reference_start - log.times[0] == pytest.approx(0.15, abs=0.03)
    # nothing is lost, and nothing comes twice
    assert np.diff(log.angles[:, 0]) == pytest.approx(0.01)


def test_motion_ends_where_another_begins_or_the_node_ends() -> None:
    written: list[RecordedMotion] = []
    with Arena(lambda motion, _: written.append(motion)) as arena:
        arena.wait('states', lambda: arena.said > 10)
        arena.recorder.begin(trajectory(50.0), arena.settings)
        arena.spin(0.3)
        arena.recorder.begin(trajectory(60.0), arena.settings)
        arena.wait('the first one', lambda: len(written) == 1)
        arena.recorder.close()
        arena.wait('the second one', lambda: len(written) == 2)
    assert [motion.trajectory.points[-1].positions[0] for motion in written] == [50.0, 60.0]
    first, second = ({data for _, data in motion.states} for motion in written)
    assert first & second  # what came before the second one began


def test_failure_to_write_is_logged_and_no_more(capfd: pytest.CaptureFixture[str]) -> None:
    def fail(motion: RecordedMotion, topic: str) -> None:
        raise RecordingError('the disk is full')

    with Arena(fail) as arena:
        arena.wait('states', lambda: arena.said > 10)
        arena.recorder.begin(trajectory(0.1), arena.settings)
        arena.recorder.close()
        assert 'the motion is not recorded: the disk is full' in capfd.readouterr().err


def test_recording_waits_for_an_arm_that_is_late() -> None:
    def motion(seconds: float) -> RecordedMotion:
        state = JointState()
        state.header.stamp.sec, state.header.stamp.nanosec = divmod(round(seconds * 1e9), 10**9)
        return RecordedMotion(settings=None, trajectory=None, began_ns=10**10,  # type: ignore
                              end_ns=11 * 10**9, states=[(0, serialize_message(state))])

    late, there, stampless = motion(10.9), motion(11.0), motion(0.0)
    assert [one.is_over(round(11.1e9)) for one in (late, there, stampless)] == [False, True, True]
    assert not there.is_over(round(10.9e9))  # by its own clock it is not over
    assert late.is_over(round(16.1e9))
