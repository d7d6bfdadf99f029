"""Payloads that grow and durations that fall at a rising price: reached, and priced."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
import math

from factories import model_of, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import solve, Solver, SolverSettings, SolverStatus
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.free_parameters import DURATION, FreeParameter, PAYLOAD
from flex_planner.planning.strategies.initial_guesses import cold_start
from flex_planner.planning.strategies.price_continuation import continue_in_price
from known_limits import HEAVIEST, lifted_to, one_link, SHORTEST
import numpy as np
from plan_checks import costates, problem_of, share_of, solution_of
import pytest

EXACT = SolverSettings(error_tolerance=1e-8)
# a hundredth of the error that is asked for on the way to a limit
WAY = 1e-6


def extremals_of(parameter: FreeParameter, problem: MotionProblem,
                 share: float = 1e-5) -> list[Extremal]:
    """Return the extremals until one changes the value by less than a share."""
    first = cold_start(problem, Solver()).result
    extremals: list[Extremal] = []
    for extremal in continue_in_price(parameter, problem, first, Solver()):
        extremals.append(extremal)
        if len(extremals) > 1 and abs(extremal.value / extremals[-2].value - 1) < share:
            break
    return extremals


# Reached


@pytest.mark.parametrize('name', HEAVIEST)
def test_payload_grows_to_the_heaviest(request: pytest.FixtureRequest, paper_task: TaskFactory,
                                       name: str) -> None:
    model = model_of(request, name)
    extremals = extremals_of(PAYLOAD, problem_of(model, paper_task(model.arm)))
    assert extremals[-1].value == pytest.approx(HEAVIEST[name], rel=2e-5)
    assert extremals[-1].value == pytest.approx({'rigid': 5.855, 'ei5': 5.742}[name], abs=1e-3)
    assert all(np.diff([1.0, *(one.value for one in extremals)]) > 0)
    assert all(np.diff([one.price for one in extremals]) > 0)
    assert all(one.result.converged for one in extremals)
    assert len(extremals) < 10


@pytest.mark.parametrize('name', SHORTEST)
def test_duration_falls_to_the_shortest(request: pytest.FixtureRequest, paper_task: TaskFactory,
                                        name: str) -> None:
    model = model_of(request, name)
    extremals = extremals_of(DURATION, problem_of(model, paper_task(model.arm)))
    assert extremals[-1].value == pytest.approx(SHORTEST[name], rel=2e-5)
    assert all(np.diff([1.0, *(one.value for one in extremals)]) < 0)
    assert all(np.diff([one.price for one in extremals]) > 0)
    assert all(one.result.solution.mesh[-1] == pytest.approx(one.value) for one in extremals)
    assert len(extremals) < 12


def test_limits_of_one_link_have_their_closed_form() -> None:
    # bang-bang: u_max T^2 = 4 M d
    T, u_max, d = 2.0, 2.0, 0.5
    model = ArmModel(one_link(T).arm)
    extremals = extremals_of(PAYLOAD, problem_of(model, one_link(T)))
    assert extremals[-1].value == pytest.approx(u_max * T**2 / (4 * d) - 1, rel=1e-5)
    extremals = extremals_of(DURATION, problem_of(model, one_link(T, payload_mass=0.5)))
    assert extremals[-1].value == pytest.approx(2 * math.sqrt(1.5 * d / u_max), rel=1e-5)


def test_motion_without_limits_has_none() -> None:
    # J = 6 M^2 d^2 / T^3: M is proportional to the price, which is 0.375 without payload
    task = replace(one_link(2.0), arm=Arm(
        name='free', links=(Link(length=1.0, linear_density=3.0),), joints=(Joint(),)))
    problem = problem_of(ArmModel(task.arm), task)
    first = cold_start(problem, Solver()).result
    search = continue_in_price(PAYLOAD, problem, first, Solver())
    extremals = list(islice(search, 4))
    np.testing.assert_allclose([one.value for one in extremals],
                               [one.price / 0.375 - 1 for one in extremals], rtol=WAY)
    assert extremals[-1].value > 1e4
    assert all(one.gap == math.inf for one in extremals)


def test_payload_tried_on_the_way_may_be_too_heavy_to_hold() -> None:
    task = lifted_to(0.0, 2.0)
    # 0.46 kg are the most that the motor holds at the goal
    assert extremals_of(PAYLOAD, problem_of(ArmModel(task.arm), task))[-1].value <= 0.4617


def test_payload_of_an_iterate_may_be_too_heavy_for_the_links(crane_model: ArmModel,
                                                              crane_task: Task) -> None:
    problem = problem_of(crane_model, crane_task)
    first = cold_start(problem, Solver()).result
    search = continue_in_price(PAYLOAD, problem, first, Solver())
    # steps that lead there fail, and nothing is raised
    values = [one.value for one in islice(search, 4)]
    assert values == sorted(values)


# Priced


@pytest.mark.parametrize('name', HEAVIEST)
def test_price_of_an_extremal_is_what_more_payload_costs(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str) -> None:
    model, h = model_of(request, name), 1e-3
    extremals = extremals_of(PAYLOAD, problem_of(model, paper_task(model.arm)), share=0.2)
    extremal = next(one for one in extremals if one.value > 5)
    assert extremal.value < 5.8  # both motors saturate
    start = plan_path(paper_task(model.arm, extremal.value), model=model, solver=Solver(EXACT))
    costs = [plan_path(paper_task(model.arm, extremal.value + k * h), model=model,
                       solver=Solver(EXACT),
                       start_from=start).cost for k in (-2, -1, 1, 2)]
    assert np.array([1, -8, 8, -1]) @ costs / (12 * h) == pytest.approx(extremal.price, rel=WAY)
    assert share_of(start.problem, solution_of(start)) == pytest.approx(extremal.price, rel=WAY)


@pytest.mark.parametrize('name', SHORTEST)
def test_price_of_an_extremal_is_what_less_time_costs(
        request: pytest.FixtureRequest, paper_task: TaskFactory, name: str) -> None:
    model, h = model_of(request, name), 5e-4
    extremals = extremals_of(DURATION, problem_of(model, paper_task(model.arm)), share=0.2)
    extremal = next(one for one in extremals if one.value < 0.8)
    costs = [plan_path(paper_task(model.arm, duration=extremal.value + k * h), model=model,
                       solver=Solver(EXACT)).cost for k in (-2, -1, 1, 2)]
    assert np.array([-1, 8, -8, 1]) @ costs / (12 * h) == pytest.approx(extremal.price, rel=1e-5)


@pytest.fixture(scope='module')
def crane_task(crane_arm: Arm) -> Task:
    """Return a motion whose payload bends the links at both ends."""
    return Task(arm=crane_arm, start_positions=[-1.6, 0.2], goal_positions=[-1.2, -0.2],
                duration=1.0, payload_mass=0.2)


@pytest.fixture(scope='module')
def crane_plan(crane_model: ArmModel, crane_task: Task) -> Plan:
    return plan_path(crane_task, model=crane_model, solver=Solver(EXACT))


def test_price_under_gravity_counts_how_the_payload_bends_the_ends(crane_plan: Plan) -> None:
    h, task, model = 4e-3, crane_plan.task, crane_plan.model
    near = {k: replace(task, payload_mass=task.payload_mass + k * h) for k in (-2, -1, 1, 2)}
    costs = [plan_path(each, model=model, solver=Solver(EXACT), start_from=crane_plan).cost
             for each in near.values()]
    price = np.array([1, -8, 8, -1]) @ costs / (12 * h)
    less, more = (problem_of(model, near[k]) for k in (-1, 1))
    start, goal = (more.start - less.start) / (2 * h), (more.goal - less.goal) / (2 * h)
    share = share_of(crane_plan.problem, solution_of(crane_plan))
    ends = costates(crane_plan, 0.0) @ start - costates(crane_plan, 1.0) @ goal
    assert price == pytest.approx(share + ends, rel=1e-6)
    assert price == pytest.approx(PAYLOAD.price(crane_plan.problem, solution_of(crane_plan)),
                                  rel=1e-6)
    assert abs(price - share) > 0.02


def test_payload_under_gravity_is_worth_its_effort_at_its_price(crane_plan: Plan) -> None:
    price = PAYLOAD.price(crane_plan.problem, solution_of(crane_plan))
    problem = FreePayloadProblem(crane_plan.problem, price)
    found = solve(problem, problem.extend(solution_of(crane_plan)), SolverSettings())
    assert found.converged
    assert problem.restrict(found.solution)[0] == pytest.approx(crane_plan.task.payload_mass,
                                                                rel=1e-6)
    assert found.iterations <= 3


def test_price_of_a_payload_raised_by_itself_counts_the_ends(crane_model: ArmModel,
                                                             crane_task: Task) -> None:
    # at the first extremals no step in price succeeds
    problem, h = problem_of(crane_model, crane_task), 2e-3
    first = cold_start(problem, Solver()).result
    extremal = next(continue_in_price(PAYLOAD, problem, first, Solver()))
    less, more = (plan_path(replace(crane_task, payload_mass=extremal.value + k),
                            model=crane_model, solver=Solver(EXACT)).cost for k in (-h, h))
    assert (more - less) / (2 * h) == pytest.approx(extremal.price, rel=1e-3)


# Stopped


@pytest.mark.parametrize('parameter', [PAYLOAD, DURATION], ids=lambda each: each.name)
def test_stopped_search_says_so_and_ends(rigid_model: ArmModel, paper_task: TaskFactory,
                                         parameter: FreeParameter) -> None:
    problem, monitor = problem_of(rigid_model, paper_task(rigid_model.arm)), Monitor()
    first = cold_start(problem, Solver(monitor=monitor)).result
    monitor.canceled = lambda: monitor.iteration >= 20
    extremals = list(continue_in_price(parameter, problem, first, Solver(monitor=monitor)))
    assert extremals[-1].result.status is SolverStatus.CANCELED
    assert all(one.result.converged for one in extremals[:-1])
    assert len(extremals) > 1


def test_links_that_buckle_with_hardly_more_payload_end_the_continuation(
        monkeypatch: pytest.MonkeyPatch, rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    def price(*motion: object) -> float:
        raise NoEquilibriumError('no static equilibrium')

    problem = problem_of(rigid_model, paper_task(rigid_model.arm))
    first = cold_start(problem, Solver()).result
    monkeypatch.setattr(PAYLOAD, 'price', price)
    assert list(continue_in_price(PAYLOAD, problem, first, Solver())) == []
