"""The payload as an unknown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.collocation import Solver, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.free_payload import FreePayloadProblem, payload_price
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from free_problems import extended
import numpy as np
from plan_checks import share_of, solution_of
import pytest

CASES = ['rigid', 'ei5', 'crane']
every_case = pytest.mark.parametrize('name', CASES)


@every_case
def test_payload_is_added_and_taken_away(saturated: Callable[[str], Plan], name: str) -> None:
    made, solution = extended(saturated(name), FreePayloadProblem)
    assert isinstance(made, FreePayloadProblem)
    mass, after = made.restrict(solution)
    assert mass == saturated(name).task.payload_mass
    np.testing.assert_array_equal(after.nodes, solution_of(saturated(name)).nodes)
    np.testing.assert_array_equal(after.stages, solution_of(saturated(name)).stages)
    # nu gathers the share of the payload
    share = share_of(saturated(name).problem, solution_of(saturated(name)))
    assert solution.nodes[[0, -1], -1] == pytest.approx([0, -share], rel=1e-12)
    heavier = made.fix(0.3)
    assert (heavier.task.payload_mass, heavier.parameters.payload_mass) == (0.3, 0.3)
    assert heavier.p[0] == 0.3


def test_switches_know_the_payload_of_the_iterate(saturated: Callable[[str], Plan]) -> None:
    made, solution = extended(saturated('rigid'), FreePayloadProblem)
    heavier = solution.nodes.copy()
    heavier[:, -2] += 1
    assert not np.allclose(made.switches(solution.mesh, heavier),
                           made.switches(solution.mesh, solution.nodes))


def test_price_of_a_payload_counts_how_it_turns_the_joints_at_both_points(
        crane_model: ArmModel) -> None:
    task = Task.between_points(crane_model.arm, (0.1, -0.8), (0.3, -0.75), elbow=1, duration=1.2,
                               payload_mass=0.2)
    settings, h = SolverSettings(error_tolerance=1e-9), 1e-2
    plan = plan_path(task, model=crane_model, solver=Solver(settings))
    costs = [plan_path(replace(task, payload_mass=0.2 + k * h), model=crane_model,
                       solver=Solver(settings), start_from=plan).cost for k in (-2, -1, 1, 2)]
    slope = np.array([1, -8, 8, -1]) @ costs / (12 * h)  # of fourth order
    price = payload_price(plan.problem, solution_of(plan))
    assert price == pytest.approx(slope, rel=1e-6)
    # the ends are a part of it that shows
    assert abs(share_of(plan.problem, solution_of(plan)) / price - 1) > 0.01
