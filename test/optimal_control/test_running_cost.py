"""The running cost of eq. (7): its value, its slope in the costates, and in the programme."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
from flex_planner.base.validation import Array
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.mesh import Mesh
from flex_planner.optimal_control.direct.programme import Programme
from flex_planner.optimal_control.parameters import Parameters, ParameterSymbols
from flex_planner.optimal_control.running_cost import running_cost
import numpy as np
import pytest

COUNT, SCHEME = 8, ('gauss', 2, 3)


@pytest.fixture(scope='module', params=['workshop', 'rigid'])
def model(request: pytest.FixtureRequest) -> ArmModel:
    found: ArmModel = request.getfixturevalue(f'{request.param}_model')
    return found


@pytest.fixture
def parameters(model: ArmModel) -> Parameters:
    """Return parameters in which no two weights are alike."""
    n_t = model.arm.n_coordinates
    return Parameters.of(model.arm, payload_mass=1.3, effort_weights=np.array([0.25, 0.125]),
                         position_weights=0.2 + 0.1 * np.arange(n_t),
                         velocity_weights=1.7 + 0.2 * np.arange(n_t))


@pytest.fixture
def points(model: ArmModel) -> Array:
    """Return points z, at some of which motors saturate."""
    return np.random.default_rng(5).normal(size=(COUNT, 4 * model.arm.n_coordinates))


def cost_by_hand(p: Parameters, x: Array, torque: Array) -> float:
    """Return L as sums over coordinates and joints."""
    half = x.size // 2
    total = 0.0
    for weight, value in [*zip(p.position_weights, x[:half], strict=True),
                          *zip(p.velocity_weights, x[half:], strict=True),
                          *zip(p.effort_weights, torque, strict=True)]:
        total += weight * value**2 / 2
    return total


def test_running_cost_is_half_the_weighted_sum_of_squares(
        model: ArmModel, parameters: Parameters, points: Array) -> None:
    chain = build_chain(model.arm)
    symbols, u = ParameterSymbols.of(chain), ca.SX.sym('u', 2)
    x = ca.vertcat(chain.coordinates, chain.rates)
    function = ca.Function('cost', [x, u, ca.vertcat(*symbols.stack())],
                           [running_cost(symbols, chain.coordinates, chain.rates, u)])
    torque = np.array([3.0, -7.0])
    for z in points:
        state = z[:z.size // 2]
        # rounding
        assert float(function(state, torque, parameters.stack())) == pytest.approx(
            cost_by_hand(parameters, state, torque), rel=1e-14)


def test_controls_have_the_cost_of_their_torque(model: ArmModel, parameters: Parameters,
                                                points: Array) -> None:
    found = model.controls(points, parameters.stack())
    half = points.shape[1] // 2
    expected = [cost_by_hand(parameters, z[:half], u)
                for z, u in zip(points, found.torque, strict=True)]
    np.testing.assert_allclose(found.cost_rate, expected, rtol=1e-13)  # rounding


def test_weights_of_the_state_enter_the_costates_by_minus_the_slope_of_the_cost(
        model: ArmModel, parameters: Parameters, points: Array) -> None:
    half, h = points.shape[1] // 2, 1e-3
    bare = replace(parameters, position_weights=0 * parameters.position_weights,
                   velocity_weights=0 * parameters.velocity_weights)
    added = (model.optimality(points, parameters.stack())
             - model.optimality(points, bare.stack()))
    assert not added[:, :half].any()  # the torque does not know them
    none = np.zeros(2)
    for z, found in zip(points, added[:, half:], strict=True):
        slope = [(cost_by_hand(parameters, z[:half] + step, none)
                  - cost_by_hand(parameters, z[:half] - step, none)) / (2 * h)
                 for step in h * np.eye(half)]
        # a parabola: rounding of L over the step, and of rates up to 1e4 beside it
        np.testing.assert_allclose(found, -np.array(slope), atol=1e-10)


def test_weights_of_the_torque_enter_the_costates_through_the_moving_bound_alone(
        model: ArmModel, parameters: Parameters, points: Array) -> None:
    # free or at a bound, minus the slope of the least Hamiltonian by the speeds
    p, n_t, h = parameters.stack(), model.arm.n_coordinates, 1e-5
    found = model.optimality(points, p)[:, 3 * n_t:3 * n_t + 2]
    for joint in range(2):
        step = h * np.eye(4 * n_t)[n_t + joint]
        slope = (model.controls(points + step, p).hamiltonian
                 - model.controls(points - step, p).hamiltonian) / (2 * h)
        scale = np.abs(model.controls(points, p).hamiltonian).max()
        # truncation h^2 and rounding 1e-16 / h of H, whose terms are some ten times larger
        np.testing.assert_allclose(found[:, joint], -slope, rtol=1e-6, atol=1e-9 * scale)


def at_all_points(model: ArmModel, parameters: Parameters, z: Array, duration: float,
                  size: int) -> Array:
    """Return unknowns of the programme with y = (q, q', q'', u + K_2 q') at all six points."""
    n_t, found = model.arm.n_coordinates, model.controls(z[None], parameters.stack())
    y = np.concatenate([z[:2 * n_t], found.acceleration[0], found.torque[0]
                        + parameters.torque_slope * z[n_t:n_t + 2]])
    others = np.zeros(size - 2 - 6 * y.size)
    return np.concatenate([np.tile(y, 6), others, [parameters.payload_mass, duration]])


def test_programme_has_the_same_cost_at_the_same_point(
        model: ArmModel, parameters: Parameters, points: Array) -> None:
    programme, duration = Programme.of(model.arm, Mesh.of(*SCHEME).transcription()), 1.7
    x, p, f = (programme.expressions[name] for name in ('x', 'p', 'f'))
    cost, ends = ca.Function('f', [x, p], [f]), np.zeros(4 * model.arm.n_coordinates)
    expected = model.controls(points, parameters.stack()).cost_rate
    for z, rate in zip(points, expected, strict=True):
        found = cost(at_all_points(model, parameters, z, duration, x.numel()),
                     np.concatenate([parameters.stack(), ends, [1.0, 0.0, 0.0]]))
        # rounding, of which u + K_2 q' - K_2 q' leaves a little more
        assert float(found) == pytest.approx(duration * rate, rel=1e-12)
