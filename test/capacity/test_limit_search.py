"""The search along a price: where it starts, how it plans at the limit, and how it is stopped."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

from factories import SearchFactory, TaskFactory
from flex_planner.base.progress import Monitor, Progress
from flex_planner.base.validation import Array
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import postures_from_points
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.first_extremals import approach_limit
from flex_planner.planning.strategies.free_parameters import PAYLOAD
from known_limits import HEAVIEST
import numpy as np
from payload_searches import assert_stopped, assert_stopped_at, followed, moments, stopped_after
from plan_checks import solution_of
import pytest

# Started from a similar task


def test_search_from_a_similar_one_needs_fewer_iterations(
        rigid_model: ArmModel, paper_task: TaskFactory, search_of: SearchFactory) -> None:
    task = paper_task(rigid_model.arm, duration=1.1)
    cold = followed(task, model=rigid_model)
    warm = followed(task, model=rigid_model, start_from=search_of('rigid'))
    assert warm.solved, warm.message
    assert warm.iterations < 0.9 * cold.iterations
    # the same limit is in both
    assert max(cold.payload, warm.payload) <= min(cold.local_upper, warm.local_upper)


def test_search_of_the_rigid_arm_is_a_start_for_one_that_bends(
        ei5_model: ArmModel, paper_task: TaskFactory, search_of: SearchFactory) -> None:
    found = find_max_payload(paper_task(ei5_model.arm), model=ei5_model,
                             start_from=search_of('rigid'))
    assert found.payload <= HEAVIEST['ei5'] <= found.local_upper


def test_search_of_an_arm_that_bends_is_a_start_for_a_rigid_one(
        rigid_model: ArmModel, paper_task: TaskFactory, search_of: SearchFactory) -> None:
    found = find_max_payload(paper_task(rigid_model.arm), model=rigid_model,
                             start_from=search_of('ei5'))
    assert found.payload <= HEAVIEST['rigid'] <= found.local_upper


def test_search_that_found_nothing_is_no_start_but_no_harm(rigid_model: ArmModel,
                                                           paper_task: TaskFactory) -> None:
    nothing = followed(paper_task(rigid_model.arm), model=rigid_model,
                       monitor=Monitor(time_limit=0.0))
    task = paper_task(rigid_model.arm)
    found = followed(task, model=rigid_model, start_from=nothing)
    assert nothing.restart_point is None
    assert found.iterations == followed(task, model=rigid_model).iterations


# Ended


@pytest.mark.parametrize(('goal', 'payload'), [
    ((0.077, -0.128), 9.83847), ((0.179, -0.077), 13.16864), ((-0.436, 0.641), 0.32899)])
def test_limit_that_is_not_met_by_its_payload_is_met_by_its_price(
        rigid_model: ArmModel, paper_task: TaskFactory, goal: tuple[float, float],
        payload: float) -> None:
    start, there = postures_from_points(rigid_model.arm, (0.5, 0.0), goal, elbow=-1)
    task = paper_task(rigid_model.arm, 0.0, start_positions=start, goal_positions=there)
    found = followed(task, model=rigid_model)
    assert found.solved, found.message
    assert found.payload == pytest.approx(payload, abs=1e-3)
    assert found.payload <= found.local_upper <= found.payload + 1e-3
    assert found.plan is not None
    assert found.plan.certificate.tip_error < 1e-5


def test_effort_of_light_payloads_that_is_not_convex_does_not_end_the_search(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    start, goal = postures_from_points(rigid_model.arm, (0.5, 0.0), (0.9, -0.231), elbow=-1)
    task = paper_task(rigid_model.arm, 0.0, start_positions=start, goal_positions=goal)
    found = followed(task, model=rigid_model)
    problem = MotionProblem(rigid_model, task, task_parameters(task))
    first, second = islice(approach_limit(PAYLOAD, problem, Solver().coarse()), 1, 3)
    assert second.price < first.price  # more payload costs less, at first
    heavy = followed(replace(task, payload_mass=3.0), model=rigid_model)
    assert found.payload == pytest.approx(heavy.payload, abs=1e-3)


def test_plan_of_a_search_is_a_plan_like_others(rigid_model: ArmModel, paper_task: TaskFactory,
                                                search_of: SearchFactory) -> None:
    plan = search_of('rigid').plan
    assert plan is not None
    again = plan_path(plan.task, model=rigid_model, start_from=plan)
    assert again.solved
    assert again.cost == pytest.approx(plan.cost, rel=1e-6)
    last: Array = solution_of(plan).nodes[-1, :4]
    np.testing.assert_allclose(last, plan.problem.goal, atol=1e-12)


# Progress, and stopped


def test_direct_search_reports_phases_and_payloads(rigid_model: ArmModel,
                                                   paper_task: TaskFactory) -> None:
    reports: list[Progress] = []
    found = followed(paper_task(rigid_model.arm), model=rigid_model,
                     monitor=Monitor(report=reports.append))
    assert list(dict.fromkeys(each.phase for each in reports)) == ['payload at a rising price',
                                                                   'continuation to the limit']
    assert [each.iteration for each in reports] == list(range(1, found.iterations + 1))
    payloads = [each.payload for each in reports]
    assert payloads == sorted(payloads)
    assert {one.value for one in found.extremals[:-1]} <= set(payloads)
    assert found.planning_time > 0


def test_searches_that_share_a_monitor_count_for_themselves(rigid_model: ArmModel,
                                                            paper_task: TaskFactory) -> None:
    monitor = Monitor()
    first, second = (followed(paper_task(rigid_model.arm), model=rigid_model, monitor=monitor)
                     for _ in range(2))
    assert first.iterations == second.iterations > 0
    assert monitor.iteration == 2 * first.iterations


def test_search_over_kinds_reports_its_starts_first(rigid_model: ArmModel,
                                                    paper_task: TaskFactory) -> None:
    reports: list[Progress] = []
    found = find_max_payload(paper_task(rigid_model.arm), model=rigid_model,
                             monitor=Monitor(report=reports.append))
    phases = list(dict.fromkeys(each.phase for each in reports))
    assert phases == [*(f'kinds of motion, start {i} of 16' for i in range(1, 17)),
                      'payload at a rising price', 'continuation to the limit']
    assert [each.iteration for each in reports] == list(range(1, found.iterations + 1))
    assert (found.starts, len(found.kinds)) == (16, 1)


def test_direct_search_is_stopped_wherever_it_is(rigid_model: ArmModel,
                                                 paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm)
    assert_stopped_at(
        lambda monitor: followed(task, model=rigid_model, monitor=monitor),
        {('payload at a rising price', False): False, ('continuation to the limit', False): True,
         ('continuation to the limit', True): True})


def test_search_over_kinds_is_stopped_wherever_it_is(rigid_model: ArmModel,
                                                     paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm)
    assert_stopped_at(
        lambda monitor: find_max_payload(task, model=rigid_model, monitor=monitor),
        # nothing is met yet, but the payload of the task is planned in the time of grace
        {('kinds of motion, start 7 of 16', False): True,
         ('payload at a rising price', False): True,
         ('continuation to the limit', False): True, ('continuation to the limit', True): True})


def test_heaviest_motion_met_is_certified_when_time_is_up(rigid_model: ArmModel,
                                                          paper_task: TaskFactory) -> None:
    task, payloads = paper_task(rigid_model.arm), list[float]()
    ended = moments(lambda monitor: followed(task, model=rigid_model, monitor=monitor))
    # while a barrier leads to the limit, and while the motion there is certified
    for calls in (25, ended['continuation to the limit', True]):
        found = followed(task, model=rigid_model,
                         monitor=stopped_after(calls, PlanStatus.TIMEOUT))
        assert_stopped(found, PlanStatus.TIMEOUT, certified=True)
        # the last motion met; where its kind ends is known once there is a price
        assert found.payload == max((one.value for one in found.extremals), default=1.0)
        assert found.payload <= HEAVIEST['rigid'] <= found.local_upper
        payloads.append(found.payload)
    assert payloads == sorted(set(payloads))


def test_direct_search_is_stopped_at_every_payload(rigid_model: ArmModel,
                                                   paper_task: TaskFactory) -> None:
    task = paper_task(rigid_model.arm)
    for calls in (5, 15, 25, 45, 55):
        monitor = stopped_after(calls, PlanStatus.CANCELED)
        found = followed(task, model=rigid_model, monitor=monitor)
        assert_stopped(found, PlanStatus.CANCELED)
        # asked after every iteration at least
        assert found.iterations <= calls
        assert monitor.phase == 'payload at a rising price'


@pytest.mark.parametrize('share', [0.01, 0.5, 0.99])  # the last on finer meshes
def test_exploration_is_stopped_at_every_iteration(rigid_model: ArmModel, paper_task: TaskFactory,
                                                   share: float) -> None:
    task = paper_task(rigid_model.arm)
    ended = moments(lambda monitor: find_max_payload(task, model=rigid_model, monitor=monitor))
    calls = int(share * ended['payload at a rising price', False])
    monitor = stopped_after(calls, PlanStatus.CANCELED)
    found = find_max_payload(task, model=rigid_model, monitor=monitor)
    assert_stopped(found, PlanStatus.CANCELED)
    assert found.iterations <= calls + 1  # IPOPT asks after an iteration
    assert monitor.phase.startswith('kinds of motion, start ')


@pytest.mark.parametrize('calls', [20, 120])
def test_search_of_an_arm_that_bends_is_stopped(ei5_model: ArmModel, paper_task: TaskFactory,
                                                calls: int) -> None:
    # with the arm made rigid, and as it is
    monitor = stopped_after(calls, PlanStatus.CANCELED)
    found = followed(paper_task(ei5_model.arm), model=ei5_model, monitor=monitor)
    assert_stopped(found, PlanStatus.CANCELED)
    assert found.iterations <= calls
