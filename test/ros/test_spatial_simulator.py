"""The arm simulator with an arm in space: it ends at the goal of a plan, and shows how it is."""

from __future__ import annotations

from collections.abc import Iterator
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Time
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.frames import link_frames
from flex_planner.arms.kinematics import link_points
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.ros import arm_picture
from flex_planner.ros.messages.plans import joint_trajectory
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner.ros.settings.simulator import SimulatorSettings
from geometry_msgs.msg import PointStamped
import numpy as np
import pytest
from ros_support import Client, STARTING
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

NAME, NODE = 'tudor_like', '/space/arm_simulator'
START, GOAL, PAYLOAD = [0.0, 0.0, 0.5], (0.52, 0.53, -0.05), 0.1


class Listener(Client):
    """A client that hears all that the simulator says."""

    def __init__(self) -> None:
        super().__init__()
        self.states: list[JointState] = self.listen(JointState, '/space/joint_states', 100)
        self.modes: list[JointState] = self.listen(JointState, f'{NODE}/modal_states', 100)
        self.tips: list[PointStamped] = self.listen(PointStamped, f'{NODE}/tip', 100)
        self.markers: list[MarkerArray] = self.listen(MarkerArray, f'{NODE}/markers', 100)
        self.vibrations: list[Float64] = self.listen(Float64, f'{NODE}/residual_vibration')
        self.bendings: list[Float64] = self.listen(Float64, f'{NODE}/residual_bending')
        self.publisher = self.node.create_publisher(
            JointTrajectory, '/space/joint_trajectory', 1)


@pytest.fixture(scope='module')
def listener(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Listener]:
    log = tmp_path_factory.mktemp('spatial_simulator') / 'log'
    parameters = {'arm': NAME, 'payload_mass': PAYLOAD, 'initial_positions': START,
                  'vibration_window': 0.3}
    with Listener() as client, NodeProcess('flex_planner.ros.arm_simulator', parameters,
                                           {'__ns': '/space'}, log=log):
        client.wait('states', lambda: bool(client.states and client.modes and client.markers),
                    STARTING)
        client.wait('subscription', lambda: client.publisher.get_subscription_count() == 1)
        yield client
        assert 'Traceback' not in log.read_text()


def test_arm_ends_at_the_goal_of_its_plan(listener: Listener) -> None:
    arm = load_arm(NAME)
    plan = plan_path(Task.to_point(arm, START, GOAL, duration=1.0, payload_mass=PAYLOAD),
                     model=ArmModel.of(arm), search=SearchEffort.FAST)
    sampled = sample_plan(plan, SamplingSettings())
    listener.publisher.publish(joint_trajectory(sampled, ['joint1', 'joint2', 'joint3']))
    listener.wait('arrival', lambda: bool(listener.vibrations and listener.bendings))
    tip = listener.next_of(listener.tips).point
    # as the certificate of the published trajectory has it, with room for what rings
    np.testing.assert_allclose([tip.x, tip.y, tip.z], GOAL, atol=1e-3)
    assert 0 < listener.vibrations[0].data < 1e-3
    assert 0 < listener.bendings[0].data < 1e-3


def test_states_and_links_are_those_of_an_arm_in_space(listener: Listener) -> None:
    arm = load_arm(NAME)
    listener.wait('markers', lambda: bool(listener.markers))
    assert listener.states[-1].name == ['joint1', 'joint2', 'joint3']
    assert listener.modes[-1].name == list(arm.modal_names)
    lines = [marker for marker in listener.markers[0].markers if marker.ns == 'links']
    drawn = np.array([[(point.x, point.y, point.z) for point in line.points] for line in lines])
    state = np.concatenate([START, listener.modes[0].position])  # bent by its weight, at rest
    np.testing.assert_allclose(drawn, link_points(arm, state, drawn.shape[1]), atol=1e-6)
    assert {marker.header.frame_id for marker in listener.markers[0].markers} == {'base_link'}


class FakeNode:
    """A node whose publishers keep what they are given."""

    def __init__(self) -> None:
        self.sent: dict[str, list[Any]] = {}
        self.said: list[str] = []

    def create_publisher(self, kind: Any, topic: str, depth: int) -> SimpleNamespace:
        return SimpleNamespace(publish=self.sent.setdefault(topic, []).append,
                               get_subscription_count=lambda: 1)

    def get_logger(self) -> SimpleNamespace:
        return SimpleNamespace(info=self.said.append)


def shown(state: np.ndarray[Any, Any]) -> FakeNode:
    arm, node = load_arm(NAME), FakeNode()
    picture = arm_picture.ArmPicture(node, arm, SimulatorSettings.for_arm(arm))
    picture.show(state, Time(sec=3))
    return node


def test_bent_frames_are_on_tf_beside_those_of_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    messages = ModuleType('tf2_msgs.msg')
    messages.TFMessage = SimpleNamespace  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'tf2_msgs', ModuleType('tf2_msgs'))
    monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', messages)
    arm = load_arm(NAME)
    state = np.linspace(0.1, 0.2, arm.n_coordinates)
    (frames,) = shown(state).sent['/tf']
    assert [(one.header.frame_id, one.child_frame_id) for one in frames.transforms] == [
        ('base_link', 'bent_link1'), ('bent_link1', 'bent_link2'), ('bent_link2', 'bent_link3'),
        ('bent_link3', 'bent_tip')]
    first, place = frames.transforms[0].transform.translation, link_frames(arm, state)[0][0]
    np.testing.assert_allclose([first.x, first.y, first.z], place)


def test_without_tf2_msgs_there_are_markers_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', None)
    node = shown(np.zeros(load_arm(NAME).n_coordinates))
    assert list(node.sent) == ['~/markers']
    assert node.said == ['no frames on /tf: tf2_msgs is not installed']
