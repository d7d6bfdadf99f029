"""
Your own URDF over ROS: a robot_description, a planner and a simulated arm that take it, a motion.

As robot_state_publisher does, this publishes `urdf/two_tubes.urdf`. `urdf/two_tubes.yaml` tells
both nodes what bends. The arm then moves its tip to a point in space.

    tools/run python examples/urdf_over_ros.py

"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import signal
import subprocess
import time

from flex_planner_interfaces.msg import MotionTask, PlanReport
from flex_planner_interfaces.srv import PlanPath
from geometry_msgs.msg import Point, PointStamped
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String

FOLDER, SPACE = Path(__file__).resolve().parent / 'urdf', '/tubes'
START = [0.0, -0.3, 0.9]  # [rad]
TASK = MotionTask(
    space=MotionTask.CARTESIAN_GOAL, start_positions=START, duration=0.8, payload_mass=0.3,
    goal_point=Point(x=0.5, y=1.2, z=0.9), publish=True)
GIVEN = ['-r', f'__ns:={SPACE}', '-p', f'arm:={FOLDER}/two_tubes.yaml',
         '-p', 'robot_description_topic:=robot_description']
NODES = [
    ['planner', '--ros-args', *GIVEN, '-p', 'search:=fast', '-p', 'allowed_planning_time:=90.0'],
    ['arm_simulator', '--ros-args', *GIVEN, '-p', f'payload_mass:={TASK.payload_mass}',
     '-p', f'initial_positions:={START}', '-r', 'joint_trajectory:=flex_planner/joint_trajectory']]
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def main() -> None:
    """Start the nodes, plan, watch the arm."""
    node = rclpy.create_node('urdf_over_ros', namespace=SPACE)
    description = node.create_publisher(String, 'robot_description', LATCHED)
    description.publish(String(data=(FOLDER / 'two_tubes.urdf').read_text()))
    states, tips, settled = list[JointState](), list[PointStamped](), list[Float64]()
    node.create_subscription(JointState, 'joint_states', states.append, 10)
    node.create_subscription(PointStamped, 'arm_simulator/tip', tips.append, 10)
    node.create_subscription(Float64, 'arm_simulator/residual_vibration', settled.append, LATCHED)
    planner = node.create_client(PlanPath, 'flex_planner/plan_path')

    def wait(what: str, done: Callable[[], bool]) -> None:
        end = time.monotonic() + 120.0  # [s]; what was never compiled takes long
        while not done():
            rclpy.spin_once(node, timeout_sec=0.1)
            assert time.monotonic() < end, f'no {what}'

    started = [subprocess.Popen(command) for command in NODES]
    try:
        wait('planner', planner.service_is_ready)
        wait('arm', lambda: bool(states and node.count_subscribers(
            f'{SPACE}/flex_planner/joint_trajectory')))
        print(f'joints: {", ".join(states[-1].name)}')
        wait('answer', (answer := planner.call_async(PlanPath.Request(task=TASK))).done)
        report = answer.result().report
        assert report.error_code == PlanReport.NONE, report.error_msg
        print(f'J = {report.cost:.4g}, recorded in {report.recording}')
        wait('arrival', lambda: bool(settled))
        tip = tips[-1].point
        print(f'the tip is at ({tip.x:.3f}, {tip.y:.3f}, {tip.z:.3f}) m', flush=True)
    finally:
        for process in started:
            process.send_signal(signal.SIGINT)
            process.wait()


if __name__ == '__main__':
    rclpy.init()
    main()
    rclpy.shutdown()
