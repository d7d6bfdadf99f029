"""From kinds of the rigid arm to exact motions at their price, and to a front before them."""

from __future__ import annotations

from dataclasses import replace

from factories import TaskFactory
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds import lift as module
from flex_planner.planning.kinds.clusters import kind_of, KindOfMotion
from flex_planner.planning.kinds.lift import solve_best_kind, walk_back
from flex_planner.planning.kinds.search import find_kinds
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.free_parameters import DURATION, FreeParameter, PAYLOAD
from known_limits import HEAVIEST, SHORTEST
import numpy as np
from plan_checks import problem_of
import pytest

COARSE = Solver().coarse()


@pytest.fixture(scope='module')
def rigid(rigid_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(rigid_model, paper_task(rigid_model.arm))


@pytest.fixture(scope='module')
def flexible(ei5_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(ei5_model, paper_task(ei5_model.arm))


@pytest.fixture(scope='module')
def kinds(rigid: MotionProblem) -> dict[Free, KindOfMotion]:
    """Return the best kind of the rigid arm for each limit."""
    return {free: find_kinds(rigid, free, 2, Solver())[0] for free in (Free.PAYLOAD,
                                                                       Free.DURATION)}


def solved(parameter: FreeParameter, problem: MotionProblem, kind: KindOfMotion,
           solver: Solver = COARSE) -> Extremal:
    found = solve_best_kind(parameter, parameter.easiest(problem), [kind], solver)
    assert found is not None
    return found


def test_rigid_motion_at_the_price_of_its_kind_is_solved(
        rigid: MotionProblem, kinds: dict[Free, KindOfMotion]) -> None:
    for parameter, limit in ((PAYLOAD, HEAVIEST['rigid']), (DURATION, SHORTEST['rigid'])):
        kind = kinds[parameter.unknown]
        found = solved(parameter, rigid, kind)
        assert found.result.converged
        assert found.price == kind.motion.price
        assert found.value == pytest.approx(kind.value, rel=1e-3)
        # the limit is between the value and what its gap leaves
        ends = (found.value, found.value + (1 if parameter is PAYLOAD else -1) * found.gap)
        assert min(ends) < limit < max(ends)


def test_rigid_motion_that_its_price_does_not_lead_to_is_solved_with_a_little_less(
        rigid: MotionProblem, kinds: dict[Free, KindOfMotion],
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, 'transfer_extremal', lambda *_: None)
    for parameter, limit in ((PAYLOAD, HEAVIEST['rigid']), (DURATION, SHORTEST['rigid'])):
        kind = kinds[parameter.unknown]
        found = solved(parameter, rigid, kind)
        assert found.result.converged
        assert parameter.improves(kind.value, found.value)
        assert found.value == pytest.approx(kind.value, rel=6e-3)
        assert parameter.value(found.problem) == found.value
        # its own price leads on to the limit
        assert 0 < found.price < kind.motion.price
        ends = (found.value, found.value + (1 if parameter is PAYLOAD else -1) * found.gap)
        assert min(ends) < limit < max(ends)


def test_rigid_motion_is_lifted_to_the_arm_that_bends(
        flexible: MotionProblem, kinds: dict[Free, KindOfMotion]) -> None:
    for parameter, limit in ((PAYLOAD, HEAVIEST['ei5']), (DURATION, SHORTEST['ei5'])):
        found = solved(parameter, flexible, kinds[parameter.unknown])
        assert found.result.converged
        assert found.problem.model is flexible.model
        assert found.value == pytest.approx(limit, rel=0.02)
        assert parameter.improves(limit, found.value)


def test_no_kinds_lead_to_no_motion(rigid: MotionProblem, flexible: MotionProblem) -> None:
    for problem in (rigid, flexible):
        assert solve_best_kind(PAYLOAD, problem, [], COARSE) is None


@pytest.mark.parametrize(('parameter', 'share'), [(PAYLOAD, 1.05), (DURATION, 0.95)])
def test_kind_whose_value_newtons_method_does_not_reach_is_passed_over(
        rigid: MotionProblem, kinds: dict[Free, KindOfMotion], parameter: FreeParameter,
        share: float) -> None:
    true = kinds[parameter.unknown]
    false = kind_of(replace(true.motion, value=share * true.value))
    easiest = parameter.easiest(rigid)
    assert solve_best_kind(parameter, easiest, [false], COARSE) is None
    second = solve_best_kind(parameter, easiest, [false, true], COARSE)
    assert second is not None
    assert second.value == pytest.approx(true.value, rel=1e-3)


@pytest.mark.parametrize(('values', 'best_at'), [((4.0, 5.0, 6.0), 1), ((5.0, 4.0, 6.0), 0)])
def test_best_of_two_lifted_motions_is_taken(
        monkeypatch: pytest.MonkeyPatch, flexible: MotionProblem,
        kinds: dict[Free, KindOfMotion], values: tuple[float, ...], best_at: int) -> None:
    kind = kinds[Free.PAYLOAD]
    best = solved(PAYLOAD, flexible, kind)
    lifted = [replace(best, value=value) for value in values]
    turn = iter(lifted)
    monkeypatch.setattr(module, '_lift', lambda *rest: next(turn))
    found = solve_best_kind(PAYLOAD, flexible, [kind] * 3, COARSE)
    assert found is lifted[best_at]  # the third one is not tried


def test_interrupted_motion_says_so(rigid: MotionProblem, flexible: MotionProblem,
                                    kinds: dict[Free, KindOfMotion]) -> None:
    stopped = Solver(monitor=Monitor(time_limit=-1.0)).coarse()
    for problem in (rigid, flexible):
        try:
            found = solve_best_kind(PAYLOAD, problem, [kinds[Free.PAYLOAD]], stopped)
        except StoppedError:  # where no test before has had the core of that size compiled
            continue
        assert found is None or found.interrupted


# The front


def test_front_before_a_limit_is_walked_back(rigid: MotionProblem,
                                             kinds: dict[Free, KindOfMotion]) -> None:
    for parameter, least in ((PAYLOAD, 0.5), (DURATION, 2.0)):
        known = solved(parameter, rigid, kinds[parameter.unknown])
        front = [*walk_back(parameter, known, least, COARSE), known]
        assert 3 <= len(front) <= 7
        np.testing.assert_allclose([one.price for one in front],
                                   known.price / 4.0**np.arange(len(front))[::-1])
        assert all(parameter.improves(one.value, other.value)
                   for one, other in zip(front[1:], front[:-1], strict=True))
        assert all(parameter.improves(one.value, least) for one in front)
        assert all(one.result.converged for one in front)


def test_front_ends_where_it_may_begin(rigid: MotionProblem,
                                       kinds: dict[Free, KindOfMotion]) -> None:
    known = solved(PAYLOAD, rigid, kinds[Free.PAYLOAD])
    front = walk_back(PAYLOAD, known, 0.0, COARSE)
    values = [one.value for one in front]
    for i, value in enumerate(values):
        assert len(walk_back(PAYLOAD, known, value, COARSE)) == len(values) - i - 1


def test_front_of_an_arm_that_bends_is_not_walked(flexible: MotionProblem,
                                                  kinds: dict[Free, KindOfMotion]) -> None:
    known = solved(PAYLOAD, flexible, kinds[Free.PAYLOAD])
    assert walk_back(PAYLOAD, known, 0.0, COARSE) == []


def test_walk_is_interrupted(rigid: MotionProblem, kinds: dict[Free, KindOfMotion]) -> None:
    known = solved(PAYLOAD, rigid, kinds[Free.PAYLOAD])
    stopped = Solver(monitor=Monitor(time_limit=-1.0)).coarse()
    assert walk_back(PAYLOAD, known, 0.0, stopped) == []
