"""Limits on the way: found where a motion is furthest beyond them, to rounding, and told."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import PayloadMethod
from flex_planner.collocation import Solver
from flex_planner.collocation.solve import solve
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.certificate import CertificateLimits
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.verdict import find_refusal
from flex_planner.planning.way_limits import (
    find_limit_violations,
    LimitKind,
    LimitViolation,
    MARGIN,
)
import numpy as np
from plan_checks import problem_of, solution_of
import pytest
from scipy.optimize import minimize_scalar

# of a value at an extremum, where it is flat: that of the time squared
EXACT = 1e-10


def limited(arm: Arm, index: int, **limits: Any) -> Arm:
    """Return an arm with limits at one joint; `max_speed` is that of its motor."""
    joint = arm.joints[index]
    if 'max_speed' in limits:
        joint = replace(joint, motor=replace(joint.motor, max_speed=limits.pop('max_speed')))
    joints = (*arm.joints[:index], replace(joint, **limits), *arm.joints[index + 1:])
    return replace(arm, joints=joints)


def violations(plan: Plan, index: int = 0, **limits: Any) -> tuple[LimitViolation, ...]:
    """Return what a motion violates where its arm had these limits."""
    task = replace(plan.task, arm=limited(plan.arm, index, **limits))
    return find_limit_violations(problem_of(plan.model, task), solution_of(plan))


def extremum(plan: Plan, column: int, sign: float) -> tuple[float, float]:
    """Return time and value of the largest of sign * z[column], as SciPy finds it."""
    solution = solution_of(plan)
    times = np.linspace(0, plan.task.duration, 2001)
    near = times[(sign * solution(times)[:, column]).argmax()]
    found = minimize_scalar(lambda t: -sign * float(solution(np.array([t]))[0, column]),
                            bounds=(near - 1e-3, near + 1e-3), method='bounded',
                            options={'xatol': 1e-12})
    return float(found.x), -sign * float(found.fun)


# random counter-example: the elbow swings through -174 deg between two postures at -120
SWINGING: dict[str, Any] = {'start_positions': np.radians([120, -120]),
                            'goal_positions': np.radians([-120, -120]), 'duration': 3.0}


@pytest.fixture(scope='module')
def swinging(rigid_model: ArmModel) -> Plan:
    return plan_path(Task(arm=rigid_model.arm, **SWINGING), model=rigid_model)


@pytest.fixture(scope='module')
def narrow_task(rigid_model: ArmModel) -> Task:
    joints = tuple(replace(joint, lower_limit=-2.2, upper_limit=2.2)
                   for joint in rigid_model.arm.joints)
    return Task(arm=replace(rigid_model.arm, joints=joints), **SWINGING)


def test_motion_that_swings_through_a_limit_is_refused(
        rigid_model: ArmModel, narrow_task: Task, swinging: Plan) -> None:
    refusal = find_refusal(problem_of(rigid_model, narrow_task), solution_of(swinging))
    assert refusal is not None
    status, message = refusal
    assert status is PlanStatus.LIMIT_VIOLATED
    assert message.startswith('joint 2 is at -176.26 deg at 1.586 s, 50.2 deg beyond its '
                              'lower limit of -126.05 deg; another duration')


def test_motion_that_would_swing_through_a_limit_is_planned_within_it(
        rigid_model: ArmModel, narrow_task: Task) -> None:
    plan = plan_path(narrow_task, model=rigid_model)
    assert plan.solved, plan.message
    # IPOPT on 80 intervals of 4 points
    assert plan.cost == pytest.approx(3.5969466, rel=1e-4)
    assert find_limit_violations(plan.problem, solution_of(plan)) == ()
    nearest = min(plan.constraints, key=lambda one: one.slack)
    assert nearest.name == 'lower limit of joint 2'
    assert 0 < nearest.margin < 1e-4


def test_where_limits_cannot_bend_a_motion_it_is_kept_but_not_solved(
        rigid_model: ArmModel, narrow_task: Task) -> None:
    # a method of another package knows of no barriers
    other = Solver(backend=lambda *given, **named: solve(*given, **named))
    plan = plan_path(narrow_task, model=rigid_model, solver=other, search='fast')
    assert (plan.status, plan.solved, plan.certified) == (PlanStatus.LIMIT_VIOLATED, False, True)
    # what was found is kept, with its certificate
    assert CertificateLimits().violations(plan.certificate) == []
    assert plan.sample([1.586]).coordinates[0, 1] == pytest.approx(np.radians(-176.26), abs=1e-4)


@pytest.mark.parametrize(('limits', 'kind', 'column', 'sign'), [
    ({'lower_limit': -2.2}, LimitKind.LOWER_ANGLE, 1, -1.0),
    ({'max_speed': 0.5}, LimitKind.SPEED, 3, 1.0)])
def test_worst_excess_is_an_extremum_of_the_motion(
        swinging: Plan, limits: dict[str, float], kind: LimitKind, column: int,
        sign: float) -> None:
    found = violations(swinging, 1, **limits)[0]
    time, value = extremum(swinging, column, sign)
    if kind is LimitKind.SPEED and found.value < 0:
        time, value = extremum(swinging, column, -1.0)
    (limit,) = limits.values()
    assert (found.joint, found.kind, abs(found.limit)) == (1, kind, abs(limit))
    assert found.value == pytest.approx(value, abs=EXACT)
    assert found.time == pytest.approx(time, abs=1e-4)
    assert found.excess == pytest.approx(abs(value) - abs(limit), abs=EXACT)


def test_rounding_is_no_violation_and_the_next_larger_excess_is(swinging: Plan) -> None:
    _, lowest = extremum(swinging, 1, -1.0)
    assert violations(swinging, 1, lower_limit=lowest + 0.9 * MARGIN) == ()
    found = violations(swinging, 1, lower_limit=lowest + 1.1 * MARGIN)
    assert [one.excess for one in found] == [pytest.approx(1.1 * MARGIN, abs=EXACT)]
    _, fastest = extremum(swinging, 2, -1.0)
    assert violations(swinging, max_speed=-fastest / (1 + 0.9 * MARGIN)) == ()
    assert len(violations(swinging, max_speed=-fastest / (1 + 1.1 * MARGIN))) == 1


def test_start_and_goal_may_be_limits(plan_of: PlanFactory) -> None:
    # without a payload joint 1 turns from the one to the other, with 1 kg it overshoots by 0.1 deg
    for payload, passed in ((0.0, []), (1.0, [LimitKind.UPPER_ANGLE])):
        plan = plan_of('rigid', payload)
        ends = plan.task.start_positions[0], plan.task.goal_positions[0]
        found = violations(plan, lower_limit=ends[0], upper_limit=ends[1])
        assert [one.kind for one in found] == passed


def test_motion_that_first_swings_back_leaves_the_limit_at_its_start(swinging: Plan) -> None:
    start = float(swinging.task.start_positions[1])
    found = violations(swinging, 1, lower_limit=start)
    assert [one.kind for one in found] == [LimitKind.LOWER_ANGLE]
    assert found[0].limit == start


def test_fastest_moment_of_a_single_link_is_that_of_its_parabola() -> None:
    # a rigid link of least effort turns at 6 D t (T - t) / T^3: 3 D / 2 T half-way
    link = Link(length=1.0, linear_density=1.0)
    fast = 1.5 * 1.2 / 2.0
    for limit, passed in ((0.99 * fast, 1), (1.01 * fast, 0)):
        arm = Arm(name='bar', links=(link,), joints=(Joint(motor=Motor(max_speed=limit)),))
        for goal in (1.2, -1.2):
            task = Task(arm=arm, start_positions=[0.0], goal_positions=[goal], duration=2.0)
            free = plan_path(replace(task, arm=replace(arm, joints=(Joint(),))))
            assert plan_path(task).solved
            found = find_limit_violations(problem_of(free.model, task), solution_of(free))
            assert [(one.time, one.value) for one in found] == passed * [
                (pytest.approx(1.0, abs=1e-3), pytest.approx(np.sign(goal) * fast, abs=1e-8))]
            assert [one.limit for one in found] == passed * [np.sign(goal) * limit]


def test_worst_of_several_is_told_with_their_number(
        rigid_model: ArmModel, swinging: Plan) -> None:
    arm = limited(limited(rigid_model.arm, 0, max_speed=1.0), 1, lower_limit=-2.2)
    problem = problem_of(rigid_model, Task(arm=arm, **SWINGING))
    found = find_limit_violations(problem, solution_of(swinging))
    assert [one.share for one in found] == sorted((one.share for one in found), reverse=True)
    assert {one.kind for one in found} == {LimitKind.LOWER_ANGLE, LimitKind.SPEED}
    _, message = find_refusal(problem, solution_of(swinging)) or (None, '')
    assert message.startswith(f'{found[0]} ({len(found) - 1} more limit')
    speed = next(one for one in found if one.kind is LimitKind.SPEED)
    assert str(speed).startswith('joint 1 turns at -')
    assert str(speed).endswith('rad/s beyond its max_speed of 1')


def test_arm_without_limits_is_not_looked_at(swinging: Plan) -> None:
    assert find_limit_violations(swinging.problem, None) == ()  # type: ignore[arg-type]


def test_weights_that_meet_an_objective_may_bring_a_motion_back(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    arm = limited(rigid_model.arm, 0, max_speed=0.9)
    kept = plan_path(paper_task(arm), model=rigid_model,
                     objectives=Objectives(max_joint_speeds=[0.9, np.inf]))
    assert kept.solved, kept.message
    # the free motion with these weights keeps the limit: no barrier is in it
    assert (kept.barrier_gap, kept.objectives and kept.objectives.met) == (0.0, True)


# A payload whose motion leaves a limit is not carried


@pytest.fixture(scope='module')
def slow_arm(rigid_arm: Arm) -> Arm:
    """Return an arm whose second joint is at its largest speed with some payload."""
    return limited(rigid_arm, 1, max_speed=1.58)


def test_largest_payload_is_that_of_a_motion_within_the_limits(
        rigid_model: ArmModel, slow_arm: Arm, paper_task: TaskFactory) -> None:
    found = find_max_payload(paper_task(slow_arm, 0.0), model=rigid_model)
    assert found.solved, found.message
    # 5.855 kg without the limit, and 5.4 kg by motions that no limit bends
    assert 5.75 < found.payload < found.local_upper < 5.855
    assert found.plan is not None
    assert find_limit_violations(found.plan.problem, solution_of(found.plan)) == ()


def test_payload_is_raised_as_long_as_its_motion_keeps_the_limits(
        rigid_model: ArmModel, slow_arm: Arm, paper_task: TaskFactory) -> None:
    # 5.85 kg without the limit, and the joint turns at 1.43 rad/s with 5 kg, at 1.80 with 5.8
    found = find_max_payload(paper_task(slow_arm, 5.0), model=rigid_model, accuracy=0.02, step=0.4,
                             method=PayloadMethod.INCREMENTAL)
    assert found.solved, found.message
    assert 5.0 < found.payload < found.local_upper < 5.8
    assert found.local_upper - found.payload <= 0.02
    assert 'cannot by this kind of motion: joint 2 turns at ' in found.message
    assert [trial.solved for trial in found.trials if trial.refusal] == [False] * len(
        [trial for trial in found.trials if trial.payload >= found.local_upper])
    assert found.plan is not None
    assert violations(found.plan, 1, max_speed=1.58) == ()
