"""
How quickly a planner answers, reports, streams and stops while it solves.

Run by ``tools/run python -m bench.stress`` on an idle machine; fails if one of these takes too
long, or the node ends. Tests assert no times: that five hundred requests of all kinds are answered
is tested in ``test/ros/planner/test_node_endurance.py``.

"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import sys
import tempfile
import time
from typing import Any

from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces import action
from flex_planner_interfaces.msg import MotionTask
from geometry_msgs.msg import Point
import numpy as np
from rcl_interfaces.srv import GetParameters
import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from sensor_msgs.msg import JointState

PATIENCE = 60.0  # [s]
LOOKS, CANCELLATIONS, STATES = 300, 10, 201
LONG: dict[str, Any] = {'duration': 100.0, 'allowed_planning_time': 20.0}
# [ms]; states may miss their times by the last
LATENCY, CANCELING, FEEDBACK, LEAVING, MEDIAN_ERROR = 50.0, 1000.0, 500.0, 2000.0, 1.0
NODE = '/flex_planner'


class Client:
    """Sends requests and waits for the answers."""

    def __init__(self) -> None:
        self.node = rclpy.create_node('stress')
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._parameters = self.node.create_client(GetParameters, f'{NODE}/get_parameters')
        self._goals = ActionClient(self.node, action.PlanPath, f'{NODE}/plan_path')
        self._parameters.wait_for_service(PATIENCE)
        self._goals.wait_for_server(PATIENCE)

    def close(self) -> None:
        """Leave ROS."""
        self._executor.shutdown()
        self._goals.destroy()
        self.node.destroy_node()

    def wait(self, future: Future) -> Any:
        """Return a result, or raise TimeoutError."""
        # spin_until_future_complete() leaves tasks behind while a goal runs, and after some
        # hundred calls this client, not the node, takes tens of milliseconds
        self.spin_until(future.done)
        return future.result()

    def start(self, feedback: Callable[[Any], None] | None = None, **fields: Any) -> Any:
        """Return the handle of an accepted goal."""
        return self.wait(self._goals.send_goal_async(
            action.PlanPath.Goal(task=task(**fields)), feedback_callback=feedback))

    def stop(self, handle: Any) -> None:
        """Cancel a goal and wait for its end."""
        result = handle.get_result_async()
        self.wait(handle.cancel_goal_async())
        self.wait(result)

    def spin_until(self, done: Callable[[], bool]) -> None:
        """Receive until something is the case, or raise TimeoutError."""
        end = time.monotonic() + PATIENCE
        while not done():
            if time.monotonic() > end:
                raise TimeoutError(f'not within {PATIENCE:g} s')
            self._executor.spin_once(timeout_sec=0.1)

    def latency(self) -> float:
        """Return the time to read a parameter [ms]."""
        began = time.monotonic()
        self.wait(self._parameters.call_async(GetParameters.Request(names=['tolerance'])))
        return (time.monotonic() - began) * 1e3


def task(**fields: Any) -> MotionTask:
    """Return the motion of the paper with some fields changed."""
    paper = {'space': MotionTask.CARTESIAN, 'start_point': Point(x=0.5, y=0.0),
             'goal_point': Point(x=0.5, y=0.5), 'elbow': -1, 'duration': 1.0,
             'payload_mass': 1.0, 'effort_weights': [1 / 8, 1 / 8]}
    return MotionTask(**{**paper, **fields})


def watch(client: Client) -> float:
    """Return the 99th percentile of the latency of parameters while a plan is made [ms]."""
    client.latency()
    times: list[float] = []
    while len(times) < LOOKS:
        handle = client.start(**LONG)
        result = handle.get_result_async()
        while not result.done() and len(times) < LOOKS:
            times.append(client.latency())
            time.sleep(0.01)
        client.wait(handle.cancel_goal_async())
        client.wait(result)
    middle, most = np.percentile(times, [50, 99])
    print(f'parameters while solving: median {middle:.1f} ms, 99 % within {most:.1f} ms, '
          f'longest {max(times):.1f} ms')
    return float(most)


def canceling(client: Client) -> float:
    """Return how long the slowest of some cancellations takes to the end of its goal [ms]."""
    times = []
    for _ in range(CANCELLATIONS):
        handle = client.start(**LONG)
        time.sleep(0.4)
        began = time.monotonic()
        client.stop(handle)
        times.append((time.monotonic() - began) * 1e3)
    print(f'cancellation: shortest {min(times):.0f} ms, longest {max(times):.0f} ms')
    return max(times)


def feedback_gap(client: Client) -> float:
    """Return the longest time between two messages of feedback [ms]."""
    heard: list[float] = []
    handle = client.start(lambda _: heard.append(time.monotonic()), **LONG)
    client.spin_until(lambda: len(heard) >= 11)
    client.stop(handle)
    gaps = np.diff(heard) * 1e3
    print(f'feedback: every {np.median(gaps):.0f} ms, longest pause {max(gaps):.0f} ms')
    return float(max(gaps))


def stream_error(client: Client) -> float:
    """Return by how much a period of the streamed states is wrong in the median [ms]."""
    published: list[int] = []
    client.node.create_subscription(
        JointState, f'{NODE}/reference_states',
        lambda _, info: published.append(info['source_timestamp']), 1000)
    client.spin_until(lambda: client.node.count_publishers(f'{NODE}/reference_states') == 1)
    time.sleep(1.0)  # that the publisher knows of the subscription shows in nothing
    client.wait(client.start(duration=2.0, publish=True).get_result_async())
    handle = client.start(**LONG)
    client.spin_until(lambda: len(published) >= STATES)
    client.stop(handle)
    errors = np.abs(np.diff(published[:STATES - 1]) * 1e-6 - 10)
    middle, most = np.percentile(errors, [50, 99])
    print(f'states while solving: periods of 10 ms wrong by {middle:.2f} ms in the median, '
          f'99 % within {most:.2f} ms')
    return float(middle)


def leaving(client: Client, node: NodeProcess) -> float:
    """Return how long a node takes to leave that is at work [ms]; infinity if it fails."""
    client.start(**LONG)
    time.sleep(0.4)
    began = time.monotonic()
    code = node.stop()
    taken = (time.monotonic() - began) * 1e3
    print(f'interrupt while solving: exit code {code} after {taken:.0f} ms')
    return taken if code == 0 else float('inf')


def main() -> int:
    """Measure and return the exit code."""
    rclpy.init()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with NodeProcess('flex_planner.ros.planner.node',
                         {'arm': 'korayem_ei50', 'recording_folder': folder / 'recordings'},
                         log=folder / 'planner.log') as node:
            client = Client()
            good = [watch(client) < LATENCY, canceling(client) < CANCELING,
                    feedback_gap(client) < FEEDBACK, stream_error(client) < MEDIAN_ERROR,
                    leaving(client, node) < LEAVING]
            client.close()
    rclpy.try_shutdown()
    return 0 if all(good) else 1


if __name__ == '__main__':
    sys.exit(main())
