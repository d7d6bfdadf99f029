"""How far links bend for their length, and which motions are refused for it."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.arms.kinematics import link_points
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import read_constraint, write_constraint
from flex_planner.optimal_control.task import Task
from flex_planner.planning.bending import find_largest_bending, keeps_model, limits_of_model
from flex_planner.planning.certificate import CertificateLimits
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.verdict import find_refusal
from flex_planner.planning.warnings import WarningKind
from flex_planner.planning.within_model import bound_bending
import numpy as np
from plan_checks import solution_of
import pytest
from spatial_arms import flexible_3r


def test_pinned_link_bends_from_its_chord(ei50_arm: Arm) -> None:
    # a sine of 40 mm on 0.5 m at the second of two moments
    q = np.zeros((2, 6))
    q[0, 2], q[1, 4] = 0.03, -0.04
    found = find_largest_bending(ei50_arm, q)
    assert (found.link, found.moment) == (1, 1)
    assert found.share == pytest.approx(0.08, rel=1e-12)


def test_clamped_link_bends_from_the_tangent_at_its_base(crane_arm: Arm) -> None:
    q = np.array([[0.3, 0.2, 0.02, 0.004, 0.01]])
    found = find_largest_bending(crane_arm, q)
    points = link_points(crane_arm, q, stations=21)[0, 0]
    across = np.array([-np.sin(0.3), np.cos(0.3)])
    assert found.link == 0
    assert found.share == pytest.approx(np.abs(points @ across).max() / 0.6, rel=1e-12)


def test_rigid_links_do_not_bend(rigid_arm: Arm) -> None:
    assert find_largest_bending(rigid_arm, np.ones((3, 2))).share == 0


# A link that is thrown about: it bends by over 50, 25 and 4 % of its length in 0.65, 1 and 2 s


# By IPOPT, on Radau collocation of equations of the link written apart from the planner's: J in
# 0.8 s, free and within what the model holds, and within it the largest payload in 1 s [kg] and
# the shortest duration [s]
FREE, WITHIN, HEAVIEST, SHORTEST = 0.0606532, 0.0615306, 0.2452, 0.69291


def soft_plan(duration: float, allowed: bool) -> Plan:
    link = Link(length=0.5, linear_density=0.2, flexural_rigidity=0.3, modes=1,
                mode_family='clamped_free')
    arm = Arm(name='soft', links=(link,), joints=(Joint(motor=Motor(stall_torque=5.0)),),
              nodes=(Node(inertia=0.01), Node()))
    return plan_path(Task(arm=arm, start_positions=[0.0], goal_positions=[1.5], payload_mass=0.1,
                          duration=duration, allow_large_bending=allowed))


@pytest.fixture(scope='module')
def refused() -> Plan:
    return soft_plan(0.65, allowed=False)


def largest(plan: Plan) -> float:
    return find_largest_bending(plan.arm, plan.uniform_samples(4001).coordinates).share


def test_link_that_bends_further_than_its_model_is_refused(refused: Plan) -> None:
    assert largest(refused) > 0.3
    assert (refused.status, refused.certified) == (PlanStatus.BENT_TOO_FAR, True)
    assert refused.message.startswith(f'link 1 bends by {largest(refused):.0%} of its length at ')
    assert refused.message.endswith('and allow_large_bending in the task accepts it')
    # what was found is kept, with its certificate and warnings
    assert CertificateLimits().violations(refused.certificate) == []
    assert WarningKind.BENDING in {one.kind for one in refused.warnings}


def test_large_bending_may_be_allowed(refused: Plan) -> None:
    plan = soft_plan(0.65, allowed=True)
    assert plan.solved, plan.message
    assert plan.cost == pytest.approx(refused.cost, rel=1e-13)
    (told,) = [one for one in plan.warnings if one.kind is WarningKind.BENDING]
    assert told.value == pytest.approx(largest(plan), rel=1e-3)
    assert told.time is not None
    assert f'{told.value:.0%} of its length at {told.time:.4g} s' in told.sentence


def test_what_bends_less_is_solved_with_a_warning_or_without() -> None:
    for duration, warned in ((1.0, True), (2.0, False)):
        plan = soft_plan(duration, allowed=False)
        assert plan.solved, plan.message
        assert (largest(plan) > 0.1) is warned
        assert (WarningKind.BENDING in {one.kind for one in plan.warnings}) is warned


def test_motion_is_bent_to_what_the_model_holds() -> None:
    plan, free = soft_plan(0.8, allowed=False), soft_plan(0.8, allowed=True)
    assert plan.solved, plan.message
    assert largest(free) > 0.31
    assert 0.29 < largest(plan) <= 0.3
    assert free.cost == pytest.approx(FREE, rel=1e-6)
    assert plan.cost == pytest.approx(WITHIN, rel=1e-4)
    assert CertificateLimits().violations(plan.certificate) == []
    (told,) = [one for one in plan.warnings if one.kind is WarningKind.BENDING]
    assert 'the motion of least cost would bend them by more than the 30%' in told.sentence
    # its texts lead to the same limits, as in messages and recordings
    assert keeps_model(replace(plan.task, path_constraints=[
        read_constraint('limit', write_constraint(one)) for one in plan.task.path_constraints]))


def test_ends_that_bend_too_far_cannot_be_mended(refused: Plan) -> None:
    bounded = bound_bending(refused.problem)
    assert bounded is not None and keeps_model(bounded.task)
    assert bound_bending(bounded) is None  # there is nothing to add
    task = replace(refused.task, start_modal_displacements=[0.2])
    bent = MotionProblem(refused.model, task, refused.problem.parameters)
    assert find_largest_bending(refused.arm, bent.start[None, :2]).share > 0.3
    assert bound_bending(bent) is None


def test_searches_end_where_the_model_does() -> None:
    task = soft_plan(1.0, allowed=False).task
    found = find_max_payload(replace(task, payload_mass=0.0), accuracy=1e-3)
    assert found.status is PlanStatus.SOLVED, found.message
    assert found.plan is not None and found.plan.solved
    assert 0.29 < largest(found.plan) <= 0.3
    assert found.payload == pytest.approx(HEAVIEST, abs=1e-3)
    assert not plan_path(replace(task, payload_mass=found.payload + 5e-3)).solved
    fastest = find_min_duration(task)
    assert fastest.status is PlanStatus.SOLVED, fastest.message
    assert fastest.plan is not None and 0.29 < largest(fastest.plan) <= 0.3
    assert fastest.duration == pytest.approx(SHORTEST, abs=1e-4)


def test_limit_on_the_way_is_told_before_bending(refused: Plan) -> None:
    joint = replace(refused.arm.joints[0], motor=Motor(stall_torque=5.0, max_speed=1.0))
    task = replace(refused.task, arm=replace(refused.arm, joints=(joint,)))
    problem = type(refused.problem)(refused.model, task, refused.problem.parameters)
    found = find_refusal(problem, solution_of(refused))
    assert found is not None
    assert found[0] is PlanStatus.LIMIT_VIOLATED


def test_planar_link_in_space_is_bent_to_what_the_model_holds() -> None:
    planar = soft_plan(0.8, allowed=False)
    plan = plan_path(replace(planar.task, path_constraints=(),
                             arm=SpatialArm.of_planar(planar.arm)))
    assert plan.solved, plan.message
    assert keeps_model(plan.task)
    # by a slack of another form, which a barrier keeps to differently
    assert plan.cost == pytest.approx(planar.cost, rel=1e-4)


def test_links_in_space_are_limited_where_they_bend_in_a_plane() -> None:
    assert [one.link for one in limits_of_model(flexible_3r())] == [2, 3]
    twisting = flexible_3r(modes=0, twist=1)
    assert twisting.n_modes == 2 and limits_of_model(twisting) == ()


def test_payload_that_bends_a_link_too_far_at_rest_is_not_searched_beyond_that() -> None:
    task = soft_plan(2.0, allowed=False).task
    level = replace(task, arm=replace(task.arm, gravity=[0.0, -9.81]), payload_mass=0.0,
                    start_positions=[-1.5], goal_positions=[-0.4])
    phases: set[str] = set()
    found = find_max_payload(level, search='fast', monitor=Monitor(
        report=lambda progress: phases.add(progress.phase)))
    assert found.solved, found.message
    assert found.within_limits and found.plan is not None
    assert 0.29 < largest(found.plan) <= 0.3
    assert not any('rising price' in phase for phase in phases)
    # the goal alone, at rest, bends the link by nearly as much
    rest = found.plan.problem.goal[None, :2]
    assert 0.25 < find_largest_bending(level.arm, rest).share <= 0.3
