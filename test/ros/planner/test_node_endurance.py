"""Five hundred requests of all kinds to one planner: each is answered, and it does not grow."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path

from flex_planner_interfaces.msg import PlanReport
from geometry_msgs.msg import Point
import numpy as np
from ros_support import Planner

# a busy machine has one more thread allocate, which costs 12 MB once, within the first hundreds
REQUESTS, SETTLED = 500, 250
GROWTH = 3.0  # [MB], over the second half


def memory(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    status = Path(f'/proc/{pid}/status').read_text()
    return int(status.partition('VmRSS:')[2].split()[0]) / 1024


def kinds(planner: Planner, k: int) -> list[tuple[Callable[[], PlanReport], int]]:
    """Return ten requests for the kth turn, each with the code that it has to be answered with."""
    payload = 0.5 + 1e-3 * k

    def goal(*, cancel: bool = False, **fields: object) -> PlanReport:
        sent = planner.plan_goal(**fields)
        assert not cancel or sent.cancel()
        return sent.end()[1].report

    def search() -> PlanReport:
        fields = {'payload_mass': 4.0} if k % 5 == 0 else {'goal_point': Point(x=0.5, y=9.0)}
        return planner.search(payload_accuracy=0.1, **fields).report

    report = planner.report
    return [
        (lambda: report(payload_mass=payload, publish=True), PlanReport.NONE),
        (lambda: goal(payload_mass=payload), PlanReport.NONE),
        (lambda: goal(cancel=True, payload_mass=payload, duration=100.0), PlanReport.CANCELED),
        (lambda: report(payload_mass=200.0), PlanReport.INFEASIBLE),
        (lambda: report(duration=math.nan), PlanReport.NOT_FINITE),
        (lambda: goal(goal_point=Point(x=3.0)), PlanReport.UNREACHABLE),
        (lambda: report(effort_weights=[1.0] * 100_000), PlanReport.INVALID_SIZE),
        (search, PlanReport.NONE if k % 5 == 0 else PlanReport.UNREACHABLE),
        (lambda: report(allowed_planning_time=1e-3), PlanReport.TIMEOUT),
        (lambda: goal(payload_mass=payload, publish=True), PlanReport.NONE)]


def test_five_hundred_requests_of_all_kinds_are_answered_and_cost_no_memory(
        tmp_path: Path) -> None:
    sizes: list[float] = []
    with Planner(tmp_path, 'korayem_rigid') as planner:
        for k in range(REQUESTS // 10):
            for number, (ask, code) in enumerate(kinds(planner, k)):
                report = ask()
                assert report.error_code == code, (k, number, report.error_msg)
                sizes.append(memory(planner.process.process.pid))
        assert planner.process.process.poll() is None
        # a goal that is canceled before its turn leaves no recording
        recorded = len(list(planner.recordings.glob('*/*.mcap')))
        assert REQUESTS * 9 // 10 <= recorded <= REQUESTS
        assert 'Traceback' not in planner.log()
    # what a planner needs once is there after the first half
    grown = np.median(sizes[-20:]) - np.median(sizes[SETTLED - 10:SETTLED + 10])
    assert grown < GROWTH, sizes[::20]
