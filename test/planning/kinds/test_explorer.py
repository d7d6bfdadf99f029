"""Motions of a rigid arm by IPOPT from a path, and their values on finer meshes."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory, TaskFactory
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectResult
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds import explorer as module
from flex_planner.planning.kinds.explorer import ExploredMotion, Explorer
from flex_planner.planning.kinds.paths import JointPath
from flex_planner.planning.kinds.search import starting_paths
from kinds_support import STANDS
from known_limits import HEAVIEST, lifted_to, SHORTEST
import numpy as np
from plan_checks import problem_of
import pytest


@pytest.fixture(scope='module')
def problem(rigid_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(rigid_model, paper_task(rigid_model.arm))


def straight(problem: MotionProblem) -> JointPath:
    return next(starting_paths(problem, 1))


def explored(problem: MotionProblem, free: Free) -> tuple[Explorer, ExploredMotion]:
    """Return an explorer and the motion that the straight path leads to."""
    explorer = Explorer(problem, free, Monitor())
    [motion] = explorer.explore([straight(problem)])
    assert motion is not None
    return explorer, motion


def confirmed(problem: MotionProblem, free: Free) -> ExploredMotion | None:
    explorer, motion = explored(problem, free)
    return explorer.confirm(motion)


def test_values_are_those_of_newtons_method(problem: MotionProblem,
                                            plan_of: PlanFactory) -> None:
    cost, payload, duration = (confirmed(problem, free) for free in (
        Free.NOTHING, Free.PAYLOAD, Free.DURATION))
    assert cost is not None
    assert payload is not None
    assert duration is not None
    assert cost.value == pytest.approx(plan_of('rigid').cost, rel=1e-6)
    # at a finite price, a little less than the most and a little more than the least
    assert (1 - STANDS) * HEAVIEST['rigid'] < payload.value < HEAVIEST['rigid']
    assert SHORTEST['rigid'] < duration.value < (1 + STANDS) * SHORTEST['rigid']
    assert payload.problem.task.payload_mass == payload.value
    assert duration.problem.task.duration == duration.value
    assert (cost.price, cost.problem.task.payload_mass) == (0.0, 1.0)


def test_motion_is_a_start_for_newtons_method(problem: MotionProblem) -> None:
    _, motion = explored(problem, Free.NOTHING)
    result = Solver().solve(problem, motion.solution)
    assert result.converged, result.message
    assert result.iterations <= 6  # 12 from a straight line
    assert motion.angles.shape == (17, 2)
    np.testing.assert_allclose(motion.angles[[0, -1]], [problem.start[:2], problem.goal[:2]],
                               atol=1e-6)


@pytest.mark.parametrize('free', [Free.PAYLOAD, Free.DURATION])
def test_limits_do_not_depend_on_the_size_of_the_weights(
        rigid_model: ArmModel, paper_task: TaskFactory, free: Free) -> None:
    light, heavy = (explored(problem_of(rigid_model, paper_task(
        rigid_model.arm, effort_weights=[R, R])), free)[1] for R in (1 / 80, 10.0))
    # IPOPT's tolerance is that of a comparison
    assert heavy.value == pytest.approx(light.value, rel=1e-3)
    assert heavy.price == pytest.approx(800 * light.price)


# Coarse meshes lie


def lie(monkeypatch: pytest.MonkeyPatch, values: dict[int, float]) -> None:
    """Let values depend on the intervals of the mesh."""
    true = Explorer._motion

    def motion(self: Explorer, found: DirectResult) -> ExploredMotion | None:
        here = true(self, found)
        return here and replace(here, value=values[here.solution.intervals])

    monkeypatch.setattr(Explorer, '_motion', motion)


@pytest.mark.parametrize(('values', 'value', 'intervals'), [
    ({24: 9.0, 48: 8.95}, 8.95, 48), ({24: 9.0, 48: 6.0, 96: 5.97}, 5.97, 96),
    ({24: 5.0, 48: 6.0, 96: 6.1, 192: 6.15}, 6.15, 192)], ids=str)
def test_value_counts_once_it_stands_on_a_mesh_twice_as_fine(
        monkeypatch: pytest.MonkeyPatch, problem: MotionProblem, values: dict[int, float],
        value: float, intervals: int) -> None:
    lie(monkeypatch, values)
    motion = confirmed(problem, Free.PAYLOAD)
    assert motion is not None
    assert (motion.value, motion.solution.intervals) == (value, intervals)


def test_value_that_falls_on_every_mesh_is_none(monkeypatch: pytest.MonkeyPatch,
                                                problem: MotionProblem) -> None:
    lie(monkeypatch, {24: 9.0, 48: 8.0, 96: 7.0, 192: 6.0})
    assert confirmed(problem, Free.PAYLOAD) is None


def test_motion_that_a_finer_mesh_does_not_have_is_none(monkeypatch: pytest.MonkeyPatch,
                                                        problem: MotionProblem) -> None:
    explorer, motion = explored(problem, Free.PAYLOAD)
    monkeypatch.setattr(Explorer, '_motion', lambda self, found: None)
    assert explorer.confirm(motion) is None


def test_payload_of_a_mesh_that_misses_the_switches_is_put_right(
        monkeypatch: pytest.MonkeyPatch, problem: MotionProblem) -> None:
    monkeypatch.setattr(module, '_LIMIT_INTERVALS', 3)
    explorer, coarse = explored(problem, Free.PAYLOAD)
    fine = explorer.confirm(coarse)
    assert fine is not None
    assert coarse.value < (1 - STANDS) * HEAVIEST['rigid']
    assert (1 - STANDS) * HEAVIEST['rigid'] < fine.value < HEAVIEST['rigid']


def test_no_mesh_is_larger_than_allowed(problem: MotionProblem) -> None:
    seen: list[int] = []
    monitor = Monitor(report=lambda progress: seen.append(progress.intervals))
    explorer = Explorer(problem, Free.PAYLOAD, monitor, most_intervals=20)
    [motion] = explorer.explore([straight(problem)])
    assert motion is not None
    assert explorer.confirm(motion) is None  # 40 intervals are not allowed
    assert set(seen) == {20}


# Bounds, and stopped


def test_payload_is_at_most_what_is_of_use() -> None:
    # what the motor can hold at the goal is carried with time to spare
    problem = problem_of(ArmModel.of((task := lifted_to(0.0, 2.0)).arm), task)
    explorer = Explorer(problem, Free.PAYLOAD, Monitor(), most_payload=0.3)
    [motion] = explorer.explore([straight(problem)])
    assert motion is not None
    assert motion.value == pytest.approx(0.3, rel=1e-3)
    assert problem.model.arm.link_mass == pytest.approx(0.3)


@pytest.mark.parametrize('free', Free)
def test_exploration_is_stopped(problem: MotionProblem, free: Free) -> None:
    monitor = Monitor()
    explorer = Explorer(problem, free, monitor)
    monitor.canceled = lambda: monitor.iteration >= 3
    with pytest.raises(StoppedError):
        list(explorer.explore([straight(problem)]))
    assert monitor.iteration == 3


def test_confirmation_is_stopped(problem: MotionProblem) -> None:
    monitor = Monitor()
    explorer = Explorer(problem, Free.PAYLOAD, monitor)
    [motion] = explorer.explore([straight(problem)])
    assert motion is not None
    monitor.time_limit = -1.0
    with pytest.raises(StoppedError):
        explorer.confirm(motion)
