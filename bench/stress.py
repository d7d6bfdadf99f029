"""
Hundreds of requests of all kinds to one planner, and how quickly it answers while it solves.

Run by ``tools/run python -m bench.stress``; takes minutes, and fails if a request stays without
an answer, the node ends, or it keeps on growing.

"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
import sys
import tempfile
import time
from typing import Any

from flex_planner.ros.processes import NodeProcess
from flex_planner_interfaces import action
from flex_planner_interfaces.msg import MotionTask
from flex_planner_interfaces.srv import FindMaxPayload, PlanPath
from geometry_msgs.msg import Point
import numpy as np
from rcl_interfaces.srv import GetParameters
import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future

REQUESTS, SETTLED = 500, 100
PATIENCE = 60.0  # [s]
GROWTH_LIMIT, LATENCY_LIMIT = 5.0, 50.0  # [MB], [ms]
LOOKS = 300
NODE = '/flex_planner'


class Client:
    """Sends requests and waits for what comes back."""

    def __init__(self) -> None:
        self.node = rclpy.create_node('stress')
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        create = self.node.create_client
        self._plan = create(PlanPath, f'{NODE}/plan_path')
        self._search = create(FindMaxPayload, f'{NODE}/find_max_payload')
        self._parameters = create(GetParameters, f'{NODE}/get_parameters')
        self._goals = ActionClient(self.node, action.PlanPath, f'{NODE}/plan_path')
        for service in (self._plan, self._search, self._parameters):
            service.wait_for_service(PATIENCE)
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

    def plan(self, **fields: Any) -> int:
        """Return the code of a plan by the service."""
        request = PlanPath.Request(task=task(**fields))
        return int(self.wait(self._plan.call_async(request)).report.error_code)

    def search(self, **fields: Any) -> int:
        """Return the code of a search for the maximum payload."""
        request = FindMaxPayload.Request(task=task(**fields), payload_accuracy=0.1)
        return int(self.wait(self._search.call_async(request)).report.error_code)

    def goal(self, cancel: bool, **fields: Any) -> int:
        """Return the code of a plan by the action, maybe canceled at once."""
        handle = self.start(**fields)
        if cancel:
            self.wait(handle.cancel_goal_async())
        return int(self.wait(handle.get_result_async()).result.report.error_code)

    def start(self, **fields: Any) -> Any:
        """Return the handle of an accepted goal."""
        return self.wait(self._goals.send_goal_async(action.PlanPath.Goal(task=task(**fields))))

    def latency(self) -> float:
        """Return how long a parameter takes to read [ms]."""
        began = time.monotonic()
        self.wait(self._parameters.call_async(GetParameters.Request(names=['tolerance'])))
        return (time.monotonic() - began) * 1e3


def task(**fields: Any) -> MotionTask:
    """Return the motion of the paper with some fields changed."""
    paper = {'space': MotionTask.CARTESIAN, 'start_point': Point(x=0.5, y=0.0),
             'goal_point': Point(x=0.5, y=0.5), 'elbow': -1, 'duration': 1.0,
             'payload_mass': 1.0, 'effort_weights': [1 / 8, 1 / 8]}
    return MotionTask(**{**paper, **fields})


def memory(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    status = Path(f'/proc/{pid}/status').read_text()
    return int(status.partition('VmRSS:')[2].split()[0]) / 1024


def ask(client: Client, k: int) -> int:
    """Make the kth request, one of ten kinds, and return its code."""
    payload = 0.5 + 1e-3 * k
    kinds = [
        lambda: client.plan(payload_mass=payload, publish=True),
        lambda: client.goal(False, payload_mass=payload),
        lambda: client.goal(True, payload_mass=payload, duration=20.0),
        lambda: client.plan(payload_mass=200.0),
        lambda: client.plan(duration=float('nan')),
        lambda: client.goal(False, goal_point=Point(x=3.0)),
        lambda: client.plan(effort_weights=[1.0] * 100_000),
        lambda: client.search(payload_mass=4.0) if k % 50 < 10 else client.search(space=9),
        lambda: client.plan(allowed_planning_time=1e-3),
        lambda: client.goal(False, payload_mass=payload, publish=True)]
    return kinds[k % len(kinds)]()


def endure(client: Client, process: Any) -> float:
    """Make all requests and return how much the node grew over the last [MB]."""
    codes: Counter[int] = Counter()
    sizes = []
    began = time.monotonic()
    for k in range(REQUESTS):
        codes[ask(client, k)] += 1
        sizes.append(memory(process.pid))
    print(f'{REQUESTS} requests answered in {time.monotonic() - began:.0f} s; codes: '
          f'{dict(sorted(codes.items()))}')
    print(f'memory: {sizes[0]:.1f} MB after the first, {sizes[SETTLED - 1]:.1f} MB after '
          f'{SETTLED}, {sizes[-1]:.1f} MB at the end')
    return float(np.median(sizes[-20:]) - np.median(sizes[SETTLED - 10:SETTLED + 10]))


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


def started(folder: Path, arm: str) -> NodeProcess:
    """Start a planner."""
    return NodeProcess('flex_planner.ros.planner_node',
                       {'arm': arm, 'recording_folder': folder / 'recordings'},
                       log=folder / f'{arm}.log')


def main() -> int:
    """Run both and return the exit code."""
    rclpy.init()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with started(folder, 'korayem_rigid') as node:
            client = Client()
            growth = endure(client, node.process)
            alive = node.process.poll() is None
            client.close()
        with started(folder, 'korayem_ei50') as node:
            client = Client()
            latency = watch(client)
            alive = alive and node.process.poll() is None
            client.close()
    rclpy.try_shutdown()
    print(f'grown by {growth:.1f} MB (limit {GROWTH_LIMIT:g}); alive: {alive}')
    return 0 if alive and growth < GROWTH_LIMIT and latency < LATENCY_LIMIT else 1


if __name__ == '__main__':
    sys.exit(main())
