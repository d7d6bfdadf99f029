"""Jumps of the torque at both ends and on the way, as shares of the stall torque."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory, TaskFactory
from flex_planner.arms.arm import Motor
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.torque_jumps import find_torque_jumps
import numpy as np
from plan_checks import problem_of
import pytest

TIMES = np.array([0.0, 0.25, 0.5, 0.5 + 1e-6, 0.75, 1.0])


def test_torque_of_the_paper_jumps_by_two_thirds_of_its_limit(plan_of: PlanFactory) -> None:
    plan = plan_of('ei50')
    samples = plan.uniform_samples(2001)
    start, way, end = find_torque_jumps(plan.problem, samples.times, samples.torques)
    # 5.555 of 8 N m: the first row of the table in README
    assert (str(start), start.joint, start.time) == ('69% at the start (joint 1)', 0, 0.0)
    assert (end.place, end.time) == ('at the end', 1.0)
    assert end.share == pytest.approx(np.abs(samples.torques[-1]).max() / 8, rel=1e-12)
    assert way.share < 0.01


def test_jump_within_a_thousandth_of_the_duration_is_one(rigid_model: ArmModel,
                                                         paper_task: TaskFactory) -> None:
    problem = problem_of(rigid_model, paper_task(rigid_model.arm))
    torques = np.column_stack([[0, 1, 2, -6, -5, 0], np.linspace(0, 8, 6)])
    way = find_torque_jumps(problem, TIMES, torques)[1]
    assert (way.place, way.joint, way.time) == ('on the way', 0, 0.5)
    # 8 N m, and 0.004 N m of the slope of 4 N m/s that goes on
    assert way.share == pytest.approx(1.0, abs=1e-3)
    # ten times the time makes it a ramp: a tenth of its 8 N m in a thousandth of the duration
    ramp = np.where(TIMES == 0.5 + 1e-6, 0.51, TIMES)
    assert find_torque_jumps(problem, ramp, torques)[1].share == pytest.approx(0.1, abs=1e-3)


def test_torque_that_holds_the_arm_before_and_after_is_no_jump(workshop_model: ArmModel) -> None:
    task = Task(arm=workshop_model.arm, start_positions=[-1.6, 0.1], goal_positions=[-1.5, 0.2],
                duration=1.0)
    problem = problem_of(workshop_model, task)
    n_t, n = workshop_model.arm.n_coordinates, workshop_model.arm.n_joints
    states = np.stack([problem.start, problem.goal])[:, :n_t]
    holding = workshop_model.static_forces(states, problem.parameters.physical)[0][:, :n]
    assert np.abs(holding).max() > 0.3
    torques = holding[0] + TIMES[:, None] * (holding[1] - holding[0])
    start, way, end = find_torque_jumps(problem, TIMES, torques)
    assert (start.share, end.share) == (pytest.approx(0, abs=1e-12), pytest.approx(0, abs=1e-12))
    assert way.share < 1e-3
    start, way, end = find_torque_jumps(problem, TIMES, torques + [0.9, 0.0])
    assert (start.share, start.joint) == (pytest.approx(0.1), 0)  # of 9 N m
    assert (end.share, end.joint) == (pytest.approx(0.1), 0)


def test_nothing_is_said_of_ends_at_which_the_arm_moves(rigid_model: ArmModel,
                                                        paper_task: TaskFactory) -> None:
    torques = np.ones((TIMES.size, 2))
    for changes, places in (({'start_velocities': [0.1, 0.0]}, ['on the way', 'at the end']),
                            ({'goal_velocities': [0.1, 0.0]}, ['at the start', 'on the way'])):
        problem = problem_of(rigid_model, paper_task(rigid_model.arm, **changes))
        assert [jump.place for jump in find_torque_jumps(problem, TIMES, torques)] == places


def test_motors_without_limits_have_no_shares(rigid_model: ArmModel,
                                              paper_task: TaskFactory) -> None:
    joints = tuple(replace(joint, motor=Motor()) for joint in rigid_model.arm.joints)
    arm = replace(rigid_model.arm, joints=joints)
    torques = np.full((TIMES.size, 2), 1e3)
    assert find_torque_jumps(problem_of(rigid_model, paper_task(arm)), TIMES, torques) == []
    # one of two
    arm = replace(arm, joints=(joints[0], rigid_model.arm.joints[1]))
    jumps = find_torque_jumps(problem_of(rigid_model, paper_task(arm)), TIMES, torques)
    assert [(jump.joint, jump.share) for jump in jumps] == [(1, 125.0), (0, 0.0), (1, 125.0)]


def test_motor_at_its_limit_to_the_end_jumps_by_all_of_it(plan_of: PlanFactory) -> None:
    task = replace(plan_of('rigid').task, payload_mass=5.8549)  # 5.855 kg is the most
    plan = plan_path(task, model=plan_of('rigid').model)
    times = np.sort(np.concatenate([np.linspace(0, 1, 201), plan.switching_times]))
    start, way, end = find_torque_jumps(plan.problem, times, plan.sample(times).torques)
    assert [start.share, end.share] == pytest.approx([1.0, 1.0], abs=1e-9)
    assert way.share > 0.25
