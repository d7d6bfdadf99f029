"""Homotopies in the weights and in the stiffness of the links."""

from __future__ import annotations

from typing import Any

from factories import PlanFactory, TaskFactory
from flex_planner.collocation import CollocationResult, solve, Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.strategies.homotopies import raise_weights
from plan_checks import problem_of, SAME_COST
import pytest


def test_large_weights_are_raised_from_none(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    weights: list[float] = []

    def watched(problem: MotionProblem, *rest: Any, **options: Any) -> CollocationResult:
        weights.append(float(problem.parameters.velocity_weights.max()))
        return solve(problem, *rest, **options)

    problem = problem_of(rigid_model, paper_task(rigid_model.arm, w_2=1400.0))
    attempt = raise_weights(problem, Solver(backend=watched))
    assert attempt is not None
    assert attempt.result.converged
    assert (weights[0], weights[-1]) == (0.0, 1400.0)
    assert 1 <= weights[1] <= 10
    assert weights == sorted(weights)  # no step failed
    assert integrate_totals(problem, attempt.result.solution).cost == pytest.approx(
        plan_of('rigid', 1.0, 1400.0).cost, rel=SAME_COST)
