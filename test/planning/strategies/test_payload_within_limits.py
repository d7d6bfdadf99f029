"""Largest payloads of links that ring, on meshes that tell the truth, from arms that ring less."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from flex_planner import load_arm
from flex_planner.arms.joint import Motor
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.constrained_motion import slacks_of
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.optimal_control.task import Task
from flex_planner.paper.cases import paper_arm, point_to_point
from flex_planner.planning.strategies.easier_arm import ease_arm
from flex_planner.planning.strategies.payload_within_limits import (
    reach_from_easier_arm,
    reach_largest_payload,
    refine_limit,
)
from flex_planner.planning.strategies.reached_limit import ReachedLimit
from flex_planner.planning.within_model import bound_bending
import numpy as np
import pytest

# EI 50, where Newton's method walked the price: this much is carried, and no more of this kind
CARRIED, TOO_MUCH = 5.68735, 5.68795
# EI 5 within a deflection of 0.3 of a link's length, where no bending limit leaves 3.3745 to
# 3.3753: by the same method on 162 and on 324 intervals, 3.12815 and 3.12807
SOFT = 3.1281
ACCURACY, LOOSE = 1e-3, 2e-2


@cache
def clamped(rigidity: float) -> tuple[MotionProblem, PathSlacks]:
    """Return the paper's motion with one clamped mode per link, and what bounds its bending."""
    problem = bound_bending(problem_of(
        point_to_point(paper_arm(rigidity, 1, 'clamped_free'), 0.0)))
    assert problem is not None
    slacks = slacks_of(problem)
    assert slacks is not None
    return problem, slacks


def problem_of(task: Task) -> MotionProblem:
    """Return the problem of a task."""
    return MotionProblem(ArmModel.of(task.arm), task, task_parameters(task))


def test_payload_of_a_mesh_that_is_too_coarse_is_put_right() -> None:
    problem, slacks = clamped(50.0)
    coarse = reach_largest_payload(problem, slacks, Solver(), None, ACCURACY)
    assert coarse is not None and coarse.value > TOO_MUCH
    fine = refine_limit(problem, slacks, coarse, Solver(), ACCURACY)
    assert fine is not None
    assert fine.motion.intervals >= 4 * coarse.motion.intervals
    assert CARRIED <= fine.value + fine.gap <= TOO_MUCH
    assert CARRIED - ACCURACY / 2 <= fine.value <= TOO_MUCH
    assert coarse.gap < fine.gap <= ACCURACY


def test_payload_that_no_mesh_confirms_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    from flex_planner.planning.strategies import payload_within_limits

    problem, slacks = clamped(50.0)
    start = reach_largest_payload(problem, slacks, Solver(), None, ACCURACY)
    assert start is not None

    def grow(problem: MotionProblem, slacks: PathSlacks, reached: ReachedLimit,
             solver: Solver) -> ReachedLimit:
        return replace(reached, value=reached.value + ACCURACY)

    monkeypatch.setattr(payload_within_limits, '_refine', grow)
    assert refine_limit(problem, slacks, start, Solver(), ACCURACY) is None


def test_soft_links_are_reached_from_stiffer_ones() -> None:
    problem, slacks = clamped(5.0)
    assert reach_largest_payload(problem, slacks, Solver(), None, ACCURACY) is None
    found = reach_from_easier_arm(problem, slacks, Solver(), ACCURACY)
    assert found is not None
    assert found.value == pytest.approx(SOFT, abs=1e-2)  # on the first mesh
    values = slacks(found.motion.nodes[:, problem.layout.states])
    assert -1e-4 < values.min() < 1e-3  # bent as far as it may


def test_mesh_is_made_finer_for_an_accuracy_that_is_soon_reached() -> None:
    # mu ends so high there that a thousand times as much is more than it began with
    problem, slacks = clamped(5.0)
    coarse = reach_from_easier_arm(problem, slacks, Solver(), LOOSE)
    assert coarse is not None
    fine = refine_limit(problem, slacks, coarse, Solver(), LOOSE)
    assert fine is not None
    assert fine.motion.intervals > coarse.motion.intervals
    assert fine.value <= SOFT + ACCURACY <= fine.value + fine.gap + 2 * ACCURACY
    assert fine.gap <= LOOSE


def test_arm_that_is_easier_ends_as_the_arm_itself() -> None:
    problem, _ = clamped(5.0)
    [stiffer] = ease_arm(problem)
    assert stiffer(1.0) is problem
    np.testing.assert_allclose(stiffer(0.0).parameters.rigidity, 50.0)
    np.testing.assert_allclose(stiffer(0.5).parameters.rigidity, 5.0 * np.sqrt(10))


def test_friction_is_smoother_first_and_links_are_stiffer_then() -> None:
    arm = load_arm('desk_arm')
    problem = problem_of(Task(arm=arm, start_positions=np.deg2rad([-90, 0]),
                              goal_positions=np.deg2rad([-60, 30]), duration=2.0))
    smoother, both = ease_arm(problem)
    own, first, stiff = (each.parameters for each in (problem, smoother(0.0), both(0.0)))
    assert (first.coulomb_speed > own.coulomb_speed).all()
    np.testing.assert_array_equal(first.rigidity, own.rigidity)
    np.testing.assert_array_equal(stiff.coulomb_speed, first.coulomb_speed)
    np.testing.assert_allclose(stiff.rigidity, 10 * own.rigidity)
    assert smoother(1.0) is problem and both(1.0) is problem


def test_rigid_arm_without_friction_has_nothing_that_is_easier() -> None:
    task = point_to_point(paper_arm(np.inf), 0.0)
    assert not list(ease_arm(problem_of(task)))


def test_nothing_is_reached_without_limits_of_motors() -> None:
    problem, slacks = clamped(5.0)
    joints = tuple(replace(joint, motor=Motor()) for joint in problem.task.arm.joints)
    free = problem_of(replace(problem.task, arm=replace(problem.task.arm, joints=joints)))
    assert reach_from_easier_arm(free, slacks, Solver(), ACCURACY) is None
