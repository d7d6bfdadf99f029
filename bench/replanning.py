"""
How often a planner plans again over ROS while an arm moves, as one client sees it.

Run by ``tools/run python -m bench replanning``, or by ``-m bench.replanning``, which writes no
page. The figures are those of a machine with nothing else to do.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
import os
from pathlib import Path
import tempfile
import time
from typing import Any

from bench.stress import Client, NODE, PATIENCE, task
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces.msg import MotionTask, PlanReport
from flex_planner_interfaces.srv import PlanPath
from geometry_msgs.msg import Point
import numpy as np
from rcl_interfaces.srv import GetParameters
import rclpy

# arm and rate that is asked for [Hz]
RATES = {'korayem_ei50': 50.0, 'clamped_motors': 20.0}
MOTIONS, DURATION = 4, 2.0
# of a motion, in which its goal moves [s]
CHASE = 1.6
MOST = 0.03  # by which it moves [m]
_TICK = 1 / os.sysconf('SC_CLK_TCK')


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """
    What a client reached that asks again as soon as it may.

    Attributes
    ----------
    arm : str
        Its name.
    recorded : bool
        Whether the node records each request.
    asked, reached : float
        Rate of the requests [Hz].
    planned, requests : int
        How many led to a new plan, of how many.
    cpu : float
        Time of the node per request [ms].
    answers, services : tuple of float
        Median and 95th percentile of the times to the answer, and to that of a parameter service
        that is asked at the same time [ms].

    """

    arm: str
    recorded: bool
    asked: float
    reached: float
    planned: int
    requests: int
    cpu: float
    answers: tuple[float, float]
    services: tuple[float, float]


class Chaser(Client):
    """Moves the goal of an arm on its way."""

    def __init__(self, pid: int, seed: int = 0) -> None:
        super().__init__()
        self._pid = pid
        self._plans = self.node.create_client(PlanPath, f'{NODE}/plan_path')
        self._plans.wait_for_service(PATIENCE)
        self._random = np.random.default_rng(seed)
        self.forget()

    def forget(self) -> None:
        """Begin to measure."""
        self.answers: list[float] = []
        self.services: list[float] = []
        self.codes: list[int] = []
        self.chased = self.spent = 0.0  # [s], of time, and of CPU time of the node

    def chase(self, rate: float) -> None:
        """Plan a motion, and again at a rate [Hz] while it goes on."""
        report = self._ask(task(duration=DURATION, publish=True))
        assert report.error_code == PlanReport.NONE, report.error_msg
        goal, began, due = np.array([0.5, 0.5]), time.monotonic(), time.monotonic()
        spent = _cpu_seconds(self._pid)
        while due < began + CHASE:
            place = goal + self._random.uniform(-MOST, MOST, 2)
            sent = time.monotonic()
            again = self._ask(MotionTask(
                replaces=report.plan_id, space=MotionTask.CARTESIAN_GOAL, publish=True,
                goal_point=Point(x=place[0], y=place[1])), looks=True)
            self.answers.append(time.monotonic() - sent)
            self.codes.append(again.error_code)
            report = again if again.error_code == PlanReport.NONE else report
            due = max(due + 1 / rate, time.monotonic())
            self._idle(due)
        self.chased += time.monotonic() - began
        self._idle(began + DURATION + 0.1)  # what is left to record is written by then
        self.spent += _cpu_seconds(self._pid) - spent

    def _ask(self, message: MotionTask, looks: bool = False) -> PlanReport:
        """Return the report of a plan; with `looks`, read a parameter meanwhile."""
        plan = self._plans.call_async(PlanPath.Request(task=message))
        if looks:
            began = time.monotonic()
            self._parameters.call_async(GetParameters.Request(names=['tolerance'])
                                        ).add_done_callback(
                lambda _: self.services.append(time.monotonic() - began))
        report: PlanReport = self.wait(plan).report
        return report

    def _idle(self, until: float) -> None:
        """Wait until a time of the monotonic clock [s]."""
        time.sleep(max(0.0, until - time.monotonic()))


def measure(arm: str, recorded: bool, motions: int = MOTIONS) -> Rate:
    """Return the rate that is reached with an arm."""
    with tempfile.TemporaryDirectory() as name, NodeProcess(
            'flex_planner.ros.planner.node',
            {'arm': arm, 'record': recorded, 'recording_folder': f'{name}/recordings'},
            log=Path(name, 'planner.log')) as node:
        client, asked = Chaser(node.process.pid), RATES[arm]
        client.chase(asked)  # functions are loaded by then
        client.forget()
        for _ in range(motions):
            client.chase(asked)
        count = len(client.codes)
        client.close()
    return Rate(arm=arm, recorded=recorded, asked=asked, reached=count / client.chased,
                planned=client.codes.count(PlanReport.NONE), requests=count,
                cpu=client.spent / count * 1e3, answers=_spread(client.answers),
                services=_spread(client.services))


def _cpu_seconds(pid: int) -> float:
    """Return the CPU time that a process has taken [s]."""
    fields = Path('/proc', str(pid), 'stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) * _TICK


def _spread(seconds: list[float]) -> tuple[float, float]:
    """Return median and 95th percentile [ms]."""
    middle, most = np.percentile(seconds, [50, 95]) * 1e3
    return float(middle), float(most)


def measure_all() -> list[dict[str, Any]]:
    """Return the rates of all arms, with recordings and without."""
    rclpy.init()
    rows = [asdict(measure(arm, recorded)) for arm in RATES for recorded in (False, True)]
    rclpy.try_shutdown()
    return rows


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the rates as Markdown."""
    head = ['| arm | recorded | asked | reached | planned | CPU | answer: median, 95 % '
            '| service: median, 95 % |', '|---|---|---|---|---|---|---|---|']
    return '\n'.join([*head, *(
        f'| `{row["arm"]}` | {"yes" if row["recorded"] else "no"} | {row["asked"]:.0f} Hz '
        f'| {row["reached"]:.0f} Hz | {row["planned"]} of {row["requests"]} | {row["cpu"]:.1f} '
        f'| {row["answers"][0]:.1f}, {row["answers"][1]:.1f} '
        f'| {row["services"][0]:.1f}, {row["services"][1]:.1f} |' for row in rows)])


if __name__ == '__main__':
    print(table(measure_all()))
