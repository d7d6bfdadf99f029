"""The process that streams reference states, as the planner node sees it."""

from __future__ import annotations

from contextlib import suppress
import pickle
import subprocess
import sys
import time

from flex_planner.plan import Plan
from flex_planner.reference import Reference
from flex_planner.ros.settings import PlannerSettings
from flex_planner.ros.streaming import StreamedPlan
from rclpy.node import Node


class Streamer:
    """
    Streams published plans on ``~/reference_states``.

    Parameters
    ----------
    node : Node
        The planner; its clock stamps the states.

    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._process = self._started()

    def wait_until_ready(self) -> None:
        """Wait for the process to be there; it says one word, or ends."""
        output = self._process.stdout
        if output is None or not output.readline():
            self._node.get_logger().error('the process that streams states did not start')

    def start(self, plan: Plan, reference: Reference, settings: PlannerSettings) -> None:
        """Stream a plan from now on, in place of the one before."""
        samples = reference.samples
        streamed = StreamedPlan(
            names=[*settings.joint_names, *plan.arm.modal_names], rate=settings.reference_rate,
            stamp_ns=self._node.get_clock().now().nanoseconds, began_ns=time.monotonic_ns(),
            times_ns=reference.times_ns, coordinates=samples.coordinates,
            rates=samples.rates, accelerations=samples.accelerations, torques=samples.torques)
        self._send(pickle.dumps(streamed))

    def close(self) -> None:
        """Let the process end, which it does by itself when its input does."""
        if self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.close()

    def _send(self, data: bytes) -> None:
        if self._process.poll() is not None:
            self._node.get_logger().warning('the process that streams states ended: again')
            self._process = self._started()
        if self._process.stdin is not None:
            self._process.stdin.write(data)
            self._process.stdin.flush()

    def _started(self) -> subprocess.Popen[bytes]:
        node, topic = self._node, self._node.resolve_topic_name('~/reference_states')
        return subprocess.Popen(
            [sys.executable, '-m', 'flex_planner.ros.streaming', f'{node.get_name()}_states',
             node.get_namespace(), topic], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
