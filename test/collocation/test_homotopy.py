"""From a problem that is easy to the one that is asked, in steps that grow or shrink."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bvp_problems import second_order, System
from factories import PlanFactory, TaskFactory
from flex_planner.base.progress import Monitor
from flex_planner.collocation import (
    CollocationSolution,
    follow_homotopy,
    Solver,
    SolverSettings,
    SolverStatus,
)
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.totals import integrate_totals
import numpy as np
from plan_checks import problem_of, SAME_COST, solution_of
import pytest


def heavier(model: ArmModel, task: Task, last: float,
            shares: list[float]) -> Callable[[float], MotionProblem]:
    """Return motions with payloads up to the last, which notes what is asked."""
    def at(share: float) -> MotionProblem:
        shares.append(share)
        mass = task.payload_mass + share * (last - task.payload_mass)
        return problem_of(model, replace(task, payload_mass=mass))

    return at


def test_homotopy_reaches_the_end_exactly_in_growing_steps(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    shares: list[float] = []
    problem_at = heavier(rigid_model, paper_task(rigid_model.arm), 5.5, shares)
    result = follow_homotopy(problem_at, solution_of(plan_of('rigid')), Solver(), 0.1)
    assert result.converged
    assert shares == pytest.approx([0.1, 0.3, 0.7, 1.0])
    cost = integrate_totals(problem_at(1.0), result.solution).cost
    assert cost == pytest.approx(plan_of('rigid', 5.5).cost, rel=SAME_COST)


def test_homotopy_to_where_nothing_is_says_how_far_it_came() -> None:
    # Bratu's y'' = -lambda exp(y) has solutions up to lambda = 3.5138307
    settings, shares = SolverSettings(), []

    def at(share: float) -> System:
        shares.append(share)
        return second_order(lambda t, y, v: -5 * share * np.exp(np.minimum(y, 300)), 0, 0)

    nothing = CollocationSolution.from_values(np.linspace(0, 1, 21), np.zeros((21, 2)),
                                              settings.rule)
    result = follow_homotopy(at, nothing, Solver(settings), first_step=1.0)
    assert result.status is not SolverStatus.CONVERGED
    assert shares[:2] == [1.0, 0.5]  # halved where it failed
    percent = float(result.message.rpartition(' at ')[2].removesuffix('% of the homotopy'))
    # where the last step, twice the smallest of 1/256 or less, failed; rounded to 0.1 %
    assert 3.5138307 / 5 - 5e-4 < percent / 100 < 3.5138307 / 5 + 2 / 256 + 5e-4


@pytest.mark.parametrize('last', [0, 3, 6])
def test_homotopy_is_stopped(rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory,
                             last: int) -> None:
    monitor = Monitor()
    monitor.canceled = lambda: monitor.iteration >= last
    problem_at = heavier(rigid_model, paper_task(rigid_model.arm), 9.0, [])
    result = follow_homotopy(problem_at, solution_of(plan_of('rigid')),
                             Solver(monitor=monitor), 0.2)
    assert (result.status, monitor.iteration) == (SolverStatus.CANCELED, last)
