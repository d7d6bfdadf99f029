"""Planning again in motion: what is left is the best rest, and failures leave the plan alone."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import InvalidSizeError, InvalidTaskError, InvalidValueError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.dynamics.integration import simulate
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.replan import Replan, replan
from flex_planner.planning.sampling import sample_plan, SamplingSettings
import numpy as np
from plan_checks import solution_of
import pytest


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei50')


@pytest.fixture(scope='module')
def clamped() -> Plan:
    task = Task.between_points(load_arm('clamped_motors'), (0.5, 0.0), (0.5, 0.5), duration=1.0,
                               payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])
    return plan_path(task, search='fast')


def state_at(plan: Plan, at: float) -> Array:
    state: Array = solution_of(plan)(np.array([at]))[0, :2 * plan.arm.n_coordinates]
    return state


def tip_miss(plan: Plan, found: Replan, state: Array) -> float:
    """Return where the new torques lead from a state, by SciPy's integrator [m]."""
    again = found.plan
    times = np.linspace(0, again.task.duration, 2001)
    torques = again.sample(times).torques

    def torque(time: float) -> Array:
        k, share = divmod(min(time / times[1], 1999.999), 1)
        return (1 - share) * torques[int(k)] + share * torques[int(k) + 1]

    final = simulate(plan.model, again.problem.parameters.physical, state, torque,
                     again.task.duration, rtol=1e-6, atol=1e-8)
    n_t = plan.arm.n_coordinates
    ends = tip_position(plan.arm, np.stack([final[:n_t], again.problem.goal[:n_t]]))
    return float(np.linalg.norm(ends[1] - ends[0]))


def changes(plan: Plan, count: int) -> list[tuple[float, Array, Array]]:
    """Return times, states off the plan, and other goals."""
    rng, samples = np.random.default_rng(7), plan.uniform_samples(101)
    n, found = plan.arm.n_joints, []
    size = np.concatenate([[0.05] * n, np.abs(samples.coordinates[:, n:]).max(axis=0),
                           [0.25] * n, np.abs(samples.rates[:, n:]).max(axis=0)])
    for _ in range(count):
        at = float(rng.uniform(0.1, 0.7))
        state = state_at(plan, at) + 0.2 * size * rng.normal(size=size.size)
        found.append((at, state, plan.problem.goal[:n] + rng.uniform(-0.15, 0.15, n)))
    return found


def test_rest_of_the_plan_is_found_again(plan: Plan) -> None:
    found = replan(plan, 0.3, budget=10.0)
    assert found.solved and 'the simulated tip arrives' in found.plan.message
    assert found.at == 0.3 and found.plan.task.duration == pytest.approx(0.7)
    np.testing.assert_allclose(found.plan.problem.start, state_at(plan, 0.3), rtol=0, atol=1e-12)
    assert np.abs(found.torque_step).max() < 0.1  # of 5 N m: the mesh is coarse
    there, here = (one.sample(t).coordinates for one, t in ((plan, 0.65), (found.plan, 0.35)))
    np.testing.assert_allclose(here, there, rtol=0, atol=1e-4)


@pytest.mark.parametrize('which', ['plan', 'clamped'])
def test_other_goals_from_off_the_plan_are_reached(request: pytest.FixtureRequest,
                                                   which: str) -> None:
    plan: Plan = request.getfixturevalue(which)
    for k, (at, state, goal) in enumerate(changes(plan, 12)):
        found = replan(plan, at, state=state, goal=goal, budget=10.0)
        assert found.solved, found.plan.message
        assert found.plan.certificate.tip_error <= 1e-3
        assert found.plan.task.duration >= plan.task.duration - at - 1e-12
        np.testing.assert_array_equal(found.plan.problem.goal[:2], goal)
        if k == 0:
            assert tip_miss(plan, found, state) <= 1.1e-3


def test_bending_that_is_left_out_leads_elsewhere(clamped: Plan) -> None:
    state, goal = state_at(clamped, 0.4), clamped.problem.goal[:2] + 0.1
    straight = state.copy()
    straight[2:6] = straight[8:] = 0.0
    right, wrong = (replan(clamped, 0.4, state=one, goal=goal, budget=10.0)
                    for one in (state, straight))
    assert right.solved and wrong.solved
    assert tip_miss(clamped, right, state) < 1e-3 < 1e-2 < tip_miss(clamped, wrong, state)


def test_goal_that_is_too_far_for_the_time_leaves_the_plan_alone(plan: Plan) -> None:
    before = solution_of(plan).nodes.copy()
    goal = plan.problem.goal[:2] + [1.2, -1.0]
    late = replan(plan, 0.7, goal=goal, keep_time=True, budget=10.0)
    assert not late.solved
    assert late.plan.status in (PlanStatus.NOT_CONVERGED, PlanStatus.CERTIFICATE_FAILED)
    assert late.plan.message
    assert plan.solved and np.array_equal(solution_of(plan).nodes, before)


def test_later_arrival_is_taken_where_it_may_be(plan: Plan) -> None:
    goal = plan.problem.goal[:2] + [0.8, -0.8]
    kept = replan(plan, 0.6, goal=goal, keep_time=True, budget=10.0)
    free = replan(plan, 0.6, goal=goal, budget=10.0)
    assert not kept.solved and 'more time until the arrival may do' in kept.plan.message
    assert free.solved and free.plan.task.duration > 0.4 * 1.4


def test_torques_with_a_price_on_their_rates_begin_with_the_one_that_acts(plan: Plan) -> None:
    turn, goal = 0.01, plan.problem.goal[:2] + 0.1
    weight = plan.task.effort_weights * turn**2
    free, calm = (replan(plan, 0.3, goal=goal, torque_rate_weight=one, budget=10.0)
                  for one in ([], weight))
    assert free.solved and calm.solved
    assert np.abs(free.torque_step).max() > 1.0 > 1e-9 > np.abs(calm.torque_step).max()
    np.testing.assert_allclose(calm.plan.sample(0.0).torques, plan.sample(0.3).torques, atol=1e-9)
    rates = np.diff(calm.plan.uniform_samples(7001).torques, axis=0) / 1e-4
    np.testing.assert_allclose(np.abs(rates).max(axis=0), calm.plan.torque_rates, rtol=0.05)
    # and so does the plan after it, from another torque that acts
    acts = calm.plan.sample(0.2).torques[0] + [0.3, -0.2]
    again = replan(calm.plan, 0.2, goal=goal - 0.05, torque=acts, budget=10.0)
    assert again.solved
    np.testing.assert_allclose(again.plan.sample(0.0).torques[0], acts, atol=1e-9)


def test_motors_keep_their_limits_where_torques_have_no_jumps(plan: Plan) -> None:
    goal, weight = plan.problem.goal[:2] + [0.5, -0.5], plan.task.effort_weights * 0.01**2
    found = replan(plan, 0.5, goal=goal, torque_rate_weight=weight, keep_time=True, budget=10.0)
    assert not found.solved and found.plan.status is PlanStatus.LIMIT_VIOLATED
    assert 'torque of joint' in found.plan.message
    later = replan(plan, 0.5, goal=goal, torque_rate_weight=weight, budget=10.0)
    assert later.solved and later.delay == pytest.approx(later.plan.task.duration - 0.5)
    samples = later.plan.uniform_samples(501)
    assert (samples.torques <= samples.upper_bounds + 1e-6).all()
    assert (samples.torques >= samples.lower_bounds - 1e-6).all()


def test_another_duration_may_be_asked_for(plan: Plan) -> None:
    found = replan(plan, 0.4, duration=0.9, keep_time=True, budget=10.0)
    assert found.solved and (found.plan.task.duration, found.delay) == (0.9, 0.0)
    with pytest.raises(InvalidValueError, match='duration is -1.0, but must be'):
        replan(plan, 0.4, duration=-1.0)


def test_limits_of_the_arm_are_looked_at_and_what_the_simulation_kept_is_not_claimed(
        plan: Plan) -> None:
    n, n_t = plan.arm.n_joints, plan.arm.n_coordinates
    swing = solution_of(plan)(np.linspace(0.3, 1.0, 701))[:, n_t:n_t + n]
    joints = list(plan.arm.joints)
    for share, status in ((1.5, PlanStatus.SOLVED), (0.5, PlanStatus.LIMIT_VIOLATED)):
        motor = replace(joints[0].motor, max_speed=share * float(np.abs(swing[:, 0]).max()))
        arm = replace(plan.arm, joints=(replace(joints[0], motor=motor), *joints[1:]))
        task = replace(plan.task, arm=arm)
        limited = replace(plan, task=task, problem=MotionProblem(
            plan.model, task, plan.problem.parameters))
        found = replan(limited, 0.3, keep_time=True, budget=10.0)
        assert found.plan.status is status, found.plan.message
        assert found.plan.certificate.limit_slack == -np.inf  # not known
    assert replan(plan, 0.3, budget=10.0).plan.certificate.limit_slack == np.inf  # no limits


def test_new_plan_can_be_published(plan: Plan) -> None:
    found = replan(plan, 0.3, goal=plan.problem.goal[:2] + 0.1, budget=10.0)
    sampled = sample_plan(found.plan, SamplingSettings())
    assert sampled.execution.tip_error < 2e-3
    np.testing.assert_allclose(sampled.samples.coordinates[0], state_at(plan, 0.3)[:6], atol=1e-9)


def test_work_may_be_stopped(plan: Plan) -> None:
    found = replan(plan, 0.3, monitor=Monitor(canceled=lambda: True))
    assert (found.solved, found.plan.status) == (False, PlanStatus.CANCELED)
    assert np.isnan(found.torque_step).all()
    late = replan(plan, 0.3, monitor=Monitor(time_limit=0.0))
    assert late.plan.status is PlanStatus.TIMEOUT


def test_plans_that_cannot_be_planned_again_are_refused(plan: Plan) -> None:
    unsolved = replace(plan, status=PlanStatus.NOT_CONVERGED)
    via = replace(plan, task=replace(plan.task, via_points=[
        ViaPoint(time=0.5, positions=plan.problem.goal[:2] / 2)]))
    bounded = replace(plan, task=replace(plan.task, max_torque_rate=1e3))
    for wrong, reason in ((unsolved, 'is not solved'), (via, 'has via points'),
                          (bounded, 'has bounds of torque rates')):
        with pytest.raises(InvalidTaskError, match=f'the running plan {reason}'):
            replan(wrong, 0.3)


def test_wrong_values_are_named(plan: Plan) -> None:
    with pytest.raises(InvalidValueError, match='at is 1.0, but must be'):
        replan(plan, 1.0)
    with pytest.raises(InvalidSizeError, match='state has 3 numbers, but must be'):
        replan(plan, 0.3, state=np.zeros(3))
    with pytest.raises(InvalidValueError, match='budget is 0.0, but must be'):
        replan(plan, 0.3, budget=0.0)
