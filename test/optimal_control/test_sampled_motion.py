"""A solution at the points of its mesh."""

from __future__ import annotations

from factories import PlanFactory
from flex_planner.optimal_control.sampled_motion import sample_motion
import numpy as np
from plan_checks import solution_of
import pytest


@pytest.mark.parametrize('payload', [1.0, 5.5])
def test_points_are_those_of_the_plan(plan_of: PlanFactory, payload: float) -> None:
    plan = plan_of('ei50', payload)
    solution, n_t = solution_of(plan), plan.arm.n_coordinates
    points = sample_motion(plan.problem, solution)
    assert points.times.size == solution.intervals * (solution.rule.stages + 2)
    np.testing.assert_allclose(points.z, solution(points.times), rtol=0,
                               atol=1e-11 * np.abs(points.z).max())
    np.testing.assert_allclose(points.controls.torque, plan.sample(points.times).torques, rtol=0,
                               atol=1e-10)
    # a quadrature of the speed is the way
    way = points.weights @ points.z[:, n_t:2 * n_t]
    np.testing.assert_allclose(way, (plan.problem.goal - plan.problem.start)[:n_t], rtol=0,
                               atol=1e-9)


def test_points_of_the_last_solution_are_kept_and_cannot_be_changed(plan_of: PlanFactory) -> None:
    plan = plan_of('ei50')
    points = sample_motion(plan.problem, solution_of(plan))
    assert sample_motion(plan.problem, solution_of(plan)) is points
    with pytest.raises(ValueError, match='read-only'):
        points.z[0] = 0
