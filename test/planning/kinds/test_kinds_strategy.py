"""Kinds of motion as a strategy: what it starts from, and what it says where nothing leads on."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from factories import TaskFactory
from flex_planner.collocation import Solver, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds import kinds_strategy as module
from flex_planner.planning.kinds.clusters import KindOfMotion
from flex_planner.planning.kinds.explorer import ExploredMotion
from flex_planner.planning.kinds.kinds_strategy import as_guess, explore_kinds
from flex_planner.planning.strategies.strategy import Attempt
from kinds_support import made_up, made_up_kind
import numpy as np
from plan_checks import problem_of
import pytest

Fake = Callable[..., list[Free]]


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch, rigid_model: ArmModel, paper_task: TaskFactory) -> Fake:
    """Let explorations find kinds of given values, along a straight line; see what is asked."""
    twin = problem_of(rigid_model, paper_task(rigid_model.arm))

    def install(*, saturated: bool = False, **values: tuple[float, ...]) -> list[Free]:
        asked: list[Free] = []

        def find(problem: MotionProblem, free: Free, starts: int,
                 solver: Solver) -> list[KindOfMotion]:
            assert starts == 16
            asked.append(free)
            kinds = [made_up_kind(twin, value) for value in values.get(free.value, ())]
            for kind in kinds:
                kind.motion.solution.nodes[:, -2:] += 1e3 * saturated  # costates of the speeds
            return kinds

        def near(rigid: MotionProblem, solver: Solver) -> Iterator[ExploredMotion]:
            return (made_up(twin, value) for value in values.get('near', ()))

        monkeypatch.setattr(module, 'find_kinds', find)
        monkeypatch.setattr(module, 'explore_near_limit', near)
        return asked

    return install


def explored(model: ArmModel, task: TaskFactory, payload_mass: float = 1.0,
             iterations: int = 60, **changes: float) -> Attempt:
    problem = problem_of(model, task(model.arm, payload_mass, **changes))
    attempt = explore_kinds(problem, Solver().patient(iterations))
    assert attempt is not None
    return attempt


def test_kind_that_leads_to_a_solution_is_enough(fake: Fake, rigid_model: ArmModel,
                                                 paper_task: TaskFactory) -> None:
    asked = fake(motion=(0.65,))
    attempt = explored(rigid_model, paper_task)
    assert attempt.result.converged, attempt.result.message
    assert asked == [Free.NOTHING]
    assert ([kind.value for kind in attempt.kinds], attempt.starts) == ([0.65], 16)
    assert not (attempt.not_found or attempt.hopeless)


@pytest.mark.parametrize(('motions', 'saturated', 'first'), [
    ((0.65,), True, 0.5), ((0.65,), False, 0.65), ((0.65,) * 4, False, 0.65)], ids=str)
def test_where_few_starts_lead_to_a_motion_those_of_other_payloads_are_asked(
        fake: Fake, rigid_model: ArmModel, paper_task: TaskFactory, motions: tuple[float, ...],
        saturated: bool, first: float) -> None:
    # four of sixteen starts are a quarter; motors with room to spare are not near a limit
    fake(motion=motions, near=(0.5,), saturated=saturated)
    attempt = explored(rigid_model, paper_task)
    assert attempt.result.converged, attempt.result.message
    assert attempt.kinds[0].value == first


def test_motion_with_more_payload_is_a_start(fake: Fake, rigid_model: ArmModel,
                                             paper_task: TaskFactory) -> None:
    asked = fake(payload=(3.0, 0.5), duration=(0.64,))
    attempt = explored(rigid_model, paper_task)
    assert attempt.result.converged, attempt.result.message
    assert asked == [Free.NOTHING, Free.PAYLOAD]
    # that with less payload is none
    assert ([kind.value for kind in attempt.kinds], attempt.starts) == ([3.0], 32)


def test_rigid_motion_is_a_start_for_links_that_bend(fake: Fake, ei5_model: ArmModel,
                                                     paper_task: TaskFactory) -> None:
    fake(motion=(0.65,))
    attempt = explored(ei5_model, paper_task)
    assert attempt.result.converged, attempt.result.message
    assert attempt.result.solution.nodes.shape[1] == 24


def test_kinds_that_lead_to_no_solution_do_not_speak_against_it(
        fake: Fake, rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    fake(motion=(0.65,), payload=(5.8,), duration=(0.64,))
    attempt = explored(rigid_model, paper_task, iterations=1)
    assert attempt.result.status is SolverStatus.NEWTON_FAILED
    assert not (attempt.not_found or attempt.hopeless or attempt.decides)


def test_limits_found_beside_motions_of_the_task_do_not_speak_against_it(
        fake: Fake, rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    # an exploration of limits may end on a worse kind than the motions that were found
    asked = fake(motion=(0.65, 0.7), payload=(0.5,), duration=(2.194,))
    attempt = explored(rigid_model, paper_task, iterations=1)
    assert attempt.result.message.startswith(
        '2 kinds of motion were found from 32 starts on the arm made rigid, but none leads to a '
        'solution: ')
    assert 'no kind of motion was found' not in attempt.result.message
    assert Free.DURATION not in asked
    assert not (attempt.not_found or attempt.hopeless or attempt.decides)


def test_heavier_motions_alone_are_motions_that_were_found(
        fake: Fake, rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    fake(payload=(5.8,), duration=(0.64,))
    attempt = explored(rigid_model, paper_task, iterations=1)
    assert not (attempt.not_found or attempt.hopeless)


def not_found(rigid: ArmModel, task: TaskFactory, payload_mass: float,
              **changes: float) -> Attempt:
    """Explore a task that no made-up motion can do."""
    attempt = explored(rigid, task, payload_mass, **changes)
    assert attempt.result.status is SolverStatus.NEWTON_FAILED
    assert attempt.not_found
    return attempt


def test_nearest_limits_are_told(fake: Fake, rigid_model: ArmModel,
                                 paper_task: TaskFactory) -> None:
    fake(payload=(5.849, 3.0), duration=(1.648, 2.0))
    attempt = not_found(rigid_model, paper_task, 20.0)
    assert attempt.result.message == (
        'no motion with 20 kg in 1 s was found from 16 starts; the heaviest payload found in 1 s '
        'is 5.849 kg, the shortest duration found with 20 kg is 1.648 s. This does not show that '
        'there is none')
    assert attempt.hopeless
    assert attempt.decides


@pytest.mark.parametrize(('values', 'words'), [
    ({'duration': (0.6434,)}, 'the shortest duration found with 1 kg is 0.6434 s'),
    ({'payload': (0.5,)}, 'the heaviest payload found in 0.3 s is 0.5 kg'),
    ({}, 'nor near it')], ids=str)
def test_what_was_not_found_near_is_not_told(
        fake: Fake, rigid_model: ArmModel, paper_task: TaskFactory,
        values: dict[str, tuple[float, ...]], words: str) -> None:
    fake(**values)
    attempt = not_found(rigid_model, paper_task, 1.0, duration=0.3)
    assert attempt.result.message == (
        f'no motion with 1 kg in 0.3 s was found from 16 starts; {words}. This does not show '
        'that there is none')
    # without anything to compare with, nothing speaks against it
    assert attempt.hopeless == bool(values)


# of 20 kg in 1 s, with links of 6 kg: within 2 % for a rigid arm, 10 % for the twin of a flexible
@pytest.mark.parametrize(('payload', 'duration', 'rigid', 'flexible'), [
    (19.9, 1.01, False, False), (19.0, 1.01, True, False), (17.0, 1.01, True, True),
    (19.9, 1.03, True, False), (19.9, 1.2, True, True)])
def test_limits_that_are_near_do_not_speak_against_a_task(
        fake: Fake, rigid_model: ArmModel, ei5_model: ArmModel, paper_task: TaskFactory,
        payload: float, duration: float, rigid: bool, flexible: bool) -> None:
    fake(payload=(payload,), duration=(duration,))
    assert not_found(rigid_model, paper_task, 20.0).hopeless is rigid
    assert not_found(ei5_model, paper_task, 20.0).hopeless is flexible


def test_light_payload_is_near_if_it_is_near_by_the_mass_of_the_links(
        fake: Fake, rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    # in 0.6 s an exploration finds 0.5652 kg, and 0.5786 kg can be carried
    fake(payload=(0.5652,), duration=(0.601,))
    assert not not_found(rigid_model, paper_task, 0.577, duration=0.6, iterations=1).hopeless


def test_goal_at_a_price_is_not_explored(fake: Fake, rigid_model: ArmModel,
                                         paper_task: TaskFactory) -> None:
    asked = fake()
    task = paper_task(rigid_model.arm, goal_position_weights=[1e4, 1e4])
    assert explore_kinds(problem_of(rigid_model, task), Solver()) is None
    assert asked == []


def test_kind_is_stretched_and_lifted_to_a_guess(rigid_model: ArmModel, ei5_model: ArmModel,
                                                 paper_task: TaskFactory) -> None:
    kind = made_up_kind(problem_of(rigid_model, paper_task(rigid_model.arm)), 1.0)
    problem = problem_of(ei5_model, paper_task(ei5_model.arm, duration=3.0))
    guess = as_guess(problem, kind, Solver())
    assert (guess.mesh[-1], guess.nodes.shape[1]) == (3.0, problem.size)
    middle = kind.motion.solution(np.array([0.5]))[0, :2]
    np.testing.assert_allclose(guess(np.array([1.5]))[0, :2], middle, atol=1e-9)
