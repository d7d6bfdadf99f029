"""Physics as properties of the dynamics of random arms: 1 to 4 links of any mode family."""

from __future__ import annotations

from dataclasses import replace

from data_sheet_arms import HUB, stepped_arm
from flex_planner.arms.arm import Arm, Joint, Link, Node
from flex_planner.arms.mode_shapes import FAMILIES
from flex_planner.base.validation import Array
from flex_planner.dynamics.integration import simulate
from flex_planner.optimal_control.parameters import Parameters
from hypothesis import given, settings
from hypothesis import strategies as st
from light_model import LightModel
import numpy as np

MOST_COORDINATES = 8
OFFSETS, WEIGHTS = np.array([-2, -1, 1, 2]), np.array([1, -8, 8, -1]) / 12
SEEDS = st.integers(0, 2**32 - 1)


@st.composite
def arms(draw: st.DrawFn, modes: int = 3) -> Arm:
    """Return an arm without friction; soft, so that integrating its motion is quick."""
    n, links = draw(st.integers(1, 4)), []
    left = MOST_COORDINATES - n
    for _ in range(n):
        count = draw(st.integers(0, min(modes, left)))
        left -= count
        links.append(Link(
            length=draw(st.floats(0.4, 0.8)), linear_density=draw(st.floats(1.0, 4.0)),
            flexural_rigidity=draw(st.floats(2.0, 10.0)), modes=count,
            mode_family=draw(st.sampled_from(sorted(FAMILIES))),
            shape_mass=draw(st.floats(0.0, 5.0)), shape_inertia=draw(st.floats(0.0, 1.0)),
            sections=draw(st.sampled_from([(), (), HUB]))))
    part = st.builds(Node, mass=st.floats(0, 2), inertia=st.floats(0, 0.1))
    nodes = draw(st.one_of(st.just([]), st.lists(part, min_size=n + 1, max_size=n + 1)))
    gravity = draw(st.sampled_from([(0.0, 0.0), (0.0, -9.81), (3.0, -5.0)]))
    return Arm(name='random', links=tuple(links), joints=(Joint(),) * n, nodes=tuple(nodes),
               gravity=gravity)


def random_states(arm: Arm, count: int, seed: int) -> Array:
    sizes = np.concatenate([np.full(arm.n_joints, np.pi), np.full(arm.n_modes, 0.02),
                            np.full(arm.n_joints, 2.0), np.full(arm.n_modes, 0.3)])
    states: Array = np.random.default_rng(seed).uniform(-1, 1, (count, sizes.size)) * sizes
    return states


def parameters(arm: Arm) -> Array:
    return Parameters.of(arm, payload_mass=1.2, payload_inertia=0.05).physical


def differences(values: Array, step: Array) -> Array:
    """Return the derivative from values at -2, -1, 1, 2 steps along the first axis."""
    return np.tensordot(WEIGHTS, values, 1) / step


@settings(max_examples=40)
@given(arm=arms(), seed=SEEDS)
def test_mass_matrix_is_positive_definite_and_gives_the_energy(arm: Arm, seed: int) -> None:
    x = random_states(arm, 10, seed)
    mass, kinetic, _ = LightModel(arm).mass_and_energy(x, parameters(arm))
    rates = x[:, arm.n_coordinates:]
    largest = np.abs(mass).max()
    np.testing.assert_allclose(mass, mass.swapaxes(1, 2), rtol=0, atol=1e-14 * largest)
    assert (np.linalg.eigvalsh(mass) > 0).all()
    np.testing.assert_allclose(kinetic, np.einsum('ki,kij,kj->k', rates, mass, rates) / 2,
                               rtol=1e-11)  # rounding


@settings(max_examples=10)
@given(arm=arms(modes=2), seed=SEEDS)
def test_energy_is_conserved_in_free_motion(arm: Arm, seed: int) -> None:
    model, p, start = LightModel(arm), parameters(arm), random_states(arm, 1, seed)[0]
    end = simulate(model, p, start, lambda t: np.zeros(arm.n_joints), 0.05,  # type: ignore
                   rtol=1e-12, atol=1e-13)
    _, kinetic, potential = model.mass_and_energy(np.array([start, end]), p)
    energy = kinetic + potential
    # of the integrator: 1e-12 a step, over some hundred steps
    assert abs(np.diff(energy)[0]) <= 1e-9 * (np.abs(potential).max() + kinetic.max())


def test_energy_of_links_in_sections_is_conserved() -> None:
    arm = replace(stepped_arm(), links=tuple(replace(link, damping_ratio=0.0)
                                             for link in stepped_arm().links))
    model, p, start = LightModel(arm), parameters(arm), random_states(arm, 1, 5)[0]
    end = simulate(model, p, start, lambda t: np.zeros(5), 0.02,  # type: ignore
                   rtol=1e-13, atol=1e-14)
    _, kinetic, potential = model.mass_and_energy(np.array([start, end]), p)
    assert np.abs(end - start).max() > 0.02
    assert abs(np.diff(kinetic + potential)[0]) <= 1e-10 * (np.abs(potential).max()
                                                            + kinetic.max())


@settings(max_examples=30)
@given(arm=arms(), seed=SEEDS)
def test_static_forces_are_derivatives_of_the_potential_energy(arm: Arm, seed: int) -> None:
    model, p, n_t = LightModel(arm), parameters(arm), arm.n_coordinates
    # a metre of a mode turns its tip by up to 50 rad
    h = np.concatenate([np.full(arm.n_joints, 1e-3), np.full(arm.n_modes, 1e-4)])
    q = random_states(arm, 1, seed)[0, :n_t]
    path = q + OFFSETS[:, None, None] * np.diag(h)  # (4, n_t, n_t)
    still = np.concatenate([path, np.zeros_like(path)], axis=-1).reshape(-1, 2 * n_t)
    potential = model.mass_and_energy(still, p)[2].reshape(4, n_t)
    gradients = model.static_forces(path.reshape(-1, n_t), p)[0].reshape(4, n_t, n_t)
    force, stiffness = model.static_forces(q[None], p)
    # truncation h^4 and rounding 1e-16 / h of energies up to 1e2 J and forces up to 1e4 N
    np.testing.assert_allclose(force[0], differences(potential, h), rtol=1e-8, atol=1e-6)
    np.testing.assert_allclose(stiffness[0], differences(gradients, h[:, None]),
                               rtol=1e-8, atol=1e-6)


@settings(max_examples=30)
@given(arm=arms(), seed=SEEDS)
def test_force_at_rest_is_the_static_force(arm: Arm, seed: int) -> None:
    model, p, n_t = LightModel(arm), parameters(arm), arm.n_coordinates
    x = random_states(arm, 5, seed)
    x[:, n_t:] = 0
    found = model.inverse_dynamics(x, np.zeros((5, n_t)), p)
    np.testing.assert_allclose(found, model.static_forces(x[:, :n_t], p)[0], rtol=1e-12,
                               atol=1e-11)  # rounding of forces up to 1e4 N


@settings(max_examples=20)
@given(arm=arms(modes=2), seed=SEEDS)
def test_turning_the_whole_arm_and_gravity_changes_nothing(arm: Arm, seed: int) -> None:
    angle, p = 0.7, parameters(arm)
    c, s = np.cos(angle), np.sin(angle)
    turned = Arm(name='turned', links=arm.links, joints=arm.joints, nodes=arm.nodes,
                 gravity=np.array([[c, -s], [s, c]]) @ arm.gravity)
    x = random_states(arm, 5, seed)
    a = np.random.default_rng(seed).normal(size=(5, arm.n_coordinates))
    expected = LightModel(arm).inverse_dynamics(x, a, p)
    x[:, 0] += angle
    np.testing.assert_allclose(LightModel(turned).inverse_dynamics(x, a, p), expected,
                               rtol=1e-11, atol=1e-10)  # rounding of forces up to 1e4 N


def test_light_model_is_the_compiled_one(crane_arm: Arm, crane_model: object) -> None:
    x, p = random_states(crane_arm, 5, 0), parameters(crane_arm)
    a = np.random.default_rng(1).normal(size=(5, 5))
    light = LightModel(crane_arm)
    for name, inputs in (('mass_and_energy', (x, p)), ('static_forces', (x[:, :5], p)),
                         ('inverse_dynamics', (x, a, p))):
        found = getattr(light, name)(*inputs)
        expected = getattr(crane_model, name)(*inputs)
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-10)  # rounding
    torque = np.array([1.0, -2.0])
    np.testing.assert_allclose(
        light.state_rate(p)(x[0], torque), crane_model.state_rate(p)(x[0], torque),  # type: ignore
        rtol=1e-9, atol=1e-9)
