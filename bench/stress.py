"""
Response times of a planner while it solves.

Run by ``tools/run python -m bench.stress``; fails if parameters take too long, or the node ends.
``test/ros/planner/test_node_endurance.py`` tests that five hundred requests are all answered.

"""

from __future__ import annotations

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

PATIENCE = 60.0  # [s]
LATENCY_LIMIT = 50.0  # [ms]
LOOKS = 300
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
        end = time.monotonic() + PATIENCE
        while not future.done():
            if time.monotonic() > end:
                raise TimeoutError(f'no answer within {PATIENCE:g} s')
            self._executor.spin_once(timeout_sec=0.1)
        return future.result()

    def start(self, **fields: Any) -> Any:
        """Return the handle of an accepted goal."""
        return self.wait(self._goals.send_goal_async(action.PlanPath.Goal(task=task(**fields))))

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
        handle = client.start(duration=100.0, allowed_planning_time=20.0)
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


def main() -> int:
    """Measure and return the exit code."""
    rclpy.init()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with NodeProcess('flex_planner.ros.planner.node',
                         {'arm': 'korayem_ei50', 'recording_folder': folder / 'recordings'},
                         log=folder / 'planner.log') as node:
            client = Client()
            latency = watch(client)
            alive = node.process.poll() is None
            client.close()
    rclpy.try_shutdown()
    print(f'alive: {alive}')
    return 0 if alive and latency < LATENCY_LIMIT else 1


if __name__ == '__main__':
    sys.exit(main())
