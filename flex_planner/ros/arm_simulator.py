"""A simulated flexible arm that follows ``joint_trajectory`` like a controller with hardware."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import time

from builtin_interfaces.msg import Time
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.text import printable
from flex_planner.base.validation import Array
from flex_planner.control.joint_reference import JointReference
from flex_planner.control.linear_feedback import LinearFeedback
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.ros.arm_picture import ArmPicture
from flex_planner.ros.messages.feedback import law_from_message
from flex_planner.ros.messages.plans import duration_seconds
from flex_planner.ros.messages.points import point_message
from flex_planner.ros.messages.times import time_ns
from flex_planner.ros.messages.trajectory_rules import range_violations, trajectory_violations
from flex_planner.ros.runtime.elapsed import ElapsedTime
from flex_planner.ros.runtime.parameters import (
    ARM_PARAMETERS,
    declare,
    declare_arm,
    warn_of_unknown,
)
from flex_planner.ros.runtime.running import run_node
from flex_planner.ros.settings.simulator import SimulatorSettings
from flex_planner.simulation.plant import Plant, RunawayError
from flex_planner.simulation.settling import ArrivalWatch, ResidualVibration
from flex_planner_interfaces.msg import FeedbackGains
from geometry_msgs.msg import PointStamped
import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# in one go, so that messages and signals are served where the machine is too slow
_LONGEST_WORK = 0.05  # [s]
_TOO_LATE = 0.5  # [s]
_WARNING_PERIOD = 5.0  # [s]
_DEPTH = 100  # states at once where the arm catches up
_EARLY = 0.5  # period of the controller
_ROUNDING = 1e-9  # [s]


class ArmSimulator(Node):  # type: ignore[misc]
    """
    A flexible arm in real time, under feedforward torque and joint PD.

    Topics subscribed
    -----------------
    joint_trajectory : trajectory_msgs/msg/JointTrajectory
    feedback_gains : flex_planner_interfaces/msg/FeedbackGains
        With the parameter of that name.

    Topics published
    ----------------
    joint_states : sensor_msgs/msg/JointState
        As measured by the encoders; the torques are those of the motors.
    ~/modal_states : sensor_msgs/msg/JointState
    ~/tip : geometry_msgs/msg/PointStamped
    ~/markers : visualization_msgs/msg/MarkerArray
    /tf : tf2_msgs/msg/TFMessage
        Frames of the links and of the tip, as they are bent, where tf2_msgs is installed.
    ~/residual_vibration, ~/residual_bending : std_msgs/msg/Float64
        Once after each arrival, kept for late subscribers: peak-to-peak motion of the tip, and
        of the deflection of the links where it is largest, over `vibration_window` [m].

    Raises
    ------
    FlexPlannerError
        If a parameter or the arm's file is wrong.

    """

    def __init__(self) -> None:
        super().__init__('arm_simulator')
        warn_of_unknown(self, SimulatorSettings, ARM_PARAMETERS)
        arm = declare_arm(self)
        self._settings = declare(self, SimulatorSettings.for_arm(arm))
        self._arm = self._settings.mismatch.apply(arm)
        self._law: LinearFeedback | None = None
        self._plant, self._passed = self._new_plant(), ElapsedTime()
        self._due = 0.0
        self._watch = ArrivalWatch(self._arm, self._settings.vibration_window)
        self._joints = self.create_publisher(JointState, 'joint_states', _DEPTH)
        self._modes = self.create_publisher(JointState, '~/modal_states', _DEPTH)
        self._tip = self.create_publisher(PointStamped, '~/tip', _DEPTH)
        self._vibration = self.create_publisher(Float64, '~/residual_vibration', _LATCHED)
        self._bending = self.create_publisher(Float64, '~/residual_bending', _LATCHED)
        self._picture = ArmPicture(self, self._arm, self._settings)
        self.create_subscription(JointTrajectory, 'joint_trajectory', self._on_trajectory, 1)
        if self._settings.feedback_gains:
            self.create_subscription(FeedbackGains, 'feedback_gains', self._on_gains, _LATCHED)
        # by a clock that also goes on while a simulation is paused: the arm may have to catch up
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1 / self._settings.publish_rate, self._on_timer, clock=steady)
        if self._settings.picture_rate:
            self.create_timer(1 / self._settings.picture_rate, self._on_picture)
        self.create_timer(_WARNING_PERIOD, self._on_silence, clock=steady)
        self.get_logger().info(f'simulating {self._arm.name}')

    def _new_plant(self) -> Plant:
        settings = self._settings
        plant = Plant(ArmDynamics(self._arm), settings.control,
                      payload_mass=settings.payload_mass,
                      payload_inertia=settings.payload_inertia or self._arm.payload_inertia,
                      positions=np.asarray(settings.initial_positions))
        plant.use_law(self._law)
        return plant

    def _on_gains(self, message: FeedbackGains) -> None:
        """Use the gains that leave least in place of the PD, or the PD where there are none."""
        self._advance()
        try:
            law = law_from_message(message)
            self._plant.use_law(law)
        except (FlexPlannerError, ValueError) as error:
            self.get_logger().error(printable(f'gains refused: {error}'))
            return
        self._law = law
        self.get_logger().info(printable('using gains of feedback' if law is not None else
                                         f'using the PD: {message.message}'))

    def _on_trajectory(self, trajectory: JointTrajectory) -> None:
        """Follow a trajectory, or say why not."""
        self._advance()  # first, so that the motion begins when its trajectory came
        refusal = self._refusal(trajectory)
        if refusal:
            self.get_logger().error(printable(f'trajectory refused: {refusal}'))
            return
        reference, passed = _reference(trajectory, self._settings.joint_names), self._passed_of(
            trajectory)
        if passed < 0:  # led there from where the arm is, as a controller does
            reference = replace(reference, times=reference.times - passed)
        self._plant.follow(reference.after(*self._plant.shown_state, self._plant.torque),
                           max(passed, 0.0))
        self._watch.expect(self._plant.time + reference.times[-1] - max(passed, 0.0))
        self.get_logger().info(f'following a trajectory of {len(trajectory.points)} points')

    def _refusal(self, trajectory: JointTrajectory) -> str:
        """Return the reason why a trajectory cannot be followed, empty if it can."""
        broken = (trajectory_violations(trajectory, self._settings.joint_names, stamped=True)
                  or range_violations(trajectory))
        if broken:
            return '; '.join(broken[:3])
        passed = self._passed_of(trajectory)
        reference = _reference(trajectory, self._settings.joint_names)
        if passed > reference.times[-1]:
            return f'it ended {passed - reference.times[-1]:.3f} s ago by its stamp'
        start, _ = reference.motion(max(passed, float(reference.times[0])))
        distance = float(np.abs(start - self._plant.shown_state[0]).max())
        if distance > self._settings.start_tolerance:
            return (f'it starts {distance:.3f} rad away from the arm, more than start_tolerance '
                    f'= {self._settings.start_tolerance:g} rad')
        return ''

    def _passed_of(self, trajectory: JointTrajectory) -> float:
        """
        Return for how long a trajectory lasts by its stamp, below 0 if it begins later [s].

        By the time of the arm, as its states are stamped, which may be behind the clock.

        """
        stamp = time_ns(trajectory.header.stamp)
        return (time_ns(self._stamp()) - stamp) * 1e-9 if stamp else 0.0

    def _on_timer(self) -> None:
        """Bring the arm up to now."""
        self._advance()

    def _publish_states(self) -> None:
        """Publish the arm as it is."""
        n, n_t = self._arm.n_joints, self._arm.n_coordinates
        state, sensor = self._plant.state, self._plant.sensor
        stamp = self._stamp()
        self._joints.publish(_state_message(
            stamp, self._settings.joint_names, sensor.positions, sensor.speeds,
            self._plant.torque))
        if self._arm.n_passive:
            self._modes.publish(_state_message(
                stamp, self._arm.passive_names, state[n:n_t], state[n_t + n:], np.zeros(0)))
        tip = PointStamped()
        tip.header.stamp, tip.header.frame_id = stamp, self._settings.base_frame
        tip.point = point_message(tip_position(self._arm, state[:n_t]))
        self._tip.publish(tip)

    def _on_picture(self) -> None:
        """Show the arm as it is."""
        self._picture.show(self._plant.state[:self._arm.n_coordinates],
                           self._stamp())

    def _on_silence(self) -> None:
        """Say what the arm waits for, should it be a clock that has not come."""
        clock = self.get_clock()
        if clock.ros_time_is_active and not clock.now().nanoseconds:
            self.get_logger().warning('the arm stands still: use_sim_time is set, but nothing has '
                                      'come on /clock')

    def _stamp(self) -> Time:
        """Return when the arm was as it is: up to a period ago, or more if the machine is slow."""
        now = self.get_clock().now()
        late = self._elapsed_at(now.nanoseconds) - self._plant.time
        late = min(max(late, 0.0), _TOO_LATE)
        return (now - Duration(seconds=min(late, now.nanoseconds * 1e-9))).to_msg()

    def _advance(self) -> None:
        """Bring the arm up to now, or as far as it may go at once."""
        now, plant, limit = self._now(), self._plant, time.monotonic() + _LONGEST_WORK
        try:
            while plant.time + plant.period <= now + _ROUNDING and time.monotonic() < limit:
                plant.advance(plant.time + plant.period, self._see)
        except RunawayError as error:
            self._begin_again(error)
            return
        late = self._now() - plant.time
        if late > _TOO_LATE:
            self.get_logger().warning(
                f'the simulation is {late:.2f} s late: this machine is too slow for '
                f'control_rate = {self._settings.control_rate:g} Hz with '
                f'{self._arm.n_passive} modes: lower one of them',
                throttle_duration_sec=_WARNING_PERIOD)

    def _now(self) -> float:
        """Return the time since the start, or since the arm began again [s]."""
        return self._elapsed_at(self.get_clock().now().nanoseconds)

    def _elapsed_at(self, now_ns: int) -> float:
        """Return that time at a time of the clock [ns]."""
        jump = self._passed.look(now_ns)
        if jump:
            self.get_logger().warning(f'the clock has jumped by {jump:.3f} s: the arm goes on '
                                      'from where it is')
        return self._passed.seconds

    def _begin_again(self, reason: RunawayError) -> None:
        """Put the arm back to where it started."""
        self._plant, self._passed, self._due = self._new_plant(), ElapsedTime(), 0.0
        self._watch.expect(np.inf)
        self.get_logger().error(
            f'{reason}. The arm is at rest at its initial positions again, and follows nothing',
            throttle_duration_sec=_WARNING_PERIOD)

    def _see(self, plant: Plant) -> None:
        """Look at the arm after a period, and publish it at even times of its own."""
        if plant.time >= self._due - _EARLY * plant.period:
            self._publish_states()
            self._due = max(self._due, plant.time - plant.period) + 1 / self._settings.publish_rate
        self._watch.see(plant.time, plant.state)
        residual = self._watch.result(plant.time)
        if residual is not None:
            self._publish_residual(residual)

    def _publish_residual(self, residual: ResidualVibration) -> None:
        """Publish what was left after an arrival."""
        self._vibration.publish(Float64(data=residual.tip))
        self._bending.publish(Float64(data=residual.bending))
        self.get_logger().info(
            f'after the arrival the tip moved by {residual.tip * 1e3:.2g} mm and the links bent '
            f'by {residual.bending * 1e3:.2g} mm, peak to peak')


def _reference(trajectory: JointTrajectory, names: list[str]) -> JointReference:
    """Return a trajectory as arrays, joints in our order."""
    order = [list(trajectory.joint_names).index(name) for name in names]
    points = trajectory.points

    def column(field: str) -> Array:
        return np.array([getattr(point, field) for point in points])[:, order]

    times = [duration_seconds(point.time_from_start) for point in points]
    return JointReference(times=np.array(times), positions=column('positions'),
                          velocities=column('velocities'), accelerations=column('accelerations'),
                          torques=column('effort'))


def _state_message(stamp: Time, names: Sequence[str], positions: Array, velocities: Array,
                   efforts: Array) -> JointState:
    message = JointState(name=list(names), position=positions.tolist(),
                         velocity=velocities.tolist(), effort=efforts.tolist())
    message.header.stamp = stamp
    return message


def main(args: list[str] | None = None) -> None:
    """Run the simulator until a signal ends it."""
    run_node(ArmSimulator, 'arm_simulator', args)


if __name__ == '__main__':
    main()
