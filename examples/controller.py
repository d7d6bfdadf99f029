r"""
Follow a plan as a joint controller does: the planned torque, and PD for the remaining error.

The node compares what the planner streams on ~/reference_states with /joint_states, and publishes
torques as a JointGroupEffortController takes them. The plan on ~/joint_trajectory names the joints
and their last state, with which this example ends; a real controller goes on to hold it. The
simulated arm only lends its measurements: it has a controller of its own. In four terminals:

    tools/run planner --ros-args --params-file config/paper.yaml
    tools/run arm_simulator --ros-args --params-file config/paper.yaml \
        -r joint_trajectory:=/flex_planner/joint_trajectory
    tools/run python examples/controller.py
    tools/run python examples/call_the_node.py    # asks for a plan

"""

from __future__ import annotations

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

STIFFNESS, DAMPING = 100.0, 10.0  # [N m/rad], [N m s/rad]
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Controller(Node):
    """Feedforward and PD at the rate of the measurements."""

    def __init__(self) -> None:
        super().__init__('controller')
        self.done = False
        self._plan: JointTrajectory | None = None
        self._reference: JointState | None = None
        self._errors, self._shares = [0.0], [0.0]
        self._commands = self.create_publisher(Float64MultiArray, '~/commands', 10)
        self.create_subscription(JointTrajectory, '/flex_planner/joint_trajectory',
                                 self._on_plan, LATCHED)
        self.create_subscription(JointState, '/flex_planner/reference_states',
                                 self._on_reference, 10)
        self.create_subscription(JointState, '/joint_states', self._on_measurement, 10)

    def _on_plan(self, plan: JointTrajectory) -> None:
        self._plan = plan

    def _on_reference(self, reference: JointState) -> None:
        self._reference = reference  # the joints come first, then the bending of the links

    def _on_measurement(self, measured: JointState) -> None:
        """Command a torque for a measurement."""
        plan, now = self._plan, self._reference
        if plan is None or now is None:
            return
        n = len(plan.joint_names)
        order = [list(measured.name).index(name) for name in plan.joint_names]
        error = np.array(now.position[:n]) - np.array(measured.position)[order]
        slip = np.array(now.velocity[:n]) - np.array(measured.velocity)[order]
        feedback = STIFFNESS * error + DAMPING * slip
        torque = np.array(now.effort[:n]) + feedback
        self._commands.publish(Float64MultiArray(data=torque.tolist()))
        self._errors.append(float(np.abs(error).max()))
        self._shares.append(float(np.abs(feedback).max()))
        self.done = list(now.position[:n]) == list(plan.points[-1].positions)

    def summary(self) -> str:
        """Return the largest errors of the motion."""
        return f'followed: at most {max(self._errors):.4f} rad off, PD {max(self._shares):.2f} N m'


if __name__ == '__main__':
    rclpy.init()
    controller = Controller()
    while not controller.done:
        rclpy.spin_once(controller)
    print(controller.summary())
    rclpy.shutdown()
