"""
A motion over real ROS 2: planned, published, carried out by a simulated arm, recorded.

By default that of Korayem et al. 2009, section 5.2, with links of E I = 50 N m^2. Starts the
planner and the simulator in processes of their own, and asks as any other node would.

"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
import time

from diagnostic_msgs.msg import DiagnosticArray
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.cli.demo_motions import DEFAULT_ARM, demo_motion, DemoMotion
from flex_planner.cli.pictures import drawn
from flex_planner.cli.signals import SIGNALS
from flex_planner.plotting.motion import Execution, Motion
from flex_planner.reports.motion import (
    certificate_rows,
    joint_rows,
    planning_row,
    Row,
    table,
)
from flex_planner.ros.messages.plans import duration_seconds
from flex_planner.ros.messages.points import point_coordinates, point_message
from flex_planner.ros.planner.diagnostics import SUBSCRIBERS
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces.msg import FlexibleTrajectory, MotionTask, PlanReport
from flex_planner_interfaces.srv import PlanPath
from geometry_msgs.msg import PointStamped
import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

PATIENCE = 120.0  # [s], for the first plan, in which much is compiled, on a busy machine
SETTLING = 1.0  # [s], that the simulator watches the arm by default
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class DemoError(FlexPlannerError):
    """The demonstration cannot go on."""


class DemoClient(Node):  # type: ignore[misc]
    """Asks for a plan, and listens to the controller's topic and to the arm."""

    def __init__(self) -> None:
        super().__init__('flex_planner_demo')
        self.arrived: list[tuple[int, JointTrajectory]] = []
        self.states: list[JointState] = []
        self.tips: list[PointStamped] = []
        self.subscribers = 0  # of the trajectory, as the planner sees them
        self.settled: list[Float64] = []
        self.create_subscription(JointTrajectory, '/flex_planner/joint_trajectory',
                                 self._on_trajectory, _LATCHED)
        self.create_subscription(JointState, '/joint_states', self.states.append, 100)
        self.create_subscription(PointStamped, '/arm_simulator/tip', self.tips.append, 100)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        self.create_subscription(Float64, '/arm_simulator/residual_vibration',
                                 self.settled.append, _LATCHED)
        self._planner = self.create_client(PlanPath, '/flex_planner/plan_path')

    def _on_trajectory(self, trajectory: JointTrajectory) -> None:
        self.arrived.append((self.get_clock().now().nanoseconds, trajectory))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            for pair in status.values:
                if pair.key == SUBSCRIBERS:
                    self.subscribers = int(pair.value)

    def wait(self, what: str, done: Callable[[], bool], limit: float) -> None:
        """Spin until something is the case, or raise DemoError after a time [s]."""
        end = time.monotonic() + limit
        while not done():
            if time.monotonic() > end:
                raise DemoError(f'no {what} within {limit:g} s')
            rclpy.spin_once(self, timeout_sec=0.05)

    def wait_for_nodes(self) -> None:
        """Wait for the planner's service, the simulator, and for them to know each other."""
        self.wait('planner', self._planner.service_is_ready, 120)
        self.wait('simulator', lambda: bool(self.states and self.tips), 120)
        # what the planner does not know of yet would miss the trajectory
        self.wait('connection', lambda: self.subscribers >= 2, 60)

    def plan(self, motion: DemoMotion) -> tuple[PlanPath.Response, float]:
        """Ask for a motion; return the answer and the time until it was on the topic [s]."""
        task = _task(motion)
        began = self.get_clock().now().nanoseconds
        future = self._planner.call_async(PlanPath.Request(task=task))
        self.wait('answer', future.done, PATIENCE + 30)
        response = future.result()
        if response.report.error_code != PlanReport.NONE:
            raise DemoError(response.report.error_msg)
        self.wait('trajectory on the topic', lambda: bool(self.arrived), 10)
        return response, (self.arrived[0][0] - began) * 1e-9

    def watch(self, arm: Arm) -> Execution:
        """Follow the arm until it says what was left of its motion, however late it is."""
        began = self.arrived[0][0]
        self.wait('motion', lambda: bool(self.settled), 60)

        def since(message: JointState | PointStamped) -> float:
            stamp = message.header.stamp
            return float(stamp.sec * 10**9 + stamp.nanosec - began) * 1e-9

        states = [state for state in self.states if since(state) >= 0]
        tips = [tip for tip in self.tips if since(tip) >= 0]
        return Execution(
            times=np.array([since(state) for state in states]),
            positions=np.array([state.position for state in states]),
            speeds=np.array([state.velocity for state in states]),
            torques=np.array([state.effort for state in states]),
            tip_times=np.array([since(tip) for tip in tips]),
            tip=np.array([point_coordinates(tip.point, arm) for tip in tips]))


def _task(motion: DemoMotion) -> MotionTask:
    """Return the request of a motion."""
    task = MotionTask(
        space=MotionTask.CARTESIAN_GOAL, start_positions=motion.start_positions,
        goal_point=point_message(np.array(motion.goal)), elbow=motion.ELBOW,
        duration=motion.duration, payload_mass=motion.payload,
        effort_weights=motion.effort_weights, publish=True)
    if motion.start_point:
        task.space = MotionTask.CARTESIAN
        task.start_point = point_message(np.array(motion.start_point))
    return task


def motion_from_message(trajectory: FlexibleTrajectory, arm: Arm) -> Motion:
    """Return a trajectory message as arrays."""
    joints, bending = trajectory.joint_trajectory.points, trajectory.points

    def rows(points: list[object], field: str) -> Array:
        return np.array([list(getattr(point, field)) for point in points])

    times = [duration_seconds(point.time_from_start) for point in joints]
    return Motion(
        arm=arm, times=np.array(times), joint_names=trajectory.joint_trajectory.joint_names,
        coordinates=np.hstack([rows(joints, 'positions'), rows(bending, 'modal_displacements')]),
        rates=np.hstack([rows(joints, 'velocities'), rows(bending, 'modal_rates')]),
        torques=rows(joints, 'effort'),
        tip=np.array([point_coordinates(point, arm) for point in trajectory.tip_path]))


def _table(arm: Arm, motion: DemoMotion, report: PlanReport, delay: float,
           execution: Execution, files: list[Row]) -> str:
    """Return the results of the demonstration, as lines of text."""
    late = execution.tip[execution.tip_times > execution.tip_times[-1] - SETTLING / 2]
    errors = np.linalg.norm(late - motion.goal, axis=1) * 1e3
    planning = duration_seconds(report.planning_time)
    return table([
        ('arm', arm.name),
        ('motion', str(motion)),
        planning_row(planning, report.strategy, f'{report.iterations} iterations',
                     f'{report.mesh_intervals} intervals'),
        *(('warning', sentence) for sentence in report.warnings),
        ('on the topic after', f'{delay:.2f} s'),
        ('cost J', f'{report.cost:.6f}'),
        *joint_rows(report.peak_speeds, report.peak_speed_shares, report.peak_torques,
                    report.peak_torque_shares),
        *certificate_rows(report),
        ('simulated arm, at rest', f'tip error {errors.max():.1e} mm, '
                                   f'vibration {np.ptp(errors):.1e} mm'),
        *files])


def run(folder: Path, name: str = DEFAULT_ARM) -> str:
    """Run the demonstration of a preset, write into a folder, return the table."""
    motion, arm = demo_motion(name), load_arm(name)
    start = motion.initial_positions(arm)
    with ExitStack() as stack:
        with SIGNALS.patient():  # what is begun must be known, to be ended
            stack.enter_context(NodeProcess(
                'flex_planner.ros.planner.node',
                {'arm': name, 'recording_folder': folder / 'recordings',
                 'allowed_planning_time': PATIENCE}))
            stack.enter_context(NodeProcess(
                'flex_planner.ros.arm_simulator',
                {'arm': name, 'payload_mass': motion.payload, 'initial_positions': start.tolist()},
                {'joint_trajectory': '/flex_planner/joint_trajectory'}))
        SIGNALS.check()
        client = DemoClient()
        try:
            client.wait_for_nodes()
            response, delay = client.plan(motion)
            execution = client.watch(arm)
        finally:
            client.destroy_node()

    def draw(path: Path) -> None:
        from flex_planner.plotting import draw_motion, save

        save(draw_motion(motion_from_message(response.trajectory, arm), execution), path)

    with SIGNALS.patient():
        files = [*drawn('picture', folder / 'motion.png', draw),
                 ('recording', response.report.recording), ('output folder', str(folder))]
    return _table(arm, motion, response.report, delay, execution, files)


def demonstrate(folder: Path, arm: str = DEFAULT_ARM) -> None:
    """Run the demonstration, and print the table."""
    # signals are handled by whoever calls
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        print(run(folder, arm))
    finally:
        rclpy.try_shutdown()
