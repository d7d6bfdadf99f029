"""Via points of a task, and what holds where a motion passes them."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from flex_planner.base.errors import InvalidTaskError, InvalidValueError, UnreachableError
from flex_planner.collocation import GaussRule
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.free_duration import FreeDurationProblem
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.optimal_control.free_via_times import FreeViaTimesProblem
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.paper.cases import paper_arm, point_to_point
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]
POINT = ViaPoint(point=[0.4, 0.25])
ANGLES = ViaPoint(positions=[1.2, -2.2], time=0.5)


def task(*vias: ViaPoint, rigidity: float = math.inf) -> Task:
    return replace(point_to_point(paper_arm(rigidity, 1), 1.0), via_points=vias)


def problem_of(*vias: ViaPoint, rigidity: float = 50.0) -> MotionProblem:
    asked = task(*vias, rigidity=rigidity)
    return MotionProblem(ArmModel.of(asked.arm), asked, task_parameters(asked))


@pytest.mark.parametrize(('fields', 'sentence'), [
    ({}, 'positions and point is .neither.'),
    ({'positions': [1.0], 'point': [1.0, 0.0]}, 'positions and point is .both.'),
    ({'positions': 'a'}, 'positions is .* a list of numbers'),
    ({'positions': [[1.0, 2.0]]}, 'positions has an array of 2 axes'),
    ({'point': [1.0, 0.0], 'time': 0.0}, 'time is 0.0, but must be a number > 0 s'),
    ({'point': [1.0, 0.0], 'time': math.nan}, 'time is nan')])
def test_a_via_point_that_makes_no_sense_is_refused(fields: dict[str, Any],
                                                    sentence: str) -> None:
    with pytest.raises(InvalidValueError, match=sentence):
        ViaPoint(**fields)


@pytest.mark.parametrize(('vias', 'sentence'), [
    ([ViaPoint(positions=[1.0])], r'via_points\[0\].positions'),
    ([ViaPoint(positions=[math.nan, math.nan], time=0.5)], 'NaN for some of the joints'),
    ([ViaPoint(positions=[math.inf, 1.0])], 'NaN for some of the joints'),
    ([ViaPoint(positions=[200.0, 1.0])], r'via_points\[0\].positions\[0\] is 200'),
    ([ViaPoint(point=[0.4])], r'via_points\[0\].point'),
    ([ViaPoint(positions=[1.0, math.nan])], r'via_points\[0\].time is .left out'),
    ([replace(POINT, time=1.0)], r'via_points\[0\].time is 1.0, but must be from 0.001 to 0.999'),
    ([POINT, replace(POINT, time=0.5), replace(POINT, time=0.4)],
     r'via_points\[2\].time is 0.4, but must be from 0.501 to 0.999 s'),
    ([POINT] * 101, 'via_points is 101, but must be at most 100'),
    ([3], r'via_points\[0\] is 3, but must be a ViaPoint')])
def test_a_task_refuses_via_points_that_do_not_go_with_it(vias: list[Any],
                                                          sentence: str) -> None:
    with pytest.raises(InvalidValueError, match=sentence):
        task(*vias)


def test_a_via_point_out_of_reach_or_beyond_a_joint_limit_is_refused() -> None:
    with pytest.raises(UnreachableError, match=r'via_points\[0\].point: .*the arm reaches'):
        task(ViaPoint(point=[3.0, 0.0]))
    arm = paper_arm(math.inf)
    limited = replace(arm, joints=tuple(replace(joint, lower_limit=-2.3) for joint in arm.joints))
    asked = {'via_points': (ViaPoint(positions=[1.0, -2.5], time=0.5),)}
    with pytest.raises(InvalidValueError, match=r'via_points\[0\].positions\[1\] is -2.5'):
        replace(point_to_point(limited, 1.0), **asked)


def test_a_free_duration_has_no_via_points() -> None:
    with pytest.raises(InvalidValueError, match='time_weight is 1.0, but must be 0'):
        replace(task(ANGLES), time_weight=1.0)
    with pytest.raises(InvalidTaskError, match='via points must be given'):
        FreeDurationProblem(problem_of(ANGLES), 1.0)


def test_free_times_are_guessed_between_given_ones_and_stretched_with_the_duration() -> None:
    problem = problem_of(POINT, ANGLES, POINT)
    times = problem.junctions
    assert 0 < times[0] < times[1] == 0.5 < times[2] < 1
    longer = problem.with_changes(duration=2.0)
    assert longer.junctions == pytest.approx([2 * times[0], 0.5, 2 * times[2]])


def test_the_straight_line_passes_via_points() -> None:
    problem = problem_of(ANGLES)
    guess = problem.straight_line(10, GaussRule.of(4))
    assert guess.junctions == pytest.approx([0.5], abs=0)
    for state in (guess.before(np.array([0.5])), guess(np.array([0.5]))):
        assert state[0, :2] == pytest.approx(ANGLES.positions)


def differences(join: Any, before: Array, after: Array) -> Array:
    """Return the derivatives of what does not hold at a via point, by differences."""
    both, m = np.concatenate([before, after]), before.size
    steps = 1e-6 * np.eye(2 * m)
    gaps = [[join(0, *np.split(both + side * step, 2))[0] for side in (1, -1)] for step in steps]
    return np.stack([(above - below) / 2e-6 for above, below in gaps], axis=1)


@pytest.mark.parametrize('via', [POINT, ANGLES, ViaPoint(positions=[math.nan, -2.2], time=0.4)])
@pytest.mark.parametrize('free', ['nothing', 'payload', 'times'])
def test_rows_at_a_via_point_are_derivatives(via: ViaPoint, free: str) -> None:
    motion = problem_of(via)
    problem: Any = {'nothing': lambda: motion, 'payload': lambda: FreePayloadProblem(motion, 10.0),
                    'times': lambda: FreeViaTimesProblem(motion)}[free]()
    random = np.random.default_rng(1)
    before, after = random.uniform(0.2, 1.0, (2, problem.size))
    after[:motion.size // 2] = before[:motion.size // 2]
    residual, rows = problem.join(0, before, after)
    assert residual.shape == (problem.size,)
    expected = differences(problem.join, before, after)
    assert rows == pytest.approx(expected, rel=1e-4, abs=1e-5)


def test_rates_with_free_times_are_those_of_the_motion_and_compiled_alike() -> None:
    problem = FreeViaTimesProblem(problem_of(POINT))
    z = np.random.default_rng(2).uniform(0.2, 1.0, (3, problem.size))
    rate, jacobian = problem.rate_jacobian(np.zeros(3), z)
    assert rate == pytest.approx(problem.rate(np.zeros(3), z), rel=1e-12)
    steps = 1e-6 * np.eye(problem.size)
    slopes = np.stack([(problem.rate(np.zeros(3), z + step) - problem.rate(np.zeros(3), z - step))
                       / 2e-6 for step in steps], axis=-1)
    assert jacobian == pytest.approx(slopes, rel=1e-4, abs=1e-4 * np.abs(slopes).max())
    functions = problem.motion.model
    compiled = functions._load_optimality('free_times_jacobian')(z, problem.motion.p)
    assert compiled[0] == pytest.approx(rate, rel=1e-10)
    assert compiled[1] == pytest.approx(jacobian, rel=1e-9, abs=1e-9 * np.abs(jacobian).max())
    explicit = jacobian[:, problem.explicit[:, None], problem.explicit]
    assert np.abs(explicit[0] @ explicit[1]).max() == 0
