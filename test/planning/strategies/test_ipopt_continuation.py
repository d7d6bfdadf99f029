"""The largest payload of links that bend at their ends: found, certified, and stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from types import SimpleNamespace
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.progress import Monitor, StopReason
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.collocation import Solver, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectProblem
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.strategies.ipopt_continuation import continue_by_ipopt
import numpy as np
from plan_checks import problem_of, tip_miss
import pytest

TaskFactory = Callable[..., Task]

# by Newton's method at a rising price: this much is carried, and no more of this kind. IPOPT says
# 5.68735 with nodes on the switches, and scatters by 4e-3 on equal intervals, which miss them
CARRIED, TOO_MUCH = 5.68735, 5.68795
ACCURACY = 1e-3


@pytest.fixture(scope='module')
def problem(single_mode_arm: Arm, paper_task: TaskFactory) -> MotionProblem:
    link = replace(single_mode_arm.links[0], mode_family='clamped_free')
    arm = replace(single_mode_arm, name='clamped', links=(link, link))
    return problem_of(ArmModel(arm), paper_task(arm, payload_mass=0.0))


def test_clamped_arm_carries_what_direct_collocation_says(problem: MotionProblem) -> None:
    found = find_max_payload(problem.task, model=problem.model, accuracy=ACCURACY, search='fast',
                             monitor=Monitor(time_limit=120))
    assert found.solved, found.message
    assert CARRIED - ACCURACY < found.payload < TOO_MUCH
    assert CARRIED < found.local_upper <= found.payload + ACCURACY
    # an estimate, which the words say, too
    assert found.within_limits and 'seem possible' in found.message
    assert found.plan is not None
    assert found.plan.certificate.tip_error <= 1e-6
    assert tip_miss(found.plan) <= 1e-6


def test_ipopt_leads_to_heavier_and_heavier_payloads(problem: MotionProblem) -> None:
    extremals = list(islice(continue_by_ipopt(problem, 300.0, Solver(), lambda value: ACCURACY),
                            2))
    assert [one.result.converged for one in extremals] == [True, True]
    payloads = [one.value for one in extremals]
    efforts = [integrate_totals(one.problem, one.result.solution).cost for one in extremals]
    assert 5.5 < payloads[0] < payloads[1] < TOO_MUCH
    # the price is what effort rises by: the more, the heavier the payload
    assert extremals[0].price < np.diff(efforts) / np.diff(payloads) < extremals[1].price
    assert CARRIED < payloads[1] + extremals[1].gap


class Watched(Monitor):
    """Counts the iterations that come after it has first said that the work shall stop."""

    told: int | None = None

    def stop_reason(self) -> StopReason | None:
        reason = super().stop_reason()
        if reason and self.told is None:
            self.told = self.iteration
        return reason

    @property
    def late(self) -> int:
        assert self.told is not None, 'it never said so'
        return self.iteration - self.told


@pytest.mark.parametrize('limit', [0.0, 0.5])
def test_search_stops_in_time(problem: MotionProblem, limit: float) -> None:
    monitor = Watched(time_limit=limit)
    extremals = list(continue_by_ipopt(problem, 300.0, Solver(monitor=monitor), lambda value: 0.0))
    assert extremals[-1].result.status is SolverStatus.TIMEOUT
    assert monitor.late == 0


@pytest.mark.parametrize('iterations', [0, 1, 40, 120])
def test_search_for_the_largest_payload_can_be_cancelled(problem: MotionProblem,
                                                         iterations: int) -> None:
    monitor = Watched()
    monitor.canceled = lambda: monitor.iteration >= iterations
    found = find_max_payload(problem.task, model=problem.model, monitor=monitor)
    assert found.status is PlanStatus.CANCELED
    assert not found.payload
    assert monitor.late == 0


@pytest.mark.parametrize('payload', [1e7, 1e5])
def test_absurd_payload_of_an_iterate_ends_the_continuation_and_raises_nothing(
        monkeypatch: pytest.MonkeyPatch, payload: float) -> None:
    # 1e7 kg are more than a task may have, and 1e5 kg more than the links bear
    link = Link(length=1.0, linear_density=1.0, flexural_rigidity=40.0, modes=1,
                mode_family='clamped_free')
    arm = Arm(name='weak', links=(link,), joints=(Joint(motor=Motor(stall_torque=8.0)),),
              gravity=[0.0, -9.81])
    problem = problem_of(ArmModel.of(arm), Task(arm=arm, start_positions=[-1.5],
                                                goal_positions=[-0.5], duration=1.0))
    asked: list[float] = []

    def solve(direct: DirectProblem, *data: Any, **options: Any) -> SimpleNamespace:
        asked.append(options['price'])
        return SimpleNamespace(payload=payload, duration=1.0)

    monkeypatch.setattr(DirectProblem, 'solve', solve)
    assert list(continue_by_ipopt(problem, 1.0, Solver(), lambda value: 0.0)) == []
    assert len(asked) == 1
