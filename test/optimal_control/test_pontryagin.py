"""
Optimality conditions against finite differences of the minimised Hamiltonian.

Every point is made for a chosen unbounded torque, so that it is known which motors saturate and
no difference reaches across the switch.

"""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

BATCH = 6
EFFORT = np.array([0.5, 0.125])
# unbounded torque as a share of the bound in that direction, motor by motor
SHARES = [(0.5, -0.6), (3.0, 0.4), (-0.3, 2.5), (-4.0, 3.0)]
shares = pytest.mark.parametrize('share', SHARES, ids=['free', 'first', 'second', 'both'])
# fourth-order central differences: a step's multiples and their weights
OFFSETS, WEIGHTS = np.array([-2, -1, 1, 2]), np.array([1, -8, 8, -1]) / 12


@pytest.fixture(scope='module', params=['workshop', 'crane', 'ei50', 'rigid'])
def model(request: pytest.FixtureRequest) -> ArmModel:
    found: ArmModel = request.getfixturevalue(f'{request.param}_model')
    return found


def parameters(arm: Arm) -> Parameters:
    """Return parameters in which no two entries are alike."""
    n_t = arm.n_coordinates
    return Parameters.of(arm, payload_mass=1.3, payload_inertia=0.07, effort_weights=EFFORT,
                         position_weights=0.2 + 0.1 * np.arange(n_t),
                         velocity_weights=0.7 + 0.2 * np.arange(n_t))


def sizes(arm: Arm) -> Array:
    """Return what the coordinates and rates of a fast motion measure, shape (2 n_t,)."""
    return np.concatenate([np.full(arm.n_joints, 2.0), np.full(arm.n_modes, 0.01),
                           np.full(arm.n_joints, 2.0), np.full(arm.n_modes, 0.5)])


def points(model: ArmModel, p: Array, share: tuple[float, float], seed: int = 0) -> Array:
    """Return points z whose unbounded torque is a share of the bound."""
    arm, rng = model.arm, np.random.default_rng(seed)
    n_t = arm.n_coordinates
    x = rng.uniform(-1, 1, (BATCH, 2 * n_t)) * sizes(arm)
    lower, upper = TorqueLimits.of(arm).bounds(x[:, n_t:n_t + 2])
    free = np.abs(share) * np.where(np.sign(share) > 0, upper, lower)
    y = rng.normal(size=(BATCH, n_t))
    y[:, :2] = -EFFORT * free
    mass = model.mass_and_energy(x, parameters(arm).physical)[0]
    velocity_costates = (mass @ y[..., None])[..., 0]
    return np.hstack([x, rng.normal(size=(BATCH, n_t)), velocity_costates])


def differences(function: Callable[[Array], Array], z: Array, steps: Array) -> Array:
    """Return the derivative of a function of points by each entry, shape (k, ..., m)."""
    columns = [sum(weight / step * function(z + offset * step * direction)
                   for offset, weight in zip(OFFSETS, WEIGHTS, strict=True))
               for step, direction in zip(steps, np.eye(z.shape[1]), strict=True)]
    return np.stack(columns, axis=-1)


def step_sizes(model: ArmModel, z: Array) -> Array:
    """Return steps that leave truncation h^4 and rounding 1e-16 / h alike."""
    half = z.shape[1] // 2
    costates = np.abs(z[:, half:]).max(axis=0)
    # everything is a parabola in the costates; light modes turn small ones into large torques
    return np.concatenate([1e-3 * sizes(model.arm), 1e-5 * costates])


def assert_close(found: Array, expected: Array, rounding: Array | float) -> None:
    """Compare, relative to each column's largest value: 1e-8 for the differences' truncation."""
    allowed = 1e-8 * np.abs(expected).max(axis=0) + rounding
    np.testing.assert_array_less(np.abs(found - expected),
                                 np.broadcast_to(allowed, expected.shape))


@shares
def test_jacobian_agrees_with_finite_differences(model: ArmModel,
                                                 share: tuple[float, float]) -> None:
    p = parameters(model.arm).stack()
    z = points(model, p, share)
    rate, jacobian = model.optimality_jacobian(z, p)
    assert np.array_equal(rate, model.optimality(z, p))
    steps = step_sizes(model, z)
    expected = differences(lambda point: model.optimality(point, p), z, steps)
    # columns in units of the entry, rows relative to their largest; truncation of the steps
    unit = np.abs(expected * steps).max(axis=(0, 2))[:, None]
    assert np.abs((jacobian - expected) * steps / unit).max() <= 1e-8


@shares
def test_state_and_costate_rates_are_derivatives_of_the_minimised_hamiltonian(
        model: ArmModel, share: tuple[float, float]) -> None:
    p = parameters(model.arm).stack()
    z = points(model, p, share)
    half = z.shape[1] // 2
    steps = step_sizes(model, z)
    gradient = differences(lambda point: model.controls(point, p).hamiltonian, z, steps)
    rate = model.optimality(z, p)
    # the terms of H, some ten times larger than H, are rounded and divided by the steps
    rounding = 1e-14 * np.abs(model.controls(z, p).hamiltonian).max() / steps
    assert_close(rate[:, :half], gradient[:, half:], rounding[half:])  # eq. (9)
    assert_close(rate[:, half:], -gradient[:, :half], rounding[:half])


@shares
def test_jacobian_is_a_hamiltonian_matrix(model: ArmModel, share: tuple[float, float]) -> None:
    # F = (dH/dpsi, -dH/dx): its derivative is made of second derivatives of H, hence symmetries
    p = parameters(model.arm).stack()
    jacobian = model.optimality_jacobian(points(model, p, share), p)[1]
    half = jacobian.shape[1] // 2
    A, G = jacobian[:, :half, :half], jacobian[:, :half, half:]
    Q, D = jacobian[:, half:, :half], jacobian[:, half:, half:]
    for one, other in ((A, -D.swapaxes(1, 2)), (G, G.swapaxes(1, 2)), (Q, Q.swapaxes(1, 2))):
        # rounding
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-11 * np.abs(one).max())


@shares
def test_torque_is_eq_14_within_the_bounds_of_eq_15(model: ArmModel,
                                                    share: tuple[float, float]) -> None:
    p = parameters(model.arm).stack()
    z = points(model, p, share)
    n_t = model.arm.n_coordinates
    mass = model.mass_and_energy(z[:, :2 * n_t], parameters(model.arm).physical)[0]
    free = -np.linalg.solve(mass, z[:, 3 * n_t:, None])[:, :2, 0] / EFFORT
    lower, upper = TorqueLimits.of(model.arm).bounds(z[:, n_t:n_t + 2])
    controls = model.controls(z, p)
    torque = controls.torque
    np.testing.assert_allclose(controls.free_torque, free, rtol=1e-11)  # rounding
    np.testing.assert_allclose(torque, np.clip(free, lower, upper), rtol=1e-11)
    saturated = (torque == lower) | (torque == upper)
    assert np.array_equal(saturated.all(axis=0), np.abs(share) > 1)
    assert np.array_equal(saturated.any(axis=0), np.abs(share) > 1)


def hamiltonian(model: ArmModel, z: Array, torque: Array, p: Parameters) -> Array:
    """Evaluate eqs. (7) and (8) for a given torque."""
    x, psi = np.split(z, 2, axis=1)
    q, rates = np.split(x, 2, axis=1)
    cost = (q**2 @ p.position_weights + rates**2 @ p.velocity_weights
            + torque**2 @ p.effort_weights) / 2
    rate = model.forward_dynamics(x, torque, p.physical)
    return cost + (psi * rate).sum(axis=1)


@shares
def test_torque_minimises_the_hamiltonian_among_the_admissible_ones(
        model: ArmModel, share: tuple[float, float]) -> None:
    p = parameters(model.arm)
    z = points(model, p.stack(), share)
    n_t = model.arm.n_coordinates
    least = model.controls(z, p.stack()).hamiltonian
    lower, upper = TorqueLimits.of(model.arm).bounds(z[:, n_t:n_t + 2])
    grid = np.stack(np.meshgrid(*2 * [np.linspace(0, 1, 21)]), -1).reshape(-1, 2)
    for k in range(BATCH):
        torques = lower[k] + grid * (upper[k] - lower[k])
        values = hamiltonian(model, np.repeat(z[k:k + 1], len(torques), axis=0), torques, p)
        # eq. (10); rounding. The grid comes as near as its spacing of (upper - lower) / 20
        assert (values >= least[k] - 1e-12 * np.abs(values).max()).all()
        assert values.min() - least[k] <= EFFORT @ (0.5 / 20 * (upper[k] - lower[k]))**2


@shares
def test_controls_agree_with_the_dynamics_and_the_cost(model: ArmModel,
                                                       share: tuple[float, float]) -> None:
    p = parameters(model.arm)
    z = points(model, p.stack(), share)
    n_t = model.arm.n_coordinates
    found = model.controls(z, p.stack())
    rate = model.forward_dynamics(z[:, :2 * n_t], found.torque, p.physical)
    still = np.zeros_like(z)
    still[:, :2 * n_t] = z[:, :2 * n_t]
    # rounding, relative to accelerations up to 1e5
    np.testing.assert_allclose(found.acceleration, rate[:, n_t:], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.cost_rate, hamiltonian(model, still, found.torque, p),
                               rtol=1e-13)
    np.testing.assert_allclose(found.hamiltonian, hamiltonian(model, z, found.torque, p),
                               rtol=1e-9, atol=1e-9)


@shares
def test_payload_share_is_the_derivative_of_the_hamiltonian_by_the_payload(
        model: ArmModel, share: tuple[float, float]) -> None:
    p = parameters(model.arm).stack()
    z, step = points(model, p, share), 1e-3
    found = model.controls(z, p).payload_share
    direction = step * np.eye(1, p.size)[0]
    expected = sum(weight / step * model.controls(z, p + offset * direction).hamiltonian
                   for offset, weight in zip(OFFSETS, WEIGHTS, strict=True))
    hamiltonian_size = np.abs(model.controls(z, p).hamiltonian).max()
    assert_close(found, np.asarray(expected), 1e-14 * hamiltonian_size / step)


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), size=st.floats(-3, 6))
def test_torque_never_leaves_its_bounds(workshop_model: ArmModel, seed: int,
                                        size: float) -> None:
    arm = workshop_model.arm
    z = np.random.default_rng(seed).normal(size=(50, 4 * arm.n_coordinates))
    z[:, 2 * arm.n_coordinates:] *= 10**size
    torque = workshop_model.controls(z, parameters(arm).stack()).torque
    lower, upper = TorqueLimits.of(arm).bounds(z[:, arm.n_coordinates:arm.n_coordinates + 2])
    assert (lower <= torque).all()
    assert (torque <= upper).all()


def test_motors_without_limit_give_finite_derivatives(uneven_model: ArmModel) -> None:
    arm = uneven_model.arm
    p = parameters(arm).stack()
    z = 1e3 * np.random.default_rng(2).normal(size=(BATCH, 24)) * 1e-2
    rate, jacobian = uneven_model.optimality_jacobian(z, p)
    controls = uneven_model.controls(z, p)
    assert np.isfinite(rate).all()
    assert np.isfinite(jacobian).all()
    n_t = arm.n_coordinates
    mass = uneven_model.mass_and_energy(z[:, :2 * n_t], parameters(arm).physical)[0]
    free = -np.linalg.solve(mass, z[:, 3 * n_t:, None])[:, :2, 0] / EFFORT
    np.testing.assert_allclose(controls.torque, free, rtol=1e-10)  # rounding
