"""The arm simulator in a process of its own, commanded as a controller is."""

from __future__ import annotations

from collections.abc import Iterator
import copy
from dataclasses import fields, replace
from pathlib import Path
import signal
import time
from typing import Any

from builtin_interfaces.msg import Duration
from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.ros.messages.plans import joint_trajectory
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner.ros.settings.simulator import SimulatorSettings
from flex_planner_interfaces.msg import FeedbackGains
from geometry_msgs.msg import PointStamped
import numpy as np
import pytest
from rclpy.time import Time
from ros_support import Client, LATCHED, PARAMETER_FILE, STARTING
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

MODULE = 'flex_planner.ros.arm_simulator'
START = [np.pi / 3, -2 * np.pi / 3]  # tip at (0.5, 0) m
GOAL = (0.5, 0.5)
RATE = 100.0


class Simulator(Client):
    """The simulator and a client that hears all it says."""

    def __init__(self, folder: Path, space: str = '', **parameters: object) -> None:
        super().__init__()
        self._log = folder / 'log.txt'
        self.process = NodeProcess(MODULE, {
            'arm': 'korayem_ei50', 'joint_names': ['joint1', 'joint2'], 'payload_mass': 1.0,
            'initial_positions': START, 'publish_rate': RATE, 'vibration_window': 0.5,
            **parameters}, {'__ns': space or '/'}, log=self._log, parameter_file=PARAMETER_FILE)
        own = f'{space}/arm_simulator'
        self.states: list[JointState] = self.listen(JointState, f'{space}/joint_states', 100)
        self.modes: list[JointState] = self.listen(JointState, f'{own}/modal_states', 100)
        self.tips: list[PointStamped] = self.listen(PointStamped, f'{own}/tip', 100)
        self.vibrations: list[Float64] = self.listen(Float64, f'{own}/residual_vibration')
        self.bendings: list[Float64] = self.listen(Float64, f'{own}/residual_bending')
        self._command = self.node.create_publisher(
            JointTrajectory, f'{space}/joint_trajectory', 1)

    def wait_until_ready(self) -> None:
        """Wait for the states and for the simulator's subscription."""
        self.wait('states', lambda: bool(self.states and self.modes and self.tips), STARTING)
        self.wait('subscription', lambda: self._command.get_subscription_count() == 1)

    def command(self, trajectory: JointTrajectory, reply: str) -> None:
        """Send a trajectory and wait for what the simulator logs about it."""
        known = self.log().count(reply)
        self._command.publish(trajectory)
        self.wait(reply, lambda: self.log().count(reply) > known)

    def log(self) -> str:
        """Return what the node has said."""
        return self._log.read_text()

    def tip(self) -> Any:
        """Return where the tip is said to be from now on [m]."""
        point = self.next_of(self.tips).point
        return point.x, point.y


@pytest.fixture(scope='module')
def simulator(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Simulator]:
    with Simulator(tmp_path_factory.mktemp('simulator'), feedback_gains=True) as simulator:
        with simulator.process:
            simulator.wait_until_ready()
            yield simulator
            assert simulator.process.stop(signal.SIGINT) == 0
        assert 'Traceback' not in simulator.log()


@pytest.fixture(scope='module')
def planned(ei50_arm: Arm, ei50_model: ArmModel, paper_task: Any) -> JointTrajectory:
    """Return the motion of the paper as a controller gets it."""
    plan = plan_path(paper_task(ei50_arm), model=ei50_model)
    reference = sample_plan(plan, SamplingSettings(torque_tolerance=2e-3))
    return joint_trajectory(reference, ['joint1', 'joint2'])


def test_states_come_at_the_rate_and_are_complete(simulator: Simulator) -> None:
    def periods() -> Array:
        stamps = [s.header.stamp.sec + s.header.stamp.nanosec * 1e-9 for s in simulator.states]
        return np.diff(stamps) * RATE

    # a machine that is busy makes some of them late, and none early
    simulator.wait('states a period apart', lambda: (
        np.abs(periods() - 1) < 0.2).sum() > 20)
    assert periods().mean() > 0.8
    state, modes = simulator.states[-1], simulator.modes[-1]
    assert state.name == ['joint1', 'joint2']
    assert len(state.position) == len(state.velocity) == len(state.effort) == 2
    assert modes.name == ['link1_mode1', 'link1_mode2', 'link2_mode1', 'link2_mode2']
    assert len(modes.position) == len(modes.velocity) == 4
    assert simulator.tips[-1].header.frame_id == 'base_link'


def test_gains_take_the_place_of_the_pd(simulator: Simulator) -> None:
    gains = FeedbackGains(joint_names=['joint1', 'joint2'], rate=1000.0, speed_filter=50.0,
                          p=[100.0, 100.0], d=[10.0, 10.0], joints_leave=[1e-3],
                          message='no gains are stable')
    publisher = simulator.node.create_publisher(FeedbackGains, '/feedback_gains', LATCHED)
    for changes, reply in (({}, 'using gains of feedback'),
                           ({'rate': 250.0}, 'gains refused: rate of the law is 250.0'),
                           ({'d': [1.0]}, 'gains refused: '),
                           ({'joints_leave': []}, 'using the PD: no gains are stable')):
        known = simulator.log().count(reply)
        message = copy.deepcopy(gains)
        for name, value in changes.items():
            setattr(message, name, value)
        publisher.publish(message)
        simulator.wait(reply, lambda: simulator.log().count(reply) > known)  # noqa: B023


def shifted(trajectory: JointTrajectory) -> JointTrajectory:
    """Return a trajectory that starts where the arm never is."""
    for point in trajectory.points:
        point.positions[0] += 1.5
    return trajectory


def moving_at_the_end(trajectory: JointTrajectory) -> JointTrajectory:
    trajectory.points[-1].velocities[1] = 1e-3
    return trajectory


def without_effort(trajectory: JointTrajectory) -> JointTrajectory:
    for point in trajectory.points:
        point.effort = []
    return trajectory


def of_another_arm(trajectory: JointTrajectory) -> JointTrajectory:
    trajectory.joint_names = ['joint1', 'wrist']
    return trajectory


def huge(trajectory: JointTrajectory) -> JointTrajectory:
    trajectory.points[1].positions[1] = -1e308
    return trajectory


def infinite(trajectory: JointTrajectory) -> JointTrajectory:
    trajectory.points[3].effort[0] = np.inf
    return trajectory


def torn(trajectory: JointTrajectory) -> JointTrajectory:
    """Return a trajectory that begins where another ends, with the torques of a large crane."""
    last, first = trajectory.points[-1], copy.deepcopy(trajectory.points[-1])
    first.time_from_start = Duration(sec=0, nanosec=0)
    first.effort = last.effort = [5e6, -5e6]
    return JointTrajectory(joint_names=trajectory.joint_names, points=[first, last])


def empty(trajectory: JointTrajectory) -> JointTrajectory:
    return JointTrajectory(joint_names=trajectory.joint_names)


@pytest.mark.parametrize(('spoil', 'reason'), [
    (shifted, 'rad away from the arm, more than start_tolerance = 0.05 rad'),
    (moving_at_the_end, 'the last velocities must be 0'),
    (without_effort, 'points[0].effort has 0 entries'),
    (of_another_arm, 'must be a permutation of'),
    (huge, 'points[1].positions[1] is -1e+308, but must be a number >= -100 and <= 100 rad'),
    (infinite, 'points[3].effort must be finite'),
    (empty, 'points must not be empty')])
def test_bad_trajectory_is_refused_and_the_arm_stays(simulator: Simulator, spoil: Any,
                                                     planned: JointTrajectory,
                                                     reason: str) -> None:
    before = simulator.tip()
    simulator.command(spoil(copy.deepcopy(planned)), 'trajectory refused: ')
    assert reason in simulator.log().splitlines()[-1]
    simulator.spin(0.1)
    assert simulator.tip() == pytest.approx(before, abs=1e-9)


def test_arm_rests_and_then_follows_a_plan_to_the_goal(simulator: Simulator,
                                                       planned: JointTrajectory) -> None:
    assert simulator.tip() == pytest.approx((0.5, 0.0), abs=1e-9)
    simulator.command(planned, 'following a trajectory')
    simulator.wait('the arrival', lambda: 'after the arrival the tip' in simulator.log())
    assert simulator.tip() == pytest.approx(GOAL, abs=5e-5)
    simulator.tips.clear()
    simulator.spin(0.3)
    distances = [np.hypot(tip.point.x - GOAL[0], tip.point.y - GOAL[1]) for tip in simulator.tips]
    assert max(distances) < 5e-5
    assert max(np.abs(simulator.states[-1].velocity)) < 1e-3


def test_residual_vibration_is_told_once_after_the_arrival(simulator: Simulator) -> None:
    simulator.wait('vibration', lambda: bool(simulator.vibrations and simulator.bendings))
    # of the samples of the trajectory, held for 1 ms: less than 0.01 mm
    assert 0 < simulator.vibrations[0].data < 1e-5
    assert 0 < simulator.bendings[0].data < 1e-5
    assert len(simulator.vibrations) == len(simulator.bendings) == 1
    assert 'after the arrival the tip moved by' in simulator.log()
    assert simulator.latched(Float64, '/arm_simulator/residual_vibration').data < 1e-5


def test_arm_that_differs_from_the_plan_shows_it(tmp_path: Path,
                                                 planned: JointTrajectory) -> None:
    step = 0.001
    with Simulator(tmp_path, '/other', payload_mass=1.5, modes=1, rigidity_scale=0.5,
                   added_friction=[0.2, 0.1], encoder_rate=500.0, encoder_resolution=step,
                   encoder_differences=True, feedforward=False, disturbance_joint=2,
                   disturbance_torque=3.0, disturbance_start=0.3,
                   disturbance_duration=0.1) as arm, arm.process:
        arm.wait_until_ready()
        assert arm.modes[-1].name == ['link1_mode1', 'link2_mode1']
        arm.command(planned, 'following a trajectory')
        arm.wait('vibration', lambda: bool(arm.vibrations and arm.bendings))
        assert 5e-3 < arm.vibrations[0].data < 0.5
        assert 1e-4 < arm.bendings[0].data < 0.1
        counts = np.array(arm.states[-1].position) / step
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
        assert arm.process.stop(signal.SIGTERM) == 0


def test_simulator_that_is_too_slow_says_so_and_goes_on(tmp_path: Path) -> None:
    began = time.monotonic()
    with Simulator(tmp_path, '/slow', control_rate=1e5) as arm, arm.process:
        arm.wait_until_ready()
        reason = 'this machine is too slow for control_rate = 100000 Hz with 4 modes'
        arm.wait('warning', lambda: reason in arm.log())
        arm.states.clear()
        arm.wait('states', lambda: bool(arm.states))
        assert arm.process.stop(signal.SIGINT) == 0
    assert arm.log().count(reason) <= 1 + (time.monotonic() - began) / 5  # one in 5 s


class ClockedSimulator(Simulator):
    """A simulator by ``/clock``, which the test sets."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, '/clocked', use_sim_time=True, limit_torques=False)
        self._clock = self.node.create_publisher(ClockMessage, '/clock', 10)

    def pass_time(self, begin: float, end: float) -> None:
        """Set the clock and let it go on by steps of 0.1 s, each once the arm has got there."""
        for seconds in np.arange(begin, end + 0.01, 0.1):
            stamp = Time(nanoseconds=round(seconds * 1e9)).to_msg()
            self._clock.publish(ClockMessage(clock=stamp))
            if seconds == begin:  # where it jumps to, no timer is due
                self.spin(0.2)
                continue
            self.wait(f'the states of {seconds:.1f} s', lambda due=stamp: bool(
                self.states and self.states[-1].header.stamp == due), 5.0)


def test_simulator_follows_a_clock_that_jumps_and_survives_torques_that_no_arm_does(
        tmp_path: Path, planned: JointTrajectory) -> None:
    with ClockedSimulator(tmp_path) as arm, arm.process:
        arm.wait('a word on the clock', lambda: 'nothing has come on /clock' in arm.log())
        assert not arm.states
        arm.wait('subscriptions', lambda: arm.node.count_subscribers('/clock') == 1)
        arm.pass_time(1e6, 1e6 + 0.2)
        assert 'late' not in arm.log()
        arm.command(planned, 'following a trajectory')
        arm.pass_time(1e6 + 0.3, 1e6 + 0.7)
        arm.spin(0.3)  # the clock stands still
        moving = arm.states[-1]
        assert moving.header.stamp.sec == 1_000_000
        assert np.abs(moving.velocity).max() > 0.1
        arm.pass_time(3.0, 3.7)
        assert 'the clock has jumped by -999997' in arm.log()
        arm.wait('where the tip is then', lambda: (
            arm.tips[-1].header.stamp == arm.states[-1].header.stamp))
        tip = arm.tips[-1].point
        assert (tip.x, tip.y) == pytest.approx(GOAL, abs=5e-5)
        arm.command(torn(copy.deepcopy(planned)), 'following a trajectory')
        arm.pass_time(3.8, 4.5)
        assert 'The arm is at rest at its initial positions again' in arm.log()
        assert arm.states[-1].position == pytest.approx(START, abs=1e-9)
        assert arm.process.stop(signal.SIGINT) == 0


@pytest.mark.parametrize(('changes', 'text'), [
    ({'initial_positions': [0.1]}, 'initial_positions has 1 number'),
    ({'stiffness': [1.0, -1.0]}, r'stiffness\[1\] is -1.0'),
    ({'stiffness': [1.0, 1e308]}, r'stiffness\[1\] is 1e\+308, but must be a number'),
    ({'initial_positions': [0.0, 1e308]}, r'initial_positions\[1\] is 1e\+308'),
    ({'damping': [1.0]}, 'damping has 1 number'),
    ({'added_friction': [0.0, -0.1]}, r'added_friction\[1\] is -0.1'),
    ({'added_friction': [0.1]}, 'added_friction has 1 number'),
    ({'modes': 9}, 'modes is 9'),
    ({'rigidity_scale': 0.0}, 'rigidity_scale is 0.0'),
    ({'encoder_rate': np.nan}, 'encoder_rate is nan'),
    ({'encoder_resolution': -1.0}, 'encoder_resolution is -1.0'),
    ({'disturbance_joint': 3}, 'disturbance_joint is 3'),
    ({'disturbance_torque': np.inf}, 'disturbance_torque is inf'),
    ({'disturbance_start': -1.0}, 'disturbance_start is -1.0'),
    ({'disturbance_duration': np.nan}, 'disturbance_duration is nan')])
def test_bad_settings_are_refused(ei50_arm: Arm, changes: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidValueError, match=text):
        replace(SimulatorSettings.for_arm(ei50_arm), **changes)


def test_every_parameter_is_described(ei50_arm: Arm) -> None:
    settings = SimulatorSettings.for_arm(ei50_arm)
    assert settings.mismatch.apply(ei50_arm).links == ei50_arm.links
    for entry in fields(settings):
        assert entry.metadata['description'].text.endswith('.'), entry.name


@pytest.mark.parametrize(('parameters', 'reason'), [
    ({'disturbance_joint': 3}, 'disturbance_joint'),
    ({'arm': 'korayem_rigid', 'control_rate': 1.0}, 'control_rate')])
def test_simulator_with_a_bad_parameter_says_so_and_ends(tmp_path: Path, reason: str,
                                                         parameters: dict[str, object]) -> None:
    log = tmp_path / 'log.txt'
    with NodeProcess(MODULE, parameters, log=log) as node:
        assert node.process.wait(STARTING) == 1
    assert reason in log.read_text()
    assert 'Traceback' not in log.read_text()
