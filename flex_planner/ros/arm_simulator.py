"""A simulated flexible arm that follows ``joint_trajectory`` like a controller with hardware."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from builtin_interfaces.msg import Time
from flex_planner.arm import Arm
from flex_planner.kinematics import tip_position
from flex_planner.model import ArmModel
from flex_planner.plant import Gains, JointReference, Plant
from flex_planner.ros.conversions import duration_seconds
from flex_planner.ros.parameters import declare, declare_arm, described
from flex_planner.ros.running import run_node
from flex_planner.trajectory_rules import trajectory_violations
from flex_planner.validation import Array, vector
from geometry_msgs.msg import PointStamped
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorSettings:
    """
    Parameters of the simulator; all read-only.

    Raises
    ------
    InvalidValueError
        If a list does not have one entry a joint.

    """

    joint_names: list[str] = described(
        ['joint1'], 'Names of the joints, from the base outwards.', read_only=True)
    initial_positions: list[float] = described(
        [0.0], 'Joint angles at the start [rad].', read_only=True)
    payload_mass: float = described(
        1.0, 'Mass at the tip of the simulated arm [kg].', lowest=0.0, highest=1e6,
        read_only=True)
    payload_inertia: float = described(
        0.0, 'Rotary inertia of that mass about the tip [kg m^2].', lowest=0.0, highest=1e6,
        read_only=True)
    stiffness: list[float] = described(
        [100.0], 'Proportional gain of each joint [N m/rad].', read_only=True)
    damping: list[float] = described(
        [10.0], 'Derivative gain of each joint [N m s/rad].', read_only=True)
    control_rate: float = described(
        1000.0, 'Rate of the simulated controller [Hz].', lowest=10.0, highest=1e4,
        read_only=True)
    publish_rate: float = described(
        100.0, 'Rate of the published states [Hz].', lowest=1.0, highest=1000.0, read_only=True)
    start_tolerance: float = described(
        0.05, 'A trajectory that starts further from the arm than this is refused [rad].',
        lowest=0.0, highest=10.0, read_only=True)
    base_frame: str = described('base_link', 'Frame of the tip.', read_only=True)

    def __post_init__(self) -> None:
        count = len(self.joint_names)
        for name in ('initial_positions', 'stiffness', 'damping'):
            vector(name, getattr(self, name), count)

    @classmethod
    def for_arm(cls, arm: Arm) -> SimulatorSettings:
        """Return the defaults for an arm."""
        n = arm.n_joints
        return replace(cls(), joint_names=[f'joint{i}' for i in range(1, n + 1)],
                       initial_positions=[0.0] * n, stiffness=[100.0] * n, damping=[10.0] * n)


class ArmSimulator(Node):  # type: ignore[misc]
    """
    A flexible arm in real time, under feedforward torque and joint PD.

    Topics subscribed
    -----------------
    joint_trajectory : trajectory_msgs/msg/JointTrajectory

    Topics published
    ----------------
    joint_states : sensor_msgs/msg/JointState
    ~/modal_states : sensor_msgs/msg/JointState
    ~/tip : geometry_msgs/msg/PointStamped

    Raises
    ------
    FlexPlannerError
        If a parameter or the arm's file is wrong.

    """

    def __init__(self) -> None:
        super().__init__('arm_simulator')
        self._arm = declare_arm(self)
        self._settings = declare(self, SimulatorSettings.for_arm(self._arm))
        self._plant = self._new_plant()
        self._joints = self.create_publisher(JointState, 'joint_states', 10)
        self._modes = self.create_publisher(JointState, '~/modal_states', 10)
        self._tip = self.create_publisher(PointStamped, '~/tip', 10)
        self.create_subscription(JointTrajectory, 'joint_trajectory', self._on_trajectory, 1)
        self._began = self.get_clock().now()
        self.create_timer(1 / self._settings.publish_rate, self._on_timer)
        self.get_logger().info(f'simulating {self._arm.name}')

    def _new_plant(self) -> Plant:
        settings = self._settings
        gains = Gains(stiffness=np.asarray(settings.stiffness),
                      damping=np.asarray(settings.damping))
        return Plant(ArmModel(self._arm), payload_mass=settings.payload_mass,
                     payload_inertia=settings.payload_inertia, gains=gains,
                     positions=np.asarray(settings.initial_positions),
                     rate=settings.control_rate)

    def _on_trajectory(self, trajectory: JointTrajectory) -> None:
        """Follow a trajectory, or say why not."""
        self._advance()  # first, so that the motion begins when its trajectory came
        refusal = self._refusal(trajectory)
        if refusal:
            self.get_logger().error(f'trajectory refused: {refusal}')
            return
        n, n_t, state = self._arm.n_joints, self._arm.n_coordinates, self._plant.state
        reference = _reference(trajectory, self._settings.joint_names)
        self._plant.follow(reference.after(state[:n], state[n_t:n_t + n], self._plant.torque))
        self.get_logger().info(f'following a trajectory of {len(trajectory.points)} points')

    def _refusal(self, trajectory: JointTrajectory) -> str:
        """Return why a trajectory cannot be followed, empty if it can."""
        broken = trajectory_violations(trajectory, self._settings.joint_names)
        if broken:
            return '; '.join(broken[:3])
        start = _reference(trajectory, self._settings.joint_names).positions[0]
        distance = float(np.abs(start - self._plant.state[:start.size]).max())
        if distance > self._settings.start_tolerance:
            return (f'it starts {distance:.3f} rad away from the arm, more than start_tolerance '
                    f'= {self._settings.start_tolerance:g} rad')
        return ''

    def _on_timer(self) -> None:
        """Bring the arm up to now and publish it."""
        self._advance()
        n, n_t = self._arm.n_joints, self._arm.n_coordinates
        state, torque = self._plant.state, self._plant.torque
        stamp = self.get_clock().now().to_msg()
        self._joints.publish(_state_message(
            stamp, self._settings.joint_names, state[:n], state[n_t:n_t + n], torque))
        if self._arm.n_modes:
            self._modes.publish(_state_message(
                stamp, self._arm.modal_names, state[n:n_t], state[n_t + n:], np.zeros(0)))
        tip = PointStamped()
        tip.header.stamp, tip.header.frame_id = stamp, self._settings.base_frame
        tip.point.x, tip.point.y = (float(v) for v in tip_position(self._arm, state[:n_t]))
        self._tip.publish(tip)

    def _advance(self) -> None:
        elapsed = self.get_clock().now() - self._began
        self._plant.advance(elapsed.nanoseconds * 1e-9)


def _reference(trajectory: JointTrajectory, names: list[str]) -> JointReference:
    """Return a trajectory as arrays, joints in our order."""
    order = [list(trajectory.joint_names).index(name) for name in names]
    points = trajectory.points

    def column(field: str) -> Array:
        return np.array([getattr(point, field) for point in points])[:, order]

    times = [duration_seconds(point.time_from_start) for point in points]
    return JointReference(times=np.array(times), positions=column('positions'),
                          velocities=column('velocities'), torques=column('effort'))


def _state_message(stamp: Time, names: Sequence[str], positions: Array, velocities: Array,
                   efforts: Array) -> JointState:
    message = JointState(name=list(names), position=positions.tolist(),
                         velocity=velocities.tolist(), effort=efforts.tolist())
    message.header.stamp = stamp
    return message


def main(args: list[str] | None = None) -> None:
    """Run the simulator until it is told to stop."""
    run_node(ArmSimulator, 'arm_simulator', args)


if __name__ == '__main__':
    main()
