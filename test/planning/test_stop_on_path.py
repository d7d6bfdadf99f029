"""A stop on the way ends at rest on the path, within the motors' limits; else the plan goes on."""

from __future__ import annotations

from factories import PlanFactory
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.dynamics.integration import simulate
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.replan_or_stop import Course, replan_or_stop
from flex_planner.planning.stop_on_path import Stop, stop_on_path
import numpy as np
from plan_checks import solution_of
import pytest


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei50')


@pytest.fixture(scope='module')
def stop(plan: Plan) -> Stop:
    return stop_on_path(plan, 0.3, budget=10.0)


def passed(plan: Plan) -> Array:
    """Return joint angles that a plan passes after 0.3 s, close to one another."""
    return plan.sample(np.linspace(0.3, 1.0, 5001)).coordinates[:, :2]


def test_stop_is_soon_on_the_path_and_at_rest(plan: Plan, stop: Stop) -> None:
    assert stop.solved and stop.plan.task.duration < 0.5
    state = solution_of(plan)(np.array([0.3]))[0, :12]
    final = simulate(plan.model, stop.plan.problem.parameters.physical, state,
                     lambda time: stop.plan.sample(min(time, stop.plan.task.duration)).torques[0],
                     stop.plan.task.duration, rtol=1e-7, atol=1e-9)
    assert np.abs(final[6:8]).max() < 1e-3  # [rad/s], of joints that turned at 2 rad/s
    apart = np.abs(passed(plan) - final[:2]).max(axis=1)
    assert apart.min() < 1e-4 and apart[0] > 0.05 and apart[-1] > 0.2


def test_joints_stay_by_the_path_and_torques_within_the_limits_on_the_way(plan: Plan,
                                                                          stop: Stop) -> None:
    samples = stop.plan.uniform_samples(201)
    apart = np.abs(samples.coordinates[:, None, :2] - passed(plan)).max(axis=2).min(axis=1)
    assert apart.max() == pytest.approx(stop.deviation, abs=2e-4)
    assert stop.deviation < 5e-3
    assert (samples.torques <= samples.upper_bounds + 1e-6).all()
    assert (samples.torques >= samples.lower_bounds - 1e-6).all()


def test_stop_that_leaves_the_path_is_refused(plan: Plan) -> None:
    state = solution_of(plan)(np.array([0.3]))[0, :12]
    found = stop_on_path(plan, 0.3, state=state, max_deviation=1e-9, budget=10.0)
    assert not found.solved
    assert found.plan.status is PlanStatus.LIMIT_VIOLATED
    assert 'joints would leave the path by' in found.plan.message
    with pytest.raises(InvalidValueError, match='max_deviation is 0.0, but must be a number > 0'):
        stop_on_path(plan, 0.3, max_deviation=0.0)


def test_goal_decides_what_happens_to_the_plan(plan: Plan) -> None:
    before, near = solution_of(plan).nodes.copy(), plan.problem.goal[:2] + 0.05
    far, too_far = plan.problem.goal[:2] + [0.8, -0.8], plan.problem.goal[:2] + [3.0, -2.5]
    found = [replan_or_stop(plan, 0.6, goal=goal, keep_time=keep, stops=stops, budget=10.0)
             for goal, keep, stops in ((near, True, False), (far, False, True),
                                       (far, True, True), (too_far, False, False))]
    assert [one.course for one in found] == [
        Course.REPLANNED, Course.LATER, Course.STOPS, Course.GOES_ON]
    assert [one.plan.solved for one in found] == [True, True, True, False]
    assert [bool(one.message) for one in found] == [False, True, True, True]
    assert found[1].delay > 0.1 and found[2].deviation < 0.05
    assert np.array_equal(solution_of(plan).nodes, before)
