"""Bounds of the mass matrix over all postures, against the matrices that the dynamics have."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, BeamSection, Joint, Link, Motor, Node
from flex_planner.arms.kinematics import payload_velocity, tip_velocity
from flex_planner.base.validation import Array
from flex_planner.dynamics.rigid_inertia import largest_form, RigidInertia
from light_model import LightModel
import numpy as np
import pytest

# of values whose bounds are exact: the bounds are kept clear of rounding by 1e-12
CLEAR = 1 + 1e-9


def plain(*masses: float) -> Arm:
    """Return links of 1 m."""
    links = tuple(Link(length=1.0, linear_density=mass) for mass in masses)
    return Arm(name='plain', links=links, joints=(Joint(),) * len(masses))


def random_arm(rng: np.random.Generator, n: int) -> Arm:
    links = tuple(Link(length=rng.uniform(0.1, 1.5), linear_density=10**rng.uniform(-1, 1.3))
                  for _ in range(n))
    nodes = tuple(Node(mass=rng.choice([0.0, 2.0]), inertia=rng.choice([0.0, 0.2]))
                  for _ in range(n + 1))
    return Arm(name='random', links=links, joints=(Joint(),) * n, nodes=nodes,
               gravity=rng.normal(size=2))


def data_sheet_arm(rng: np.random.Generator, n: int) -> Arm:
    """Return an arm with bodies, rotors and housings of all kinds, and a payload off the tip."""
    plain_arm, links = random_arm(rng, n), []
    for link in plain_arm.links:
        body = Link(length=link.length, linear_density=link.linear_density,
                    center_of_mass=(rng.uniform(-0.3, 1.2), rng.uniform(-0.3, 0.3)),
                    inertia=rng.choice([0.0, 0.1]))
        half = BeamSection(share=0.5, density=1.8), BeamSection(share=0.5, density=0.2)
        links.append([link, body, replace(link, sections=half)][rng.integers(3)])
    joints = tuple(Joint(motor=Motor(gear_ratio=50, rotor_inertia=rng.choice([0.0, 1e-4])),
                         housing=Node(mass=rng.choice([0.0, 1.0]), inertia=0.02))
                   for _ in range(n))
    return replace(plain_arm, links=tuple(links), joints=joints,
                   payload_com=rng.uniform(-0.3, 0.3, 2) * rng.integers(2))


ARMS = {'uniform': random_arm, 'data sheet': data_sheet_arm}


def random_states(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Return postures, many of them stretched or folded, and joint speeds."""
    q = rng.uniform(-np.pi, np.pi, (60, n))
    q[:20, 1:] = rng.choice([0.0, np.pi], (20, n - 1))
    return q, rng.normal(size=(60, n))


@pytest.mark.parametrize('seed', range(12))
@pytest.mark.parametrize('kind', ARMS)
def test_no_posture_exceeds_a_bound(kind: str, seed: int) -> None:
    rng, n = np.random.default_rng(seed), 1 + seed % 5
    arm, payload, inertia = ARMS[kind](rng, n), 10**rng.uniform(-2, 3), rng.choice([0.0, 0.1])
    q, rates = random_states(rng, n)
    found = RigidInertia.of(arm, payload, inertia)
    M = LightModel(arm).mass_and_energy(np.hstack([q, rates]), np.array(
        [payload, inertia, *np.zeros(3 * n)]))[0]
    vectors, D = rng.normal(size=(6, n)), rng.uniform(0, 5, n)
    for extra in (np.zeros((n, n)), np.diag(D)):
        sets = tuple(one + extra for one in found.lower_bounds(rng.uniform(0.1, 9, n)))
        forms = np.einsum('mi,kij,mj->km', vectors, np.linalg.inv(M + extra), vectors)
        assert (forms.max(0) <= largest_form(sets, vectors) * CLEAR).all()
    twice = np.einsum('ki,kij,kj->k', rates, M, rates)[:, None] * CLEAR
    assert (rates**2 <= twice * found.joint_mobilities).all()
    assert (np.cumsum(rates, axis=1)**2 <= twice * found.turning_mobilities).all()
    squares = (tip_velocity(arm, q, rates)**2).sum(1)
    assert (squares <= twice[:, 0] * found.point_mobilities[-1]).all()
    squares = (payload_velocity(arm, q, rates)**2).sum(1)
    assert (squares <= twice[:, 0] * found.carried_mobility).all()


@pytest.mark.parametrize('kind', ARMS)
def test_bounds_of_two_links_are_reached(kind: str) -> None:
    arm, vectors = ARMS[kind](np.random.default_rng(3), 2), np.array([[1.0, 0.4], [1.0, -2.0]])
    turns = np.append(np.linspace(0, 2 * np.pi, 4001), [np.pi])
    x = np.zeros((turns.size, 4))
    x[:, 1] = turns
    M = LightModel(arm).mass_and_energy(x, np.array([1.5, *np.zeros(9)]))[0]
    found = RigidInertia.of(arm, 1.5, 0.0)
    reached = np.einsum('mi,kij,mj->km', vectors, np.linalg.inv(M), vectors).max(0)
    sets = found.lower_bounds(np.ones(2))
    # of the nearest of so many angles
    accuracy = 1e-9 if kind == 'uniform' else 1e-4
    np.testing.assert_allclose(largest_form(sets, vectors), reached, rtol=accuracy)
    np.testing.assert_allclose(found.joint_mobilities, [
        np.linalg.inv(M)[:, i, i].max() for i in range(2)], rtol=accuracy)


@pytest.mark.parametrize(('arm', 'mass'), [
    (plain(3.0), 1.0),  # rho L^3 / 3 over L^2
    (plain(3.0, 3.0), 0.875),  # m_2/3 (1 - m_2 / (4 (m_1 + m_2)))
    (plain(5.0, 1.0), 1 / 3 * (1 - 1 / 24))], ids=['one', 'two', 'unlike'])
def test_mass_that_moves_with_the_tip_has_its_closed_form(arm: Arm, mass: float) -> None:
    for payload in (0.0, 7.0):
        mobility = RigidInertia.of(arm, payload, 0.0).point_mobilities[-1]
        assert mobility == pytest.approx(1 / (mass + payload), rel=1e-9)


@pytest.mark.parametrize('seed', range(8))
def test_no_posture_of_a_data_sheet_arm_has_less_potential_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm = data_sheet_arm(rng, 2)
    found = RigidInertia.of(arm, 0.0, 0.0)
    q = np.stack(np.meshgrid(*[np.linspace(0, 2 * np.pi, 25)] * 2), -1).reshape(-1, 2)
    x = np.hstack([q, 0 * q])
    for payload in (0.0, 2.0):
        least = -np.linalg.norm(arm.gravity) * found.first_moments(arm, payload).sum()
        V = LightModel(arm).mass_and_energy(x, np.array([payload, *np.zeros(9)]))[2]
        assert V.min() >= least * (1 + 1e-12)
        # the grid is within an eighth of a radian of the least; a payload is bounded by itself
        assert payload or V.min() == pytest.approx(least, abs=0.02 * abs(least))


@pytest.mark.parametrize('seed', range(4))
def test_arm_that_hangs_has_the_least_potential_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm, n = random_arm(rng, 3), 3
    moments = RigidInertia.of(arm, 2.0, 0.0).first_moments(arm, 2.0)
    least = -np.linalg.norm(arm.gravity) * moments.sum()
    q, rates = random_states(rng, n)
    q[0] = np.arctan2(arm.gravity[1], arm.gravity[0]), 0.0, 0.0
    V = LightModel(arm).mass_and_energy(np.hstack([q, rates]), np.array([2.0, *np.zeros(10)]))[2]
    assert V[0] == pytest.approx(least, rel=1e-12)
    assert V.min() >= least * (1 + 1e-12)


def test_matrix_that_may_be_singular_bounds_nothing() -> None:
    nearly = np.array([[[1.0, 1.0], [1.0, 1.0 + 1e-13]]])
    assert largest_form((nearly,), np.eye(2)).tolist() == [np.inf, np.inf]
    assert largest_form((nearly, 2 * np.eye(2)[None]), np.eye(2)) == pytest.approx(0.5)


@pytest.mark.parametrize('payload', [0.0, 1e3, 1e6])
def test_rounding_cannot_make_a_bound_too_low(payload: float) -> None:
    # stretched, with a heavy payload, the arm is light only in one direction
    matrix = np.array([[4 / 3, 1 / 2], [1 / 2, 1 / 3]]) + payload  # between absolute angles
    determinant = 4 / 9 - 1 / 4 + payload * 2 / 3
    exact = (matrix[0, 0] + matrix[1, 1] + 2 * matrix[0, 1]) / determinant  # of (1, -1)
    vector = np.array([[1.0, -1.0]]) @ np.tril(np.ones((2, 2)))  # between joint angles
    sets = RigidInertia.of(plain(1.0, 1.0), payload, 0.0).lower_bounds(np.ones(2))
    bound = largest_form(sets, vector)[0]
    assert exact <= bound < exact * (1 + 1e-4)
