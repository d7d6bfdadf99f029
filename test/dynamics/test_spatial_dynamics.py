"""Spatial arms: against Pinocchio, against energies of points, against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import json
from pathlib import Path

import casadi as ca
from flex_planner.arms.arm_files import arm_from_mapping, load_arm
from flex_planner.arms.joint import Elasticity, Motor
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import (
    as_matrix,
    as_point,
    join_bodies,
    place_body,
    SpatialBody,
    turn_rpy,
)
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_kinematics import tip_frame, tip_moves
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.dynamics_functions import build_dynamics_functions, physical_symbols
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import residual_vibration
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from spatial_arms import flexible_3r, oblique, panda, tudor, ur5, without_friction, yaw_pitch
from spatial_energies import SpatialEnergies

DATA = Path(__file__).parents[1] / 'data' / 'spatial'
PAYLOAD, INERTIA = 1.3, 0.02


def branched() -> SpatialArm:
    """Return the arm of the URDF file, without friction."""
    arm = arm_from_mapping({
        'urdf': 'branched.urdf', 'tip': 'tool', 'locked_joints': {'grip': 0.03},
        'payload': {'center_of_mass': [0.01, 0.02, 0.03]}}, folder=DATA)
    assert isinstance(arm, SpatialArm)
    return replace(arm, joints=tuple(replace(joint, viscous_friction=0.0, coulomb_friction=0.0)
                                     for joint in arm.joints))


def forces(arm: SpatialArm) -> Callable[..., Array]:
    """Return M a + h of an arm as a function of q, q', a and a payload."""
    chain = build_chain(arm)
    function = ca.Function('f', [chain.coordinates, chain.rates, chain.accelerations,
                                 physical_symbols(chain)],
                           [ca.gradient(chain.power, chain.virtual_rates)])

    def evaluate(q: Array, rates: Array, a: Array, mass: float, inertia: float) -> Array:
        physical = PhysicalParameters.of_arm(arm, payload_mass=mass,
                                             payload_inertia=inertia).physical
        return np.array(function(q, rates, a, physical)).ravel()

    return evaluate


def test_imported_urdf_has_the_torques_and_the_tip_of_pinocchio() -> None:
    arm, states = branched(), json.loads((DATA / 'pinocchio.json').read_text())['states']
    torques = forces(arm)
    for state in states:
        q, rates, a = (np.array(state[name]) for name in ('positions', 'rates', 'accelerations'))
        np.testing.assert_allclose(torques(q, rates, a, 1.7, 0.0), state['torques'], rtol=1e-11,
                                   atol=1e-11)
        place, axes = tip_frame(arm, q)
        np.testing.assert_allclose(place, state['tip'], atol=2e-13)
        np.testing.assert_allclose(axes, state['axes'], atol=2e-13)
        np.testing.assert_allclose(tip_moves(arm, q), state['jacobian'], atol=5e-13)


def lagrange(arm: SpatialArm) -> Callable[..., Array]:
    """Return the forces of Lagrange's equations from the energies of points."""
    n_t = arm.n_coordinates
    q, rates, a = (ca.SX.sym(name, n_t) for name in ('q', 'v', 'a'))
    mass, inertia = ca.SX.sym('m'), ca.SX.sym('J')
    energies = SpatialEnergies(arm, q, rates, mass, inertia)
    momentum = ca.gradient(energies.kinetic, rates)
    force = (ca.jtimes(momentum, rates, a) + ca.jtimes(momentum, q, rates)
             - ca.gradient(energies.kinetic - energies.potential, q))
    function = ca.Function('g', [q, rates, a, mass, inertia], [force])
    return lambda *values: np.array(function(*values)).ravel()


def point(arm: SpatialArm, seed: int, bent: float) -> list[Array]:
    rng, n = np.random.default_rng(seed), arm.n_joints
    q = np.concatenate([rng.uniform(-3, 3, n), bent * rng.normal(size=arm.n_passive)])
    return [q, rng.normal(size=arm.n_coordinates), rng.normal(size=arm.n_coordinates)]


def tilted() -> SpatialArm:
    """Return an arm with a slanting beam, an oblique axis after it, and a turned tip."""
    arm = yaw_pitch()
    beam = arm.links[1].beam
    assert beam is not None
    slanting = replace(beam, twist_modes=1, torsional_rigidity=40.0, polar_inertia=2e-4)
    links = (arm.links[0], replace(arm.links[1], end=(0.3, -0.2, 0.4), beam=slanting),
             replace(arm.links[1], beam=None, end=(0.1, 0.2, 0.0)))
    joints = (*arm.joints, SpatialJoint(axis=(1, -2, 0.5), rotation=((0, 0, 1), (1, 0, 0),
                                                                     (0, 1, 0))))
    return replace(arm, links=links, joints=joints,
                   tip_rotation=((0, -1, 0), (1, 0, 0), (0, 0, 1)))


ARMS = {'3R': lambda: flexible_3r(2, 1), 'tudor': tudor, 'panda': panda, 'oblique': oblique,
        'elastic UR5': lambda: ur5((0, 2)), 'tilted': tilted}


@pytest.mark.parametrize('name', ARMS)
def test_forces_are_those_of_lagrange(name: str) -> None:
    arm = without_friction(ARMS[name]())
    ours, others = forces(arm), lagrange(arm)
    for seed in range(3):
        state = point(arm, seed, 0.02)
        expected = others(*state, PAYLOAD, INERTIA)
        np.testing.assert_allclose(ours(*state, PAYLOAD, INERTIA), expected, rtol=0,
                                   atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize('name', ['3R', 'oblique', 'tilted'])
def test_payload_with_a_tensor_is_a_body_at_the_tip(name: str) -> None:
    arm = ARMS[name]()
    place, tensor = np.array([0.05, -0.02, 0.1]), turn_rpy(0.3, -0.8, 1.1) @ np.diag(
        [0.01, 0.02, 0.025]) @ turn_rpy(0.3, -0.8, 1.1).T
    carried = SpatialBody(mass=PAYLOAD, center_of_mass=place, inertia=(tensor + tensor.T) / 2)
    last = arm.links[-1]
    whole = join_bodies(last.tip_body, place_body(carried, np.zeros(3),
                                                  np.array(arm.tip_rotation)))
    by_body = forces(replace(arm, links=(*arm.links[:-1], replace(last, tip_body=whole))))
    by_payload = forces(replace(arm, payload_com=place, payload_tensor=tensor))
    for seed in range(3):
        state = point(arm, seed, 0.02)
        expected = by_body(*state, 0.0, 0.0)
        np.testing.assert_allclose(by_payload(*state, PAYLOAD, 0.0), expected, rtol=0,
                                   atol=1e-12 * np.abs(expected).max())


def test_shortened_beams_are_right_to_second_order() -> None:
    arm = without_friction(flexible_3r(foreshortening=True))
    ours, others, plain = forces(arm), lagrange(arm), lagrange(without_friction(flexible_3r()))
    errors, effects = [], []
    for bent in (2e-3, 1e-3):
        state = point(arm, 0, bent)
        # fast joints, as those of the modes are small with what they displace
        state[1][3:] *= bent
        state[2][3:] *= bent
        found = ours(*state, PAYLOAD, INERTIA)
        errors.append(np.abs(found - others(*state, PAYLOAD, INERTIA)).max())
        effects.append(np.abs(found - plain(*state, PAYLOAD, INERTIA)).max())
    # what is left out is of the third order in energies, of the second in forces
    assert errors[1] < 0.3 * errors[0] < 0.01 * effects[0]
    assert effects[1] == pytest.approx(effects[0] / 2, rel=0.05)


def test_cantilever_has_its_frequencies_in_both_planes_and_in_torsion() -> None:
    beam = SpatialBeam(linear_density=2.0, flexural_rigidity=(100.0, 400.0), modes=(3, 3),
                       torsional_rigidity=50.0, polar_inertia=1e-3, twist_modes=3)
    arm = SpatialArm(name='cantilever', gravity=[0, 0, 0], joints=(SpatialJoint(axis=(0, 1, 0)),),
                     links=(SpatialLink(end=(0, 0, 1.0), beam=beam),))
    functions = build_dynamics_functions(arm)
    physical = PhysicalParameters.of_arm(arm).physical
    mass = np.array(functions['mass_and_energy'][0](np.zeros(20), physical)[0])[1:, 1:]
    stiffness = np.array(functions['static_forces'][0](np.zeros(10), physical)[1])[1:, 1:]
    roots = np.array([1.8751040687119611, 4.694091132974175, 7.854757438237613])**2
    torsion = (np.arange(3) + 0.5) * np.pi * np.sqrt(50.0 / 1e-3)
    exact = np.sort([*roots * np.sqrt(50.0), *roots * np.sqrt(200.0), *torsion])
    np.testing.assert_allclose(np.sqrt(eigh(stiffness, mass)[0]), exact, rtol=1e-10)


def test_weight_softens_a_column_that_is_shortened_by_bending() -> None:
    arm = yaw_pitch(foreshortening=True)
    link = arm.links[1]
    upright = replace(arm, gravity=[0, 0, -9.81])
    functions = build_dynamics_functions(upright)
    physical = PhysicalParameters.of_arm(upright, payload_mass=PAYLOAD).physical
    # pitched by a quarter turn back, the beam stands
    q = np.array([0.0, -np.pi / 2, 0.0, 0.0])
    stiffness = np.array(functions['static_forces'][0](q, physical)[1])[2:, 2:]
    beam, L = link.beam, link.length
    assert beam is not None
    x, w = np.polynomial.legendre.leggauss(40)
    x, w = (x + 1) / 2 * L, w / 2 * L
    for plane in range(2):
        modes = beam.bend(L, plane)
        slope = modes.slope(x)[:, 0]
        weight = 9.81 * (beam.linear_density * (L - x) + link.tip_body.mass + PAYLOAD)
        expected = (beam.flexural_rigidity[plane] * modes.stiffness[0, 0]
                    - w @ (weight * slope**2))
        center = link.tip_body.center_of_mass[0] * link.tip_body.mass
        # what sits beyond the tip is lowered by its slope, too
        expected -= 9.81 * center * modes.tip_slope[0]**2
        assert stiffness[plane, plane] == pytest.approx(expected, rel=1e-9)


def test_energy_of_a_free_motion_stays() -> None:
    arm = without_friction(yaw_pitch(foreshortening=True))
    dynamics, n_t = ArmDynamics.of(arm), arm.n_coordinates
    physical = PhysicalParameters.of_arm(arm, payload_mass=0.5).physical
    state = np.array([0.3, -0.4, 0.01, -0.02, 2.0, -1.0, 0.1, 0.2])
    rate = dynamics.state_rate(physical)
    found = solve_ivp(lambda t, x: rate(x, np.zeros(2)), (0, 0.5), state, method='DOP853',
                      rtol=1e-11, atol=1e-12)
    _, kinetic, potential = dynamics.mass_and_energy(found.y.T, physical)
    energy = kinetic + potential
    assert state.size == 2 * n_t
    assert np.ptp(kinetic) > 0.1
    assert np.ptp(energy) < 1e-8 * np.ptp(kinetic)


def test_a_very_stiff_joint_is_a_rigid_one_with_its_rotor() -> None:
    arm = yaw_pitch()
    motor = Motor(rotor_inertia=0.05)
    rigid = replace(arm, joints=tuple(replace(joint, motor=motor) for joint in arm.joints))
    soft = replace(rigid, joints=tuple(replace(joint, elasticity=Elasticity(stiffness=1e9))
                                       for joint in rigid.joints))
    x, torque = np.array([0.2, 0.5, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0]), np.array([3.0, 2.0])
    expected = rate_of(rigid, x, torque)
    twisted = np.insert(np.insert(x, 6, [0.0, 0.0]), 2, [0.0, 0.0])
    # at rest of the springs: their torque is that of the links
    found = rate_of(soft, twist_of(soft, twisted, torque), torque)
    links = found[6:8] + found[8:10]
    np.testing.assert_allclose(links, expected[4:6], rtol=1e-5)


def rate_of(arm: SpatialArm, x: Array, torque: Array) -> Array:
    function = build_dynamics_functions(arm)['forward_dynamics'][0]
    return np.array(function(x, torque, PhysicalParameters.of_arm(arm).physical)).ravel()


def twist_of(arm: SpatialArm, x: Array, torque: Array) -> Array:
    """Return a state with the twists at which motors and links accelerate alike."""
    x = x.copy()
    for _ in range(3):
        a = rate_of(arm, x, torque)[6:]
        # a twist e adds to the acceleration of e: -k e / inertia, found by a difference
        slope = np.zeros((2, 2))
        for i in range(2):
            moved = x.copy()
            moved[2 + i] += 1e-9
            slope[:, i] = (rate_of(arm, moved, torque)[8:10] - a[2:4]) / 1e-9
        x[2:4] -= np.linalg.solve(slope, a[2:4])
    return x


def test_planar_arm_in_space_has_the_same_forces() -> None:
    planar = load_arm('clamped_motors')
    arm = SpatialArm.of_planar(planar)
    ours, chain = forces(arm), build_chain(planar)
    function = ca.Function('f', [chain.coordinates, chain.rates, chain.accelerations,
                                 physical_symbols(chain)],
                           [ca.gradient(chain.power, chain.virtual_rates)])
    for seed in range(3):
        state = point(arm, seed, 0.05)
        physical = PhysicalParameters.of_arm(planar, payload_mass=PAYLOAD,
                                             payload_inertia=INERTIA).physical
        expected = np.array(function(*state, physical)).ravel()
        np.testing.assert_allclose(ours(*state, PAYLOAD, INERTIA), expected, rtol=0,
                                   atol=1e-13 * np.abs(expected).max())


def test_forces_do_not_depend_on_how_frames_are_named() -> None:
    arm = flexible_3r(1, 1)
    turn = turn_rpy(0.5, -0.7, 1.9)
    link, (first, second, third) = arm.links[1], arm.joints
    beam = link.beam
    assert beam is not None
    renamed = replace(
        arm, joints=(first, replace(second, rotation=as_matrix(turn),
                                    axis=as_point(turn.T @ second.axis)),
                     replace(third, rotation=as_matrix(turn.T))),
        links=(arm.links[0], replace(
            link, end=as_point(turn.T @ link.end),
            body=place_body(link.body, np.zeros(3), turn.T),
            tip_body=place_body(link.tip_body, np.zeros(3), turn.T),
            beam=replace(beam, across=as_point(turn.T @ [0, 1, 0]))), arm.links[2]))
    state = point(arm, 0, 0.02)
    expected = forces(arm)(*state, PAYLOAD, INERTIA)
    np.testing.assert_allclose(forces(renamed)(*state, PAYLOAD, INERTIA), expected, rtol=0,
                               atol=1e-12 * np.abs(expected).max())


def test_twisting_that_swings_the_tip_counts_as_vibration() -> None:
    beam = SpatialBeam(linear_density=1.0, torsional_rigidity=5.0, polar_inertia=1e-3,
                       twist_modes=1)
    arm = SpatialArm(
        name='crank', gravity=[0, 0, 0], joints=(SpatialJoint(axis=(0, 1, 0)), SpatialJoint()),
        links=(SpatialLink(end=(1.0, 0, 0), beam=beam),
               SpatialLink(end=(0, 0.2, 0), tip_body=SpatialBody(mass=0.5))))
    parameters, twist = PhysicalParameters.of_arm(arm), 1e-3
    state = np.array([0.0, 0.0, twist, 0.0, 0.0, 0.0])
    turned = twist * beam.twist(1.0).turn(np.array([1.0]))[0, 0]
    found = residual_vibration(ArmDynamics.of(arm), state, np.zeros(3), parameters)
    # the second link stands across the first one, as a crank
    assert found == pytest.approx(0.2 * turned, rel=1e-9)
