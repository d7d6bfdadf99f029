"""Responses of differing arms, and the offset that they lead to."""

from __future__ import annotations

from flex_planner.arms.arm_files import load_arm
from flex_planner.collocation import Solver
from flex_planner.control.joint_controller import JointController
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.optimal_control.torque_offset import TorqueOffset
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.differing_plans import DifferingArms
from flex_planner.planning.robust.objective import Robustness
from flex_planner.planning.robust.responses import limits_in_force, Responses
from flex_planner.planning.robust.weighed_plan import WeighedPlan
import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline


@pytest.fixture(scope='module')
def plain(clamped_plan: Plan, controller: JointController) -> WeighedPlan:
    robustness = Robustness(max_residual=1e-3, controller=controller)
    return WeighedPlan.plain(clamped_plan, DifferingArms(clamped_plan, robustness), Solver())


@pytest.fixture(scope='module')
def other(plain: WeighedPlan) -> WeighedPlan:
    found = plain.solve(plain.linearise(), 1.0, Solver())
    assert found is not None
    return found


def test_responses_tell_what_a_change_of_the_torque_does(plain: WeighedPlan,
                                                         other: WeighedPlan) -> None:
    responses = Responses.of(plain.plan, plain.arrivals)
    change = (other.plan.sample(responses.times).torques
              - plain.plan.sample(responses.times).torques)
    predicted = np.einsum('gij,gj->i', responses.differing, change)
    happened = Responses.of(other.plan, other.arrivals).misses - responses.misses
    # linearised, in 200 steps: some percent
    assert np.linalg.norm(predicted - happened) < 0.1 * np.linalg.norm(happened)
    # both plans reach the goal
    moved = np.einsum('gij,gj->i', np.abs(responses.nominal), np.abs(change))
    assert (np.abs(np.einsum('gij,gj->i', responses.nominal, change)) < 0.02 * moved).all()


def test_predicted_misses_are_those_that_come_about(plain: WeighedPlan,
                                                    other: WeighedPlan) -> None:
    predicted = plain.linearise().predict_misses(1.0)
    happened = Responses.of(other.plan, other.arrivals).misses
    before = Responses.of(plain.plan, plain.arrivals).misses
    assert np.linalg.norm(predicted - happened) < 0.1 * np.linalg.norm(happened - before)


def test_found_offset_is_that_of_the_next_step(plain: WeighedPlan, other: WeighedPlan) -> None:
    """Once it is found, linearising again hardly changes it."""
    again = other.solve(other.linearise(), 1.0, Solver())
    assert again is not None
    # what the first step left out is of second order in a change of the cost of 0.16 %
    assert again.plan.cost == pytest.approx(other.plan.cost, rel=1e-4)
    assert again.residual == pytest.approx(other.residual, rel=0.01)


def test_weighted_energy_is_least_among_neighbours(plain: WeighedPlan,
                                                   other: WeighedPlan) -> None:
    """J + weight / 2 |misses|^2 of the plan is below that of plans with other weights."""
    def total(plan: WeighedPlan) -> float:
        misses = Responses.of(plan.plan, plan.arrivals).misses
        return plan.plan.cost + float(misses @ misses) / 2

    step = other.linearise()
    others = [other.solve(step, weight, Solver()) for weight in (0.5, 2.0)]
    found = [total(one) for one in others if one is not None]
    assert len(found) == 2
    assert total(other) < min(*found, total(plain))


def test_small_weight_changes_nothing(plain: WeighedPlan) -> None:
    step = plain.linearise()
    assert np.abs(step.wanted(1e-9)).max() < 1e-6
    assert step.predict_effort(1e-9, np.ones_like(step.offset)) == pytest.approx(0, abs=1e-6)


def test_limits_move_with_the_speed_where_they_hold() -> None:
    arm, move = load_arm('clamped_motors'), 1e-6
    limits, rng = TorqueLimits.of(arm), np.random.default_rng(5)
    asked, speeds = rng.uniform(-12, 12, (200, 2)), rng.uniform(-3, 3, (200, 2))
    inside, by_speed = limits_in_force(arm, asked, speeds)
    ahead, behind = (limits.bound(asked, speeds + sign * move) for sign in (1, -1))
    np.testing.assert_allclose(by_speed, (ahead - behind) / (2 * move), atol=1e-6)
    np.testing.assert_array_equal(inside, limits.bound(asked, speeds) == asked)
    assert 20 < inside.sum() < 380 and np.abs(by_speed).max() > 0.1


def test_half_a_step_goes_half_the_way(plain: WeighedPlan, other: WeighedPlan) -> None:
    step, times = other.linearise(), np.linspace(0, 1, 60)
    both = [step.make_offset(3.0, share)(times) for share in (0.0, 0.5, 1.0)]
    np.testing.assert_allclose(both[1], (both[0] + both[2]) / 2, atol=1e-9)
    # fitted again, from the middles of steps on to both ends
    size = np.abs(both[0]).max()
    np.testing.assert_allclose(both[0], other.offset(times), atol=3e-3 * size)


def test_offset_of_an_earlier_recording_has_the_degree_of_then() -> None:
    breaks = np.linspace(0, 2, 6)
    knots = np.concatenate([np.zeros(5), breaks, np.full(5, 2.0)])
    times = np.linspace(0, 2, 41)
    then = make_lsq_spline(times, np.stack([times**5, np.cos(times)], axis=1), knots, 5)
    offset = TorqueOffset(breaks=breaks, coefficients=then.c)
    assert offset.degree == 5
    np.testing.assert_allclose(offset(times), then(times), rtol=1e-12)


def test_offset_is_a_smooth_spline() -> None:
    times = np.linspace(0, 2, 81)
    torques = np.stack([np.sin(3 * times), times**2], axis=1)
    offset = TorqueOffset.fit(times, torques, np.linspace(0, 2, 21))
    between = np.linspace(0, 2, 57)
    np.testing.assert_allclose(offset(between)[:, 0], np.sin(3 * between), atol=1e-6)
    np.testing.assert_allclose(offset.rate(between)[:, 1], 2 * between, atol=1e-8)
    assert not TorqueOffset.zero(2.0, 3)(between).any()
