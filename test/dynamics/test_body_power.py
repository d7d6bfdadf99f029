"""Virtual power in space, against Lagrange's equations of clouds of points; frames."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
from data_sheet_arms import data_sheet_arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.validation import Array
from flex_planner.dynamics.build_chain import build_chain, chain_of
from flex_planner.dynamics.chain import Chain
from flex_planner.dynamics.dynamics_functions import physical_symbols
import numpy as np
from planar_energies import build_energy_chain
from point_mechanisms import point_energies, point_mechanism, PointLink
from presets import PLANAR_PRESETS
import pytest
from scipy.spatial.transform import Rotation

GRAVITY = np.array([1.0, -2.0, -9.0])
PAYLOAD = 1.3


def links_of(seed: int) -> tuple[list[PointLink], np.random.Generator]:
    """Return two or three random links, one of them rigid."""
    rng = np.random.default_rng(seed)
    return [PointLink.draw(rng, modes) for modes in [(2, 1), (0, 3), (2, 0, 2)][seed % 3]], rng


def evaluate(chain: Chain, x: Array, rigidity: Array, *expressions: Any,
             inertia: float = 0.0) -> list[Array]:
    """Return expressions of a chain at a state."""
    state = ca.vertcat(chain.coordinates, chain.rates)
    friction = np.linspace(0.1, 0.3, rigidity.size)  # of joints that have any
    function = ca.Function('f', [state, physical_symbols(chain)], list(expressions))
    values = function.call([x, np.concatenate([[PAYLOAD, inertia], rigidity, friction, friction])])
    return [np.array(value) for value in values]


@pytest.mark.parametrize('seed', range(6))
def test_mass_and_forces_in_space_are_those_of_lagrange(seed: int) -> None:
    links, rng = links_of(seed)
    chain = chain_of(point_mechanism(links, GRAVITY))
    q, rates = chain.coordinates, chain.rates
    n_t = q.numel()
    kinetic, potential = point_energies(links, GRAVITY, q, rates, chain.payload_mass,
                                        chain.rigidity)
    momentum = ca.gradient(kinetic, rates)
    losses = [chain_friction * rates[i] for i, chain_friction in enumerate(
        np.linspace(0.1, 0.4, len(links)))]
    at = len(links)
    for i, link in enumerate(links):
        for c in link.joint.beam.damping:
            losses.append(ca.sqrt(chain.rigidity[i]) * c * rates[at])
            at += 1
    force = (ca.jtimes(momentum, q, rates) - ca.gradient(kinetic - potential, q)
             + ca.vertcat(*losses))
    x = np.concatenate([rng.uniform(-np.pi, np.pi, len(links)),
                        rng.uniform(-0.4, 0.4, n_t - len(links)), rng.normal(size=n_t)])
    rigidity = rng.uniform(0.5, 2.0, len(links))
    found = evaluate(chain, x, rigidity, chain.mass_matrix(), chain.bias(), chain.kinetic,
                     ca.gradient(chain.potential, q))
    wanted = evaluate(chain, x, rigidity, ca.jacobian(momentum, rates), force, kinetic,
                      ca.gradient(potential, q))
    for value, other in zip(found, wanted, strict=True):
        np.testing.assert_allclose(value, other, rtol=0, atol=1e-12 * np.abs(other).max())


@pytest.mark.parametrize('seed', range(3))
def test_power_does_not_depend_on_the_axes_of_the_base(seed: int) -> None:
    links, rng = links_of(seed)
    turned = Rotation.random(random_state=rng).as_matrix()
    first = links[0].joint
    other = point_mechanism(links, turned @ GRAVITY)
    other = replace(other, links=[
        replace(first, position=turned @ first.position, rotation=turned @ first.rotation),
        *other.links[1:]])
    chains = [chain_of(point_mechanism(links, GRAVITY)), chain_of(other)]
    x = rng.normal(size=2 * chains[0].coordinates.numel())
    mass, same_mass, bias, same_bias = (
        evaluate(chain, x, np.ones(len(links)), expression)[0]
        for chains_expression in ('mass_matrix', 'bias') for chain in chains
        for expression in [getattr(chain, chains_expression)()])
    np.testing.assert_allclose(same_mass, mass, rtol=0, atol=1e-12 * np.abs(mass).max())
    np.testing.assert_allclose(same_bias, bias, rtol=0, atol=1e-12 * np.abs(bias).max())


@pytest.mark.parametrize('name', [*PLANAR_PRESETS, *range(4)])
def test_arms_have_the_dynamics_of_their_energies(name: str | int) -> None:
    arm = load_arm(name) if isinstance(name, str) else data_sheet_arm(name)
    chain, energies = build_chain(arm), build_energy_chain(arm)
    rng = np.random.default_rng(0)
    for _ in range(5):
        x = np.concatenate([rng.uniform(-np.pi, np.pi, arm.n_joints),
                            rng.uniform(-0.05, 0.05, arm.n_passive),
                            rng.normal(size=arm.n_coordinates)])
        found, wanted = (evaluate(each, x, arm.flexural_rigidities(), each.mass_matrix(),
                                  each.bias(), each.kinetic, each.potential, inertia=0.02)
                         for each in (chain, energies))
        for value, other in zip(found, wanted, strict=True):
            np.testing.assert_allclose(value, other, rtol=0, atol=1e-12 * np.abs(other).max())
