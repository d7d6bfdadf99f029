"""The conditions of motions whose torque is a state, by finite differences."""

from __future__ import annotations

from dataclasses import replace

from factories import TaskFactory
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.smoothed_torque_state import (
    smooth_rates,
    SmoothedTorqueState,
)
from flex_planner.optimal_control.state_layout import StateLayout
import numpy as np
import pytest

STEP = 1e-6
# of central differences with that step, against the largest entry of a row
ERROR = 1e-6
# the same of a Hamiltonian that comes to thousands, with its rounding
ROUNDED = 1e-4


@pytest.fixture(scope='module')
def problem(ei50_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    """Return a motion with all weights, whose rates are bounded for one joint."""
    task = paper_task(ei50_model.arm, w_2=0.3, position_weights=[1, 2, 3, 4, 5, 6],
                      torque_rate_weight=[2e-3, 3e-3], max_torque_rate=[np.inf, 40.0])
    return MotionProblem(ei50_model, task, task_parameters(task))


@pytest.fixture(scope='module')
def points(problem: MotionProblem) -> Array:
    """Return points at which rates are within their bounds, and beyond."""
    z = np.random.default_rng(4).normal(size=(6, problem.size)) * 0.3
    # unbounded rates of the second joint up to 100 N m/s either way
    z[:, -1] = np.linspace(-0.3, 0.3, 6)
    assert (np.abs(z[:, -1]) / 3e-3 > 40).sum() == 4
    return z


def differences(function: object, points: Array) -> Array:
    """Return central differences by each unknown, the last axis."""
    assert callable(function)
    columns = [(function(points + step) - function(points - step)) / (2 * STEP)
               for step in STEP * np.eye(points.shape[1])]
    return np.stack(columns, axis=-1)


def test_jacobian_is_that_of_finite_differences(problem: MotionProblem, points: Array) -> None:
    times = np.zeros(len(points))
    rate, jacobian = problem.rate_jacobian(times, points)
    np.testing.assert_allclose(rate, problem.rate(times, points), rtol=1e-12)
    expected = differences(lambda z: problem.rate(times, z), points)
    # a rate on its bound has a row of zeros
    size = np.maximum(np.abs(expected).max(axis=2, keepdims=True), 1.0)
    assert np.abs((jacobian - expected) / size).max() < ERROR


def test_rates_are_the_gradient_of_the_hamiltonian(problem: MotionProblem, points: Array) -> None:
    times, layout = np.zeros(len(points)), problem.layout
    gradient = differences(lambda z: problem.controls(times, z).hamiltonian, points)
    rate = problem.rate(times, points)
    canonical = np.empty_like(rate)
    canonical[:, layout.states] = gradient[:, layout.costates]
    canonical[:, layout.costates] = -gradient[:, layout.states]
    size = np.abs(rate).max(axis=0)
    assert np.abs((rate - canonical) / size).max() < ROUNDED


def test_rate_of_the_torque_minimises_the_hamiltonian(problem: MotionProblem,
                                                      points: Array) -> None:
    times = np.zeros(len(points))
    least = problem.controls(times, points).hamiltonian
    rates = problem.rate(times, points)[:, problem.layout.torque_slice]
    prices, costates = np.array([2e-3, 3e-3]), points[:, problem.layout.torque_costate_slice]
    for other in (rates + 1.0, rates - 1.0, np.zeros_like(rates)):
        bounded = np.clip(other, [-np.inf, -40.0], [np.inf, 40.0])
        more = (prices * (bounded**2 - rates**2) / 2 + costates * (bounded - rates)).sum(axis=1)
        assert (more >= -1e-12 * np.abs(least)).all()


def test_rates_switch_where_their_bound_is(problem: MotionProblem, points: Array) -> None:
    values = problem.switches(np.zeros(len(points)), points)
    free = -points[:, -1] / 3e-3
    np.testing.assert_allclose(values, np.stack([free - 40, free + 40], axis=1), rtol=1e-12)


def test_barrier_keeps_rates_within_their_bounds(problem: MotionProblem, points: Array) -> None:
    mu, times = 1e-3, np.zeros(len(points))
    smooth = smooth_rates(problem.conditions, mu)
    assert isinstance(smooth, SmoothedTorqueState)
    rate, jacobian = smooth.rate_jacobian(points)
    assert (np.abs(rate[:, problem.layout.torque_slice][:, 1]) < 40).all()
    expected = differences(smooth.rate, points)
    size = np.maximum(np.abs(expected).max(axis=2, keepdims=True), 1.0)
    assert np.abs((jacobian - expected) / size).max() < ERROR
    gradient = differences(lambda z: smooth.controls(z).hamiltonian + smooth.barrier_rate(z),
                           points)[:, problem.layout.torque_costate_slice]
    np.testing.assert_allclose(gradient, rate[:, problem.layout.torque_slice], rtol=1e-4,
                               atol=1e-2)
    nearly = smooth_rates(problem.conditions, 1e-9).rate(points)
    np.testing.assert_allclose(nearly, problem.rate(times, points), rtol=1e-4, atol=1e-6)


def test_torques_are_free_at_ends_where_the_arm_moves(problem: MotionProblem) -> None:
    moving = replace(problem.task, start_velocities=[0.1, 0.0], goal_position_weights=[1.0, 1.0])
    free = MotionProblem(problem.model, moving, problem.parameters)
    z = np.arange(free.size, dtype=float)
    for residual, rows in (free.left(z), free.right(z)):
        assert rows.shape == (free.size // 2, free.size)
        np.testing.assert_allclose(residual[-2:], z[free.layout.torque_costate_slice])
    rest = MotionProblem(problem.model, replace(
        problem.task, arm=replace(problem.task.arm, gravity=[0.0, -9.81])), problem.parameters)
    residual, rows = rest.right(z)
    np.testing.assert_allclose(residual, rows @ z - np.concatenate(
        [rest.goal, rest.holding_torque]), atol=1e-9)


def test_layout_names_every_unknown_once() -> None:
    for layout in (StateLayout(5), StateLayout(5, 2)):
        every = np.concatenate([layout.states, layout.costates])
        assert sorted(every.tolist()) == list(range(layout.size))
