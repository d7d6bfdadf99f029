"""The search over kinds: how many starts, when it has settled, and what is confirmed."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any

from bench.random_tasks import random_task, with_payload
from counter_examples import level_task
from factories import TaskFactory
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds import search as module
from flex_planner.planning.kinds.explorer import ExploredMotion
from flex_planner.planning.kinds.paths import JointPath
from flex_planner.planning.kinds.search import (
    explore_near_limit,
    find_kinds,
    has_settled,
    is_better,
    rigid_twin,
    starting_paths,
)
from kinds_support import made_up
from known_limits import pendulum
import numpy as np
from plan_checks import problem_of
import pytest

LESS = is_better(Free.NOTHING)


@pytest.fixture(scope='module')
def problem(rigid_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(rigid_model, paper_task(rigid_model.arm))


def test_more_payload_is_better_and_less_of_all_else() -> None:
    assert [is_better(free)(2.0, 1.0) for free in Free] == [False, True, False]
    assert [is_better(free)(1.0, 2.0) for free in Free] == [True, False, True]
    assert not any(is_better(free)(1.0, 1.0) for free in Free)


@pytest.mark.parametrize(('values', 'starts', 'settled'), [
    ([], 8, False), ([1.0, 1.0, 1.0], 7, False), ([1.0, 1.0, 1.0], 8, True),
    ([3.0, 2.0, 1.0, 1.005, 1.0], 9, True), ([3.0, 1.0, 1.0, 1.02], 12, False),
    ([1.0, 1.0, 2.0, 2.0, 2.0], 9, False)], ids=str)
def test_search_has_settled_once_the_best_value_came_three_times_in_eight_starts(
        problem: MotionProblem, values: list[float], starts: int, settled: bool) -> None:
    motions = [made_up(problem, value) for value in values]
    assert has_settled(motions, starts, LESS) is settled


def test_ipopt_needs_fewer_starts(problem: MotionProblem, fake: Fake) -> None:
    monitor = Monitor()
    fake(2.0, 1.0, 1.0, 1.0, 3.0, 0.5)
    find_kinds(problem, Free.NOTHING, 6, Solver(monitor=monitor))
    assert starts_of(monitor) == '5 of 6'


def test_best_payload_is_the_largest(problem: MotionProblem) -> None:
    motions = [made_up(problem, value) for value in (1.0, 1.0, 1.0, 2.0)]
    assert has_settled(motions, 8, LESS)
    assert not has_settled(motions, 8, is_better(Free.PAYLOAD))


def test_first_starts_are_the_same_for_more_of_them(problem: MotionProblem) -> None:
    few, many = (list(starting_paths(problem, count)) for count in (16, 48))
    assert (len(few), len(many)) == (16, 48)
    for one, other in zip(few, many[:16], strict=True):
        assert (one.detours == other.detours).all()


# The arm made rigid


def test_twin_of_a_rigid_arm_is_its_own_problem(problem: MotionProblem) -> None:
    assert rigid_twin(problem) is problem


def test_twin_of_a_flexible_arm_is_rigid(ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    twin = rigid_twin(problem_of(ei5_model, paper_task(ei5_model.arm, 2.0)))
    assert twin is not None
    assert (twin.model.arm.n_modes, twin.task.payload_mass, twin.task.duration) == (0, 2.0, 1.0)


@pytest.mark.parametrize('changes', [{'goal_position_weights': [1e4, np.inf]},
                                     {'goal_velocity_weights': [1e4, 1e4]}], ids=str)
def test_goal_at_a_price_has_no_twin_and_no_kinds(
        rigid_model: ArmModel, paper_task: TaskFactory, changes: dict[str, Any]) -> None:
    soft = problem_of(rigid_model, paper_task(rigid_model.arm, **changes))
    assert rigid_twin(soft) is None
    assert find_kinds(soft, Free.NOTHING, 16, Solver()) == []


# What is explored


class FakeExplorer:
    """Meets motions of given values in turn, and confirms them at others, or not at all."""

    values: tuple[float | None, ...] = ()
    confirmed: dict[float, float | None] = {}

    def __init__(self, problem: MotionProblem, *others: Any) -> None:
        self.problem, self.turn = problem, iter(self.values)

    def explore(self, paths: Sequence[JointPath],
                ) -> Generator[ExploredMotion | None, None, None]:
        for value, _ in zip(self.turn, paths, strict=False):
            yield None if value is None else self.made_up(value)

    def made_up(self, value: float) -> ExploredMotion:
        # motions of a value are alike
        straight = made_up(self.problem, value)
        bow = np.outer(np.sin(np.pi * np.linspace(0, 1, 17)), [0.0, value])
        return made_up(self.problem, value, straight.angles + bow)

    def confirm(self, motion: ExploredMotion) -> ExploredMotion | None:
        value = self.confirmed.get(motion.value, motion.value)
        return None if value is None else made_up(self.problem, value, motion.angles)


Fake = Callable[..., None]


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> Fake:
    """Let the search explore made-up motions."""
    def install(*values: float | None, confirmed: dict[float, float | None] | None = None) -> None:
        explorer = type('Fake', (FakeExplorer,), {'values': values, 'confirmed': confirmed or {}})
        monkeypatch.setattr(module, 'Explorer', explorer)

    return install


def starts_of(monitor: Monitor) -> str:
    return monitor.phase.removeprefix('kinds of motion, start ')


def test_exploration_for_a_plan_ends_once_it_has_settled(problem: MotionProblem,
                                                         fake: Fake) -> None:
    monitor = Monitor()
    fake(5.0, 3.0, None, 4.0, 3.0, 5.0, 5.0, 4.0, 3.0, 1.0, 1.0)
    kinds = find_kinds(problem, Free.NOTHING, 11, Solver(monitor=monitor))
    assert starts_of(monitor) == '9 of 11'
    assert [(kind.value, kind.met) for kind in kinds] == [(3.0, 3), (4.0, 2), (5.0, 3)]


@pytest.mark.parametrize('free', [Free.PAYLOAD, Free.DURATION])
def test_exploration_for_a_limit_takes_all_starts(problem: MotionProblem, fake: Fake,
                                                  free: Free) -> None:
    monitor = Monitor()
    fake(5.0, 5.0, 5.0, 5.0, None, 3.0)
    kinds = find_kinds(problem, free, 6, Solver(monitor=monitor))
    assert starts_of(monitor) == '6 of 6'
    found = [(5.0, 4), (3.0, 1)]
    assert [(kind.value, kind.met) for kind in kinds] == (
        found if free is Free.PAYLOAD else found[::-1])


def test_value_that_a_finer_mesh_denies_loses_its_place(problem: MotionProblem,
                                                        fake: Fake) -> None:
    fake(9.0, 6.0, 5.0, 5.0, confirmed={9.0: None, 6.0: 4.0})
    kinds = find_kinds(problem, Free.PAYLOAD, 4, Solver())
    assert [(kind.value, kind.met) for kind in kinds] == [(5.0, 2), (4.0, 1)]


def test_no_more_kinds_are_confirmed_than_may_matter(problem: MotionProblem, fake: Fake) -> None:
    fake(9.0, 8.0, 7.0, 6.0, 5.0)
    kinds = find_kinds(problem, Free.PAYLOAD, 5, Solver())
    assert [kind.value for kind in kinds] == [9.0, 8.0, 7.0]
    # one that may be better than the worst of them is tried
    fake(9.0, 8.0, 7.0, 6.0, 5.0, confirmed={7.0: 5.5})
    kinds = find_kinds(problem, Free.PAYLOAD, 5, Solver())
    assert [kind.value for kind in kinds] == [9.0, 8.0, 6.0, 5.5]


def test_no_starts_are_no_kinds(problem: MotionProblem) -> None:
    monitor = Monitor()
    assert find_kinds(problem, Free.PAYLOAD, 0, Solver(monitor=monitor)) == []
    assert (monitor.iteration, monitor.phase) == (0, '')


def test_search_is_stopped(problem: MotionProblem) -> None:
    monitor = Monitor()
    monitor.canceled = lambda: starts_of(monitor) == '3 of 16'
    with pytest.raises(StoppedError):
        find_kinds(problem, Free.PAYLOAD, 16, Solver(monitor=monitor))
    assert starts_of(monitor) == '3 of 16'


# Motions that are known


def test_kinds_of_a_counter_example_are_found_with_their_names() -> None:
    task = level_task('S12')
    kinds = find_kinds(problem_of(ArmModel.of(task.arm), task), Free.PAYLOAD, 3, Solver())
    assert kinds[0].value == pytest.approx(1.97, abs=0.02)
    assert kinds[0].sentence.startswith('joint 2 swings back 4')
    assert sum(kind.met for kind in kinds) <= 3


def test_pendulum_whose_motor_is_too_weak_swings_back_first() -> None:
    arm = pendulum(3.0)
    task = Task(arm=arm, start_positions=[-np.pi / 2], goal_positions=[np.pi / 2], duration=2.4,
                payload_mass=0.3)
    (kind, *_) = find_kinds(problem_of(ArmModel.of(arm), task), Free.NOTHING, 16, Solver())
    assert kind.value == pytest.approx(3.9496, rel=1e-3)
    assert kind.sentence == 'joint 1 swings back 53 deg first'


def random_problem(seed: int, payload: float) -> MotionProblem:
    """Return one of the adversary's tasks, whose best motions straight starts hardly meet."""
    task = with_payload(random_task(seed), payload)
    return problem_of(ArmModel.of(task.arm), task)


def test_detours_from_good_motions_meet_what_straight_starts_seldom_do() -> None:
    # of 60 straight starts with random detours two met it, of the 16 first ones none
    kinds = find_kinds(random_problem(323, 0.0), Free.PAYLOAD, 16, Solver())
    assert kinds[0].value == pytest.approx(5.82, abs=0.02)
    assert kinds[0].value > 2 * kinds[1].value


def test_motions_near_the_largest_payload_come_from_those_of_other_payloads() -> None:
    # 3 of 60 starts led to a motion, and none of the fixed ones
    near = list(explore_near_limit(random_problem(318, 5.5907), Solver()))
    assert min(motion.value for motion in near) == pytest.approx(0.7692, rel=1e-3)
