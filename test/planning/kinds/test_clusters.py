"""Which motions are of one kind, how often each was met, and what it is called."""

from __future__ import annotations

from factories import TaskFactory
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import (
    are_alike,
    cluster,
    describe_path,
    kind_of,
    merge,
)
from flex_planner.planning.kinds.explorer import ExploredMotion
from kinds_support import made_up
import numpy as np
from plan_checks import problem_of
import pytest

TIMES = np.linspace(0, 1, 17)
STRAIGHT = 'every joint goes straight to its goal'


def more(value: float, other: float) -> bool:
    return value > other


def less(value: float, other: float) -> bool:
    return value < other


@pytest.fixture(scope='module')
def problem(rigid_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(rigid_model, paper_task(rigid_model.arm))


def bowed(problem: MotionProblem, value: float, bow: float) -> ExploredMotion:
    """Return a motion whose second joint bows by an angle."""
    straight = made_up(problem, value)
    return made_up(problem, value, straight.angles + np.outer(np.sin(np.pi * TIMES), [0.0, bow]))


def test_motions_are_alike_if_no_angle_differs_much(problem: MotionProblem) -> None:
    straight = made_up(problem, 1.0).angles
    assert are_alike(straight, bowed(problem, 1.0, 0.34).angles)
    assert are_alike(straight, bowed(problem, 1.0, -0.34).angles)
    assert not are_alike(straight, bowed(problem, 1.0, 0.36).angles)


@pytest.mark.parametrize(('better', 'values', 'mets'), [
    (more, [7.0, 5.0, 1.5], [1, 2, 3]), (less, [0.5, 4.0, 7.0], [3, 2, 1])])
def test_kinds_are_sorted_and_count_how_often_they_were_met(
        problem: MotionProblem, better: type[more], values: list[float],
        mets: list[int]) -> None:
    motions = [bowed(problem, value, bow) for value, bow in (
        (1.0, 0.0), (5.0, 1.0), (1.5, 0.02), (7.0, -1.0), (4.0, 1.1), (0.5, 0.01))]
    kinds = cluster(motions, better)
    assert [kind.value for kind in kinds] == values
    assert [kind.met for kind in kinds] == mets
    # a kind is its best motion
    assert all(kind.motion in motions and kind.motion.value == kind.value for kind in kinds)


def test_kind_between_two_others_makes_them_one(problem: MotionProblem) -> None:
    apart = cluster([bowed(problem, 1.0, 0.0), bowed(problem, 2.0, 0.5)], more)
    assert len(apart) == 2
    (one,) = merge(apart, kind_of(bowed(problem, 1.5, 0.25)), more)
    assert (one.value, one.met) == (2.0, 3)


def test_no_motions_are_no_kinds() -> None:
    assert cluster([], more) == []


def swing(stroke: float, back: float = 0.0, beyond: float = 0.0, *, last: bool = False) -> Array:
    """Return the angles of a joint in degrees, behind its start and beyond its goal."""
    sign = np.sign(stroke) or 1.0
    turns = [stroke + beyond * sign, -back * sign] if last else [-back * sign,
                                                                 stroke + beyond * sign]
    path = np.interp(TIMES, [0, 0.25, 0.75, 1], [0, *turns, stroke])
    return np.deg2rad(40.0 + path)


@pytest.mark.parametrize('stroke', [60.0, -60.0])
@pytest.mark.parametrize(('swings', 'words'), [
    ({}, STRAIGHT), ({'back': 9.0, 'beyond': 9.0}, STRAIGHT),
    ({'back': 25.0}, 'joint 1 swings back 25 deg first'),
    ({'beyond': 31.0}, 'joint 1 goes 31 deg too far and returns'),
    ({'back': 25.0, 'beyond': 31.0},
     'joint 1 goes 31 deg too far and returns; joint 1 swings back 25 deg first'),
    ({'back': 45.0, 'beyond': 31.0, 'last': True},
     'joint 1 swings back 45 deg behind its start; joint 1 goes 31 deg too far and returns')],
    ids=str)
def test_swings_are_told_relative_to_the_stroke(stroke: float, swings: dict[str, float],
                                                words: str) -> None:
    assert describe_path(swing(stroke, **swings)[:, None]) == words  # type: ignore[arg-type]


def test_two_largest_swings_are_told() -> None:
    angles = np.stack([swing(60, back=20), swing(-50, beyond=80), swing(10, back=50)], axis=1)
    assert describe_path(angles) == (
        'joint 2 goes 80 deg too far and returns; joint 3 swings back 50 deg first')


def test_joint_that_ends_where_it_starts_may_swing() -> None:
    assert describe_path(swing(0.0, back=30.0)[:, None]) == 'joint 1 swings back 30 deg first'
