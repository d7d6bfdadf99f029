"""Whether a time is too short, as the interior-point method tells it."""

from __future__ import annotations

from factories import TaskFactory
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.search import find_kinds, starting_paths
from flex_planner.planning.kinds.shortest import seems_too_short
from plan_checks import problem_of
import pytest

# shortest with 1 kg and with none: 0.6421 and 0.5358 s
TOO_SHORT, ENOUGH, TOO_SHORT_FOR_1_KG = 0.5, 0.66, 0.6


@pytest.fixture(scope='module')
def problem(rigid_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(rigid_model, paper_task(rigid_model.arm, duration=TOO_SHORT_FOR_1_KG))


@pytest.mark.parametrize(('duration', 'too_short'), [
    (TOO_SHORT, True), (TOO_SHORT_FOR_1_KG, True), (ENOUGH, False)])
def test_times_below_the_shortest_seem_too_short(problem: MotionProblem, duration: float,
                                                 too_short: bool) -> None:
    asked = problem.with_changes(duration=duration)
    assert seems_too_short(asked, starting_paths(asked, 8), Solver()) is too_short


def test_few_paths_say_nothing(problem: MotionProblem) -> None:
    assert not seems_too_short(problem, starting_paths(problem, 2), Solver())


def test_it_is_stopped(problem: MotionProblem) -> None:
    with pytest.raises(StoppedError):
        seems_too_short(problem, starting_paths(problem, 8),
                        Solver(monitor=Monitor(canceled=lambda: True)))


def test_exploration_in_vain_ends_after_three_starts(problem: MotionProblem) -> None:
    phases = set[str]()
    monitor = Monitor(report=lambda progress: phases.add(progress.phase))
    hopeless = problem.with_changes(duration=TOO_SHORT)
    assert find_kinds(hopeless, Free.NOTHING, 16, Solver(monitor=monitor)) == []
    assert 'kinds of motion, start 3 of 16' in phases
    assert 'kinds of motion, start 4 of 16' not in phases
