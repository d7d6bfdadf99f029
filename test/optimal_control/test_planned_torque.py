"""The planned torque as a function of time."""

from __future__ import annotations

from collections.abc import Callable

from applied_torques import Case, every_case, torque_of
from factories import PlanFactory
from flex_planner.dynamics.integration import PiecewisePolynomial
from flex_planner.optimal_control.planned_torque import PlannedTorque
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.plan import Plan
import numpy as np
from plan_checks import solution_of


@every_case
def test_torque_is_that_of_the_plan(any_plan: Callable[[Case], Plan], case: Case) -> None:
    plan, torque = any_plan(case), torque_of(any_plan(case))
    solution = solution_of(plan)
    for times, tolerance in (
            # interpolated there; rounding, and where a switch cuts an interval, the polynomial
            (solution.mesh, 1e-12), (solution.stage_times().ravel(), 1e-8),
            # between, to the order of the polynomials
            (np.linspace(0, plan.task.duration, 1001), 1e-6)):
        found = np.array([torque(time) for time in times])
        np.testing.assert_allclose(found, plan.sample(times).torques, rtol=0, atol=tolerance)


@every_case
def test_torque_stays_within_its_bounds(any_plan: Callable[[Case], Plan], case: Case) -> None:
    plan, torque = any_plan(case), torque_of(any_plan(case))
    times = np.linspace(0, plan.task.duration, 2001)
    found = np.array([torque(time) for time in times])
    n_t = plan.arm.n_coordinates
    lower, upper = TorqueLimits.of(plan.arm).bounds(solution_of(plan)(times)[:, n_t:n_t + 2])
    # the speeds between the collocation points, to the order of the polynomials
    assert (found <= upper + 1e-6).all()
    assert (found >= lower - 1e-6).all()


def test_bounds_hold_for_any_free_torque() -> None:
    breaks, theta = np.array([0.0, 1.0]), np.array([0.0, 1.0])
    values = np.array([[[-50.0, 0.5], [50.0, 0.5]]])  # a free torque and a speed
    torque = PlannedTorque(PiecewisePolynomial.through(breaks, theta, values),
                           TorqueLimits(np.array([8.0]), np.array([2.0]), np.array([np.inf])))
    found = [torque(time)[0] for time in (0.0, 0.45, 0.5, 0.52, 1.0)]
    np.testing.assert_allclose(found, [-9, -5, 0, 2, 7], atol=1e-12)
    assert np.array_equal(
        torque.within(0, torque.pieces.basis(np.array([0.0, 1.0])))[:, 0], [-9, 7])


def test_pieces_end_where_a_motor_switches(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid', 5.5)
    breaks = torque_of(plan).pieces.breaks
    gaps = np.abs(plan.switching_times[:, None] - breaks).min(axis=1)
    assert gaps.size > 1
    assert gaps.max() < 1e-9
    assert (np.diff(breaks) > 0).all()
    assert breaks[[0, -1]].tolist() == [0, 1]
