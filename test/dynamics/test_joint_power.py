"""Rotors, housings, springs and friction in the joints; payloads with their centre off the tip."""

from __future__ import annotations

from dataclasses import replace

from data_sheet_arms import data_sheet_arm
from flex_planner.arms.arm import Arm, Elasticity, Joint, Link, Motor, Node
from flex_planner.arms.kinematics import tip_position, tip_velocity
from flex_planner.base.validation import Array
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.dynamics.unbent_arm import bending_stiffness, mass_matrix
from light_model import LightModel
import numpy as np
import pytest
from scipy.integrate import solve_ivp

# q, q', q'' and the torques that the recursive Newton-Euler algorithm of Pinocchio 4.1.0 finds for
# `three_bodies`, with the rotors as its armature
RNEA = [
    ([1.83, 1.85, 0.09], [0.42, 1.14, 0.11], [-0.55, -0.78, 0.75],
     [-23.8787923811752, -16.86579677398372, -4.7393525069181734]),
    ([3.0, 0.91, -1.59], [-0.96, 1.6, 0.2], [-1.73, -0.08, -1.16],
     [-42.77886583800667, -14.620166697748989, -3.630671885157067]),
    ([1.06, -2.64, 0.33], [0.55, -0.06, -0.59], [0.41, 0.83, -1.64],
     [13.119602896008354, -0.8588006402434846, 0.5781749867462933]),
    ([2.37, 2.23, -2.89], [-1.29, 0.02, -0.04], [-0.3, -1.05, -0.4],
     [-19.41915465154202, -2.4669504654362897, -0.13227884644109605])]


def three_bodies() -> Arm:
    """Return a rigid arm whose bodies have their centres of mass anywhere."""
    links = tuple(Link(length=length, linear_density=mass / length, center_of_mass=com,
                       inertia=inertia) for length, mass, com, inertia in (
        (0.5, 2.0, (0.2, 0.03), 0.05), (0.4, 1.5, (0.25, -0.02), 0.03),
        (0.3, 0.8, (0.1, 0.0), 0.01)))
    joints = tuple(Joint(motor=Motor(gear_ratio=2.0, rotor_inertia=rotor / 4), housing=housing)
                   for rotor, housing in (
        (0.12, Node(mass=5.0, inertia=1.0)), (0.08, Node(mass=0.7, inertia=0.004)),
        (0.02, Node(mass=0.4, inertia=0.002))))
    return Arm(name='bodies', links=links, joints=joints, gravity=[1.0, -9.0],
               payload_com=[0.05, -0.04])


def physical(arm: Arm, mass: float = 1.3, inertia: float = 0.006) -> Array:
    """Return the parameters of an arm with a payload."""
    return PhysicalParameters.of_arm(arm, payload_mass=mass, payload_inertia=inertia).physical


@pytest.mark.parametrize('case', range(len(RNEA)))
def test_torques_of_a_rigid_arm_are_those_of_another_library(case: int) -> None:
    q, rates, acceleration, torque = map(np.array, RNEA[case])
    arm = three_bodies()
    found = LightModel(arm).inverse_dynamics(np.concatenate([q, rates])[None],
                                             acceleration[None], physical(arm))[0]
    np.testing.assert_allclose(found, torque, rtol=1e-12)


@pytest.mark.parametrize('seed', range(4))
def test_mass_matrix_without_bending_is_that_of_another_derivation(seed: int) -> None:
    arm = data_sheet_arm(seed)
    positions = np.random.default_rng(seed).uniform(-3, 3, arm.n_joints)
    x = np.concatenate([positions, np.zeros(arm.n_passive + arm.n_coordinates)])
    mass = LightModel(arm).mass_and_energy(x[None], physical(arm))[0][0]
    np.testing.assert_allclose(mass, mass_matrix(arm, positions, 1.3, 0.006), rtol=0,
                               atol=1e-13 * np.abs(mass).max())
    stiffness = LightModel(replace(arm, gravity=[0, 0])).static_forces(
        x[None, :arm.n_coordinates], physical(arm))[1][0]
    np.testing.assert_allclose(stiffness, bending_stiffness(arm), rtol=0,
                               atol=1e-13 * np.abs(stiffness).max())


@pytest.mark.parametrize('seed', range(4))
def test_friction_takes_power_and_nothing_else_does_it(seed: int) -> None:
    arm, rng = data_sheet_arm(seed), np.random.default_rng(seed)
    smooth = replace(arm, joints=tuple(replace(joint, coulomb_friction=0.0)
                                       for joint in arm.joints))
    x = rng.normal(size=(20, 2 * arm.n_coordinates)) * 0.3
    a, rates = rng.normal(size=(20, arm.n_coordinates)), x[:, arm.n_coordinates:]
    lost = (LightModel(arm).inverse_dynamics(x, a, physical(arm))
            - LightModel(smooth).inverse_dynamics(x, a, physical(smooth)))
    coulomb = np.array([joint.coulomb_friction for joint in arm.joints])
    n = arm.n_joints
    np.testing.assert_allclose(lost[:, :n], coulomb * np.tanh(rates[:, :n] / 0.2), atol=1e-12)
    np.testing.assert_allclose(lost[:, n:], 0, atol=1e-12)
    assert ((lost * rates).sum(axis=1) > 0).all()


def test_payload_is_what_a_node_of_its_mass_and_inertia_is() -> None:
    arm = replace(data_sheet_arm(1), payload_com=[0.0, 0.0])
    last = arm.nodes[-1]
    loaded = replace(arm, nodes=(*arm.nodes[:-1], Node(mass=last.mass + 1.3,
                                                       inertia=last.inertia + 0.006)))
    rng = np.random.default_rng(0)
    x, a = rng.normal(size=(5, 2 * arm.n_coordinates)), rng.normal(size=(5, arm.n_coordinates))
    forces = LightModel(arm).inverse_dynamics(x, a, physical(arm))
    same = LightModel(loaded).inverse_dynamics(x, a, physical(loaded, 0.0, 0.0))
    np.testing.assert_allclose(same, forces, rtol=0, atol=1e-13 * np.abs(forces).max())


def test_elastic_joint_rings_as_two_inertias_on_a_spring() -> None:
    spring, rotor, length, density = 500.0, 0.2, 0.8, 2.0
    arm = Arm(name='one', links=(Link(length=length, linear_density=density),), joints=(
        Joint(motor=Motor(rotor_inertia=rotor), elasticity=Elasticity(stiffness=spring)),))
    link = density * length**3 / 3
    model, p = LightModel(arm), PhysicalParameters.of_arm(arm)
    locked, _ = natural_modes(model, np.zeros(2), p, locked=True)  # type: ignore[arg-type]
    free, _ = natural_modes(model, np.zeros(2), p, locked=False)  # type: ignore[arg-type]
    assert locked == pytest.approx([np.sqrt(spring / link)], rel=1e-12)
    assert free == pytest.approx([0, np.sqrt(spring * (1 / link + 1 / rotor))], rel=1e-12)


def test_tip_hangs_where_gravity_twists_the_joint() -> None:
    spring, mass = 200.0, 1.5
    arm = Arm(name='one', links=(Link(length=1.0, linear_density=1e-6),), gravity=[0, -9.81],
              joints=(Joint(motor=Motor(rotor_inertia=0.1),
                            elasticity=Elasticity(stiffness=spring)),))
    p = PhysicalParameters.of_arm(arm, payload_mass=mass)
    model = LightModel(arm)
    rest, torque = equilibrium(model, np.zeros(1), p)  # type: ignore[arg-type]
    twist = rest[1]
    assert spring * twist == pytest.approx(-mass * 9.81 * np.cos(twist), rel=1e-5)
    assert torque[0] == pytest.approx(-spring * twist, rel=1e-12)
    assert tip_position(arm, rest) == pytest.approx([np.cos(twist), np.sin(twist)], rel=1e-12)
    assert tip_velocity(arm, rest, np.array([0.0, 1.0])) == pytest.approx(
        [-np.sin(twist), np.cos(twist)], rel=1e-12)


@pytest.mark.parametrize('seed', range(2))
def test_energy_is_kept_without_friction_and_damping(seed: int) -> None:
    arm = data_sheet_arm(seed)
    joints = tuple(replace(
        joint, viscous_friction=0.0, coulomb_friction=0.0,
        elasticity=joint.elasticity and Elasticity(stiffness=joint.elasticity.stiffness))
        for joint in arm.joints)
    arm = replace(arm, joints=joints,
                  links=tuple(replace(link, damping_ratio=0.0) for link in arm.links))
    model, p = LightModel(arm), physical(arm)
    rng = np.random.default_rng(seed)
    x = np.concatenate([rng.uniform(-1, 1, arm.n_joints), np.zeros(arm.n_passive),
                        rng.normal(size=arm.n_joints), np.zeros(arm.n_passive)])
    rate, still = model.state_rate(p), np.zeros(arm.n_joints)
    run = solve_ivp(lambda t, state: rate(state, still), (0, 0.5), x, 'DOP853', rtol=1e-12,
                    atol=1e-13)
    energies = [sum(part[0] for part in model.mass_and_energy(state[None], p)[1:])
                for state in run.y.T]
    kinetic = max(model.mass_and_energy(state[None], p)[1][0] for state in run.y.T)
    assert np.ptp(energies) < 1e-10 * kinetic
