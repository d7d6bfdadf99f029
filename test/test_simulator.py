"""The arm simulator in a process of its own, commanded as a controller is."""

from __future__ import annotations

from collections.abc import Iterator
import copy
from pathlib import Path
import signal
from typing import Any

from flex_planner.arm import Arm
from flex_planner.model import ArmModel
from flex_planner.path import plan_path
from flex_planner.reference import sample_reference, SamplingSettings
from flex_planner.ros.conversions import joint_trajectory
from flex_planner.ros.processes import NodeProcess
from geometry_msgs.msg import PointStamped
import numpy as np
import pytest
from ros_support import Client, STARTING
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

MODULE = 'flex_planner.ros.arm_simulator'
START = [np.pi / 3, -2 * np.pi / 3]  # tip at (0.5, 0) m
GOAL = (0.5, 0.5)
RATE = 100.0


class Simulator(Client):
    """The simulator and a client that hears all it says."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._log = folder / 'log.txt'
        self.process = NodeProcess(MODULE, {
            'arm': 'korayem_ei50', 'joint_names': ['joint1', 'joint2'], 'payload_mass': 1.0,
            'initial_positions': START, 'publish_rate': RATE}, log=self._log)
        self.states: list[JointState] = self.listen(JointState, '/joint_states', 100)
        self.modes: list[JointState] = self.listen(JointState, '/arm_simulator/modal_states', 100)
        self.tips: list[PointStamped] = self.listen(PointStamped, '/arm_simulator/tip', 100)
        self._command = self.node.create_publisher(JointTrajectory, '/joint_trajectory', 1)

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
        """Return where the tip is said to be next [m]."""
        self.tips.clear()
        self.wait('tip', lambda: bool(self.tips))
        return self.tips[0].point.x, self.tips[0].point.y


@pytest.fixture(scope='module')
def simulator(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Simulator]:
    with Simulator(tmp_path_factory.mktemp('simulator')) as simulator:
        with simulator.process:
            simulator.wait_until_ready()
            yield simulator
            assert simulator.process.stop(signal.SIGINT) == 0
        assert 'Traceback' not in simulator.log()


@pytest.fixture(scope='module')
def planned(ei50_arm: Arm, ei50_model: ArmModel, paper_task: Any) -> JointTrajectory:
    """Return the motion of the paper as a controller gets it."""
    plan = plan_path(paper_task(ei50_arm), model=ei50_model)
    reference = sample_reference(plan, SamplingSettings(torque_tolerance=2e-3))
    return joint_trajectory(reference, ['joint1', 'joint2'])


def test_states_come_at_the_rate_and_are_complete(simulator: Simulator) -> None:
    simulator.wait('states', lambda: len(simulator.states) > 100)
    stamps = [s.header.stamp.sec + s.header.stamp.nanosec * 1e-9 for s in simulator.states[-80:]]
    assert np.median(np.diff(stamps)) == pytest.approx(1 / RATE, rel=0.2)
    state, modes = simulator.states[-1], simulator.modes[-1]
    assert state.name == ['joint1', 'joint2']
    assert len(state.position) == len(state.velocity) == len(state.effort) == 2
    assert modes.name == ['link1_mode1', 'link1_mode2', 'link2_mode1', 'link2_mode2']
    assert len(modes.position) == len(modes.velocity) == 4
    assert simulator.tips[-1].header.frame_id == 'base_link'


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


def empty(trajectory: JointTrajectory) -> JointTrajectory:
    return JointTrajectory(joint_names=trajectory.joint_names)


@pytest.mark.parametrize(('spoil', 'reason'), [
    (shifted, 'rad away from the arm, more than start_tolerance = 0.05 rad'),
    (moving_at_the_end, 'the last velocities must be 0'),
    (without_effort, 'points[0].effort has 0 entries'),
    (of_another_arm, 'must be a permutation of'),
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
    simulator.spin(1.5)
    assert simulator.tip() == pytest.approx(GOAL, abs=5e-5)
    simulator.tips.clear()
    simulator.spin(0.3)
    distances = [np.hypot(tip.point.x - GOAL[0], tip.point.y - GOAL[1]) for tip in simulator.tips]
    assert max(distances) < 5e-5
    assert max(np.abs(simulator.states[-1].velocity)) < 1e-3


@pytest.mark.parametrize(('parameters', 'reason'), [
    ({'initial_positions': [0.1]}, 'initial_positions'),
    ({'arm': 'korayem_rigid', 'control_rate': 1.0}, 'control_rate')])
def test_simulator_with_a_bad_parameter_says_so_and_ends(tmp_path: Path, reason: str,
                                                         parameters: dict[str, object]) -> None:
    log = tmp_path / 'log.txt'
    with NodeProcess(MODULE, parameters, log=log) as node:
        assert node.process.wait(STARTING) == 1
    assert reason in log.read_text()
    assert 'Traceback' not in log.read_text()
