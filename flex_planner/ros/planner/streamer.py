"""The process that streams reference states, as the planner node sees it."""

from __future__ import annotations

from contextlib import suppress
import pickle
import signal
import subprocess
import sys
import time

from flex_planner.base.processes import deaf_to_interrupts
from flex_planner.planning.plan import Plan
from flex_planner.ros.planner.running_plan import Track
from flex_planner.ros.reference_states import StreamedPlan
from flex_planner.ros.settings.planner import PlannerSettings
from rclpy.node import Node


class Streamer:
    """
    Streams published plans on ``~/reference_states``.

    A process that died is started again with the next plan; what was left of the one that it
    streamed is lost.

    Parameters
    ----------
    node : Node
        The planner; its clock stamps the states.

    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._process = self._start_process()

    def wait_until_ready(self) -> None:
        """Wait until the process has started; it says one word, or ends."""
        output = self._process.stdout
        if output is None or not output.readline():
            self._node.get_logger().error('the process that streams states did not start')

    def start(self, plan: Plan, track: Track, settings: PlannerSettings) -> None:
        """Stream a plan from now on, in place of the one before; that it fails is logged."""
        now_ns, monotonic_ns = self._node.get_clock().now().nanoseconds, time.monotonic_ns()
        # until a motion begins that begins later, its start is streamed
        wait_ns = max(track.begin_ns - now_ns, 0)
        begin_ns = track.begin_ns - wait_ns
        streamed = StreamedPlan(
            names=[*settings.joint_names, *plan.arm.passive_names], rate=settings.reference_rate,
            stamp_ns=begin_ns, began_ns=monotonic_ns - (now_ns - begin_ns),
            by_clock=self._node.get_clock().ros_time_is_active,
            times_ns=track.times_ns + wait_ns, coordinates=track.coordinates,
            rates=track.rates, accelerations=track.accelerations, torques=track.torques)
        try:
            self._send(pickle.dumps(streamed))
        except OSError as error:  # the plan is good all the same, and published
            self._node.get_logger().error(f'the plan is not streamed: {error}')

    @property
    def failure(self) -> str:
        """Return the reason why nothing can be streamed, empty while the process runs."""
        code = self._process.poll()
        return '' if code is None else (
            f'the process that streams ~/reference_states {_end(code)}; it is started again with '
            'the next plan that is published')

    def close(self) -> None:
        """Let the process end, which it does by itself when its input does."""
        for stream in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                if stream is not None:
                    stream.close()

    def _send(self, data: bytes) -> None:
        if self._process.poll() is None:
            with suppress(BrokenPipeError):  # it dies just now
                self._write(data)
                return
        self._node.get_logger().warning(
            'the process that streams ~/reference_states has ended: starting it again')
        self.close()
        self._process = self._start_process()
        self._write(data)

    def _write(self, data: bytes) -> None:
        if self._process.stdin is not None:
            self._process.stdin.write(data)
            self._process.stdin.flush()

    def _start_process(self) -> subprocess.Popen[bytes]:
        node, topic = self._node, self._node.resolve_topic_name('~/reference_states')
        with deaf_to_interrupts():
            return subprocess.Popen(
                [sys.executable, '-m', 'flex_planner.ros.reference_states',
                 f'{node.get_name()}_states', node.get_namespace(), topic,
                 *(['by_clock'] if node.get_clock().ros_time_is_active else [])],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE)


def _end(code: int) -> str:
    """Return the end of a process in words, from its exit code."""
    if code >= 0:
        return f'has ended with code {code}'
    with suppress(ValueError):
        return f'was ended by {signal.Signals(-code).name}'
    return f'was ended by signal {-code}'
