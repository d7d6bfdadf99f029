"""
Equations of motion against the paper's appendix, closed forms, quadrature and energy.

The quadrature uses :mod:`flex_planner.arms.kinematics`, which shares no code with the dynamics;
velocities come from a complex step, so that they are exact to rounding.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Link, Node
from flex_planner.arms.kinematics import frame_angles, link_points, tip_position, tip_velocity
from flex_planner.base.validation import Array
from flex_planner.dynamics.integration import simulate
from flex_planner.dynamics.statics import equilibrium, natural_modes, residual_vibration
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from hypothesis import given, settings
from hypothesis import strategies as st
from light_model import LightModel
import numpy as np
import pytest
from scipy.integrate import romb, solve_ivp

BATCH = 20
SEEDS = st.integers(0, 2**32 - 1)
few_examples = settings(max_examples=25)


def random_states(arm: Arm, count: int, seed: int = 0) -> Array:
    """Return states with angles all around, bending of centimetres, speeds to match."""
    rng = np.random.default_rng(seed)
    sizes = np.concatenate([np.full(arm.n_joints, np.pi), np.full(arm.n_modes, 0.03),
                            np.full(arm.n_joints, 4.0), np.full(arm.n_modes, 1.0)])
    states: Array = rng.uniform(-1, 1, (count, sizes.size)) * sizes
    return states


def loaded(arm: Arm, payload_mass: float = 1.7, payload_inertia: float = 0.0) -> Parameters:
    return Parameters.of(arm, payload_mass=payload_mass, payload_inertia=payload_inertia)


def parameters(arm: Arm, payload_mass: float = 1.7, payload_inertia: float = 0.0) -> Array:
    return loaded(arm, payload_mass, payload_inertia).physical


def velocity(function: object, arm: Arm, x: Array, *arguments: int) -> Array:
    """Return the rate of a kinematic quantity along q', by a complex step."""
    q, rates = np.split(x, 2, axis=-1)
    rate: Array = function(arm, q + 1e-20j * rates, *arguments).imag / 1e-20  # type: ignore
    return rate


def kinetic_energy(arm: Arm, x: Array, payload_mass: float,
                   payload_inertia: float = 0.0) -> Array:
    """Integrate the kinetic energy over the links of each state."""
    squares = (velocity(link_points, arm, x, 129)**2).sum(axis=-1)  # (k, n, stations)
    turning = velocity(frame_angles, arm, x)**2
    total = payload_mass * squares[:, -1, -1] / 2
    for i, link in enumerate(arm.links):
        total += link.linear_density * romb(squares[:, i], link.length / 128) / 2
        total += arm.nodes[i].inertia * turning[:, i] / 2
        total += arm.nodes[i + 1].mass * squares[:, i, -1] / 2
    return total + (arm.nodes[-1].inertia + payload_inertia) * tip_turning(arm, x)**2 / 2


def tip_turning(arm: Arm, x: Array) -> Array:
    """Return the angular rate of what sits at the tip: that of the bent link's end."""
    slope = arm.links[-1].mode_shapes().tip_slope
    rate: Array = (velocity(frame_angles, arm, x)[:, -1]
                   + x[:, arm.n_coordinates:][:, arm.modal_slices[-1]] @ slope)
    return rate


def potential_energy(arm: Arm, x: Array, payload_mass: float) -> Array:
    """Integrate the potential energy over the links of each state."""
    q = x[:, :arm.n_coordinates]
    heights = -link_points(arm, q, 129) @ arm.gravity  # (k, n, stations)
    total = payload_mass * heights[:, -1, -1]
    for i, (link, modal) in enumerate(zip(arm.links, arm.modal_slices, strict=True)):
        stations = np.linspace(0, link.length, 129)
        curvature = q[:, modal] @ link.mode_shapes().curvature(stations).T
        density = (link.linear_density * heights[:, i]
                   + link.flexural_rigidity * curvature**2 / 2 if link.modes
                   else link.linear_density * heights[:, i])
        total += romb(density, link.length / 128) + arm.nodes[i + 1].mass * heights[:, i, -1]
    return total


def appendix_inertia(q: Array, L_1: float, L_2: float, rho: float, m_p: float) -> Array:
    """
    Return the inertia matrix of the paper's appendix, in the order of the appendix.

    That order is theta_1, theta_2, q_11, q_21, q_12, q_22. Its garbled places are read as in
    all of J_r12 is multiplied by L_2, rho multiplies its first bracket
    and the bracket of J_rf112.

    """
    _, theta_2, q_11, q_21, q_12, q_22 = q
    c, s, pi = np.cos(theta_2), np.sin(theta_2), np.pi
    J = np.zeros((6, 6))
    J[0, 0] = (rho / 6 * (3*L_1*q_12**2 + 3*L_2*q_22**2 + 3*L_1*q_11**2 + 2*L_1**3
                          + 3*L_2*q_21**2 - 24*L_2*L_1*q_21*s/pi + 6*L_2*L_1**2 + 2*L_2**3
                          + 6*L_2**2*L_1*c)
               + m_p*L_1**2 + 2*m_p*L_1*L_2*c + m_p*L_2**2)
    J[0, 1] = L_2 * (rho * (-12*L_1*q_21*s/pi + 3*q_22**2 + 3*L_2*L_1*c + 2*L_2**2
                            + 3*q_21**2) / 6 + m_p*L_1*c + m_p*L_2)
    J[1, 1] = rho*L_2*(3*q_21**2 + 3*q_22**2 + 2*L_2**2)/6 + m_p*L_2**2
    J[0, 2:] = [rho*L_1**2/pi, (L_2**2 + 2*L_2*L_1*c)*rho/pi, -rho*L_1**2/(2*pi),
                -rho*L_2**2/(2*pi)]
    J[1, 2:] = [0.0, rho*L_2**2/pi, 0.0, -rho*L_2**2/(2*pi)]
    J[2:, 2:] = np.diag([rho*L_1/2, rho*L_2/2, rho*L_1/2, rho*L_2/2])
    return np.triu(J) + np.triu(J, 1).T


APPENDIX_ORDER = [0, 1, 2, 4, 3, 5]  # ours is theta_1, theta_2, q_11, q_12, q_21, q_22


@pytest.mark.parametrize('payload_mass', [0.0, 1.0, 5.85])
def test_mass_matrix_is_that_of_the_appendix(uneven_arm: Arm, uneven_model: ArmModel,
                                             payload_mass: float) -> None:
    x = random_states(uneven_arm, BATCH)
    mass = uneven_model.mass_and_energy(x, parameters(uneven_arm, payload_mass))[0]
    for state, M in zip(x, mass, strict=True):
        q = state[APPENDIX_ORDER]
        expected = appendix_inertia(q, 0.6, 0.35, 6.0, payload_mass)
        # rounding; entries that vanish in the appendix vanish exactly
        np.testing.assert_allclose(M[np.ix_(APPENDIX_ORDER, APPENDIX_ORDER)], expected,
                                   rtol=1e-10, atol=1e-15)


def test_mass_matrix_of_the_preset_is_that_of_table_1(ei50_arm: Arm,
                                                      ei50_model: ArmModel) -> None:
    x = random_states(ei50_arm, 1)
    M = ei50_model.mass_and_energy(x, parameters(ei50_arm, 1.0))[0][0]
    expected = appendix_inertia(x[0, APPENDIX_ORDER], 0.5, 0.5, 3.0 / 0.5, 1.0)
    np.testing.assert_allclose(M[np.ix_(APPENDIX_ORDER, APPENDIX_ORDER)], expected,
                               rtol=1e-10, atol=1e-15)  # rounding


@pytest.mark.parametrize('name', ['workshop', 'crane'])
def test_energies_are_the_integrals_over_the_bent_links(
        name: str, request: pytest.FixtureRequest) -> None:
    model = request.getfixturevalue(f'{name}_model')
    x = random_states(model.arm, BATCH)
    _, kinetic, potential = model.mass_and_energy(x, parameters(model.arm, 1.7, 0.3))
    # Romberg integration over 128 steps of such shapes is exact to rounding
    np.testing.assert_allclose(kinetic, kinetic_energy(model.arm, x, 1.7, 0.3), rtol=1e-11)
    # a difference of weights and bending of up to 1e3 J
    np.testing.assert_allclose(potential, potential_energy(model.arm, x, 1.7), rtol=0,
                               atol=1e-10)


@few_examples
@given(seed=SEEDS)
def test_mass_matrix_is_symmetric_positive_definite_and_gives_the_energy(
        workshop_arm: Arm, workshop_model: ArmModel, seed: int) -> None:
    x = random_states(workshop_arm, BATCH, seed)
    mass, kinetic, _ = workshop_model.mass_and_energy(x, parameters(workshop_arm, seed % 10))
    rates = x[:, 5:]
    # rounding of entries up to ~20 kg m^2
    np.testing.assert_allclose(mass, mass.swapaxes(1, 2), rtol=0, atol=1e-13)
    assert (np.linalg.eigvalsh(mass) > 0).all()
    np.testing.assert_allclose(kinetic, np.einsum('ki,kij,kj->k', rates, mass, rates) / 2,
                               rtol=1e-11)


@few_examples
@given(seed=SEEDS)
def test_inverse_dynamics_undoes_forward_dynamics(workshop_arm: Arm, workshop_model: ArmModel,
                                                  seed: int) -> None:
    x, p = random_states(workshop_arm, BATCH, seed), parameters(workshop_arm, 0.3)
    torque = np.random.default_rng(seed).uniform(-10, 10, (BATCH, 2))
    rate = workshop_model.forward_dynamics(x, torque, p)
    forces = workshop_model.inverse_dynamics(x, rate[:, 5:], p)
    assert np.array_equal(rate[:, :5], x[:, 5:])
    # rounding, relative to the bending forces of up to 1e4 N that cancel
    np.testing.assert_allclose(forces, np.pad(torque, ((0, 0), (0, 3))), atol=1e-8)


def test_inverse_dynamics_is_the_euler_lagrange_equation(workshop_arm: Arm,
                                                         workshop_model: ArmModel) -> None:
    p, h = parameters(workshop_arm), 1e-3
    x, a = random_states(workshop_arm, 1)[0], np.array([3.0, -5.0, 2.0, -4.0, 1.0])
    q, rates = x[:5], x[5:]
    # fourth-order differences: weights of the values at -2h, -h, h, 2h
    offsets, weights = h * np.array([-2, -1, 1, 2]), np.array([1, -8, 8, -1]) / (12 * h)
    path = np.array([[*(q + t*rates + t**2*a/2), *(rates + t*a)] for t in offsets])
    mass = workshop_model.mass_and_energy(path, p)[0]
    momentum_rate = weights @ np.einsum('kij,kj->ki', mass, path[:, 5:])
    force = momentum_rate + [0.3 * rates[0], 0.1 * rates[1], 0.0, 0.0, 0.0]
    for i, direction in enumerate(np.eye(5, 10)):
        _, T, V = workshop_model.mass_and_energy(x + np.outer(offsets, direction), p)
        force[i] -= weights @ (T - V)
    found = workshop_model.inverse_dynamics(x[None], a[None], p)[0]
    # truncation h^4 and rounding 1e-16 / h of forces up to 1e4 N
    np.testing.assert_allclose(found, force, rtol=1e-9, atol=1e-8)


def test_friction_is_the_part_that_changes_sign_with_the_motion(
        workshop_arm: Arm, workshop_model: ArmModel) -> None:
    x, p = random_states(workshop_arm, BATCH), parameters(workshop_arm)
    forces = [workshop_model.inverse_dynamics(np.hstack([x[:, :5], sign * x[:, 5:]]),
                                              np.zeros((BATCH, 5)), p) for sign in (1, -1)]
    expected = x[:, 5:] * [0.3, 0.1, 0.0, 0.0, 0.0]
    np.testing.assert_allclose((forces[0] - forces[1]) / 2, expected, atol=1e-10)  # rounding


@few_examples
@given(seed=SEEDS)
def test_power_of_the_motors_goes_into_energy_and_friction(
        workshop_arm: Arm, workshop_model: ArmModel, seed: int) -> None:
    x, p, h = random_states(workshop_arm, 1, seed), parameters(workshop_arm), 1e-6
    torque = np.random.default_rng(seed).uniform(-10, 10, (1, 2))
    rate = workshop_model.forward_dynamics(x, torque, p)
    _, T, V = workshop_model.mass_and_energy(np.vstack([x - h * rate, x + h * rate]), p)
    speeds = x[0, 5:7]
    power = torque[0] @ speeds - np.array([0.3, 0.1]) @ speeds**2
    # T is quadratic in the speeds, so that their steps of up to 0.1 m/s leave no truncation;
    # rounding is 1e-16 of 1e2 J over h
    assert np.diff(T + V)[0] / (2 * h) == pytest.approx(power, abs=1e-6)


@pytest.mark.parametrize('seed', range(3))
def test_energy_is_conserved_in_free_motion(uneven_arm: Arm, uneven_model: ArmModel,
                                            seed: int) -> None:
    p, start = parameters(uneven_arm), random_states(uneven_arm, 1, seed)[0]
    end = simulate(uneven_model, p, start, lambda t: np.zeros(2), 0.2, rtol=1e-13, atol=1e-13)
    _, T, V = uneven_model.mass_and_energy(np.array([start, end]), p)
    energy = T + V
    assert np.ptp(V) > 0.01 * energy[0]  # energy did go to and fro
    # the integrator's tolerance of 1e-13 a step, over some hundred steps
    assert energy[1] == pytest.approx(energy[0], rel=1e-9)


def test_angular_momentum_is_conserved_in_free_motion(uneven_arm: Arm,
                                                      uneven_model: ArmModel) -> None:
    # about the free first joint: dL/dtheta_1 = 0 without gravity
    p, start = parameters(uneven_arm), random_states(uneven_arm, 1, 5)[0]
    end = simulate(uneven_model, p, start, lambda t: np.zeros(2), 0.2, rtol=1e-13, atol=1e-13)
    x = np.array([start, end])
    momentum = np.einsum('kj,kj->k', uneven_model.mass_and_energy(x, p)[0][:, 0], x[:, 6:])
    assert momentum[1] == pytest.approx(momentum[0], rel=1e-9)  # as the energy


def test_payload_adds_the_energy_of_a_mass_at_the_tip(workshop_arm: Arm,
                                                      workshop_model: ArmModel) -> None:
    x = random_states(workshop_arm, BATCH)
    empty, loaded = (workshop_model.mass_and_energy(x, parameters(workshop_arm, mass))
                     for mass in (0.0, 2.0))
    tip_speed = velocity(tip_position, workshop_arm, x)
    np.testing.assert_allclose(loaded[1] - empty[1], (tip_speed**2).sum(axis=1), rtol=1e-11)
    heights = -tip_position(workshop_arm, x[:, :5]) @ workshop_arm.gravity
    # rounding of bending energies up to 1e2 J
    np.testing.assert_allclose(loaded[2] - empty[2], 2 * heights, atol=1e-11)


def test_payload_adds_the_energy_of_the_tip_velocity_of_a_clamped_chain(
        crane_arm: Arm, crane_model: ArmModel) -> None:
    x = random_states(crane_arm, BATCH)
    empty, loaded_ = (crane_model.mass_and_energy(x, parameters(crane_arm, mass))[1]
                      for mass in (0.0, 2.0))
    speed = tip_velocity(crane_arm, *np.split(x, 2, axis=1))
    np.testing.assert_allclose(loaded_ - empty, (speed**2).sum(axis=1), rtol=1e-11)  # rounding


def test_inertia_of_the_payload_turns_with_the_bent_tip(crane_arm: Arm,
                                                        crane_model: ArmModel) -> None:
    x = random_states(crane_arm, BATCH)
    point, body = (crane_model.mass_and_energy(x, parameters(crane_arm, 1.0, inertia))
                   for inertia in (0.0, 2.0))
    np.testing.assert_allclose(body[1] - point[1], tip_turning(crane_arm, x)**2, rtol=1e-10)
    assert np.array_equal(body[2], point[2])  # no weight of its own


def test_inertia_of_the_payload_is_that_of_the_last_node(crane_arm: Arm,
                                                         crane_model: ArmModel) -> None:
    nodes = (*crane_arm.nodes[:2], replace(crane_arm.nodes[2], mass=1.4, inertia=0.21))
    x, a = random_states(crane_arm, BATCH), np.random.default_rng(1).normal(size=(BATCH, 5))
    expected = LightModel(replace(crane_arm, nodes=nodes)).inverse_dynamics(
        x, a, parameters(crane_arm, 0.0))
    found = crane_model.inverse_dynamics(x, a, parameters(crane_arm, 1.0, 0.2))
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-9)  # rounding of 1e4 N


def test_damping_ratio_is_that_of_each_mode_of_the_link_by_itself(crane_arm: Arm,
                                                                  crane_model: ArmModel) -> None:
    x, p = random_states(crane_arm, BATCH), parameters(crane_arm)
    forces = [crane_model.inverse_dynamics(np.hstack([x[:, :5], sign * x[:, 5:]]),
                                           np.zeros((BATCH, 5)), p) for sign in (1, -1)]
    coefficients = [0.3, 0.1]
    for link in crane_arm.links:
        shapes = link.mode_shapes()
        mass = link.linear_density * np.diag(shapes.gram)
        frequency = np.sqrt(link.flexural_rigidity * np.diag(shapes.stiffness) / mass)
        coefficients += [*2 * link.damping_ratio * frequency * mass]
    np.testing.assert_allclose((forces[0] - forces[1]) / 2, x[:, 5:] * coefficients, rtol=1e-9,
                               atol=1e-9)  # rounding of bending forces up to 1e4 N


def test_damping_takes_energy_from_free_motion(crane_arm: Arm, crane_model: ArmModel) -> None:
    p, x = parameters(crane_arm, 1.0, 0.1), random_states(crane_arm, 1, 7)[0] * 0.5
    energies = []
    for _ in range(6):
        energies.append(sum(part[0] for part in crane_model.mass_and_energy(x[None], p)[1:]))
        x = simulate(crane_model, p, x, lambda t: np.zeros(2), 0.05)
    assert (np.diff(energies) < 0).all()
    free = replace(crane_arm, joints=(Joint(), Joint()),
                   links=tuple(replace(link, damping_ratio=0.0) for link in crane_arm.links))
    drift = [sum(part[0] for part in LightModel(free).mass_and_energy(state[None], p)[1:])
             for state in (x, simulate(LightModel(free), p, x, lambda t: np.zeros(2), 0.05))]
    assert drift[1] == pytest.approx(drift[0], abs=1e-6)  # of the integrator at 1e-8


def test_force_at_rest_is_the_gradient_of_the_potential(workshop_arm: Arm,
                                                        workshop_model: ArmModel) -> None:
    p, h = parameters(workshop_arm), 1e-4
    x = random_states(workshop_arm, 1)[0] * np.repeat([1.0, 0.0], 5)
    gradient = [np.diff(workshop_model.mass_and_energy(x + np.outer([-h, h], e), p)[2])[0]
                for e in np.eye(5, 10)]
    force = workshop_model.inverse_dynamics(x[None], np.zeros((1, 5)), p)[0]
    # h^2/6 of a torque of 50 N m; bending is quadratic, its difference exact
    np.testing.assert_allclose(np.array(gradient) / (2 * h), force, atol=1e-6)


def two_link_textbook(x: Array, a: Array, m_p: float) -> Array:
    """
    Return the torques of the paper's arm made rigid, in the usual closed form.

    Spong, Hutchinson, Vidyasagar, Robot Modeling and Control, section 7.4: uniform rods of
    length 0.5 m and mass 3 kg, the payload a point at the tip.

    """
    _, theta_2, w_1, w_2 = x
    length, m = 0.5, 3.0
    c, s = np.cos(theta_2), np.sin(theta_2)
    inner = m * length**2 / 3 + (m + m_p) * length**2
    outer = m * length**2 / 3 + m_p * length**2
    mixed = (m / 2 + m_p) * length**2
    M = np.array([[inner + outer + 2*mixed*c, outer + mixed*c], [outer + mixed*c, outer]])
    h = mixed * s * np.array([-w_2 * (2*w_1 + w_2), w_1**2])
    torques: Array = M @ a + h
    return torques


def test_rigid_arm_agrees_with_the_textbook(rigid_arm: Arm, rigid_model: ArmModel) -> None:
    x, a = random_states(rigid_arm, BATCH), np.random.default_rng(3).normal(size=(BATCH, 2))
    found = rigid_model.inverse_dynamics(x, a, parameters(rigid_arm, 2.2))
    expected = [two_link_textbook(state, acceleration, 2.2)
                for state, acceleration in zip(x, a, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)  # rounding


def test_unbent_flexible_arm_has_the_mass_matrix_of_the_rigid_arm(
        ei50_arm: Arm, ei50_model: ArmModel, rigid_arm: Arm, rigid_model: ArmModel) -> None:
    joints = random_states(rigid_arm, BATCH)
    x = np.zeros((BATCH, 12))
    x[:, [0, 1, 6, 7]] = joints
    rigid = rigid_model.mass_and_energy(joints, parameters(rigid_arm))[0]
    flexible = ei50_model.mass_and_energy(x, parameters(ei50_arm))[0]
    np.testing.assert_allclose(flexible[:, :2, :2], rigid, rtol=1e-13)  # rounding


@pytest.fixture(scope='module')
def pendulum() -> Arm:
    node = Node(mass=0.7, inertia=0.3)
    return Arm(name='pendulum', links=(Link(length=0.8, linear_density=2.0),),
               joints=(Joint(viscous_friction=0.25),),
               nodes=(Node(mass=9.0, inertia=0.11), node), gravity=[0.0, -9.81])


def test_pendulum_obeys_its_closed_form(pendulum: Arm) -> None:
    x, a, payload = np.array([[0.4, 1.3], [2.0, -0.2]]), np.array([[2.0], [-1.0]]), 0.5
    found = ArmModel(pendulum).inverse_dynamics(x, a, parameters(pendulum, payload))
    mass, length = 2.0 * 0.8, 0.8
    inertia = mass * length**2 / 3 + 0.11 + 0.3 + (0.7 + payload) * length**2
    lever = (mass / 2 + 0.7 + payload) * length
    expected = inertia * a[:, 0] + 0.25 * x[:, 1] + 9.81 * lever * np.cos(x[:, 0])
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-13)  # rounding


@pytest.fixture(scope='module')
def hanging_arm() -> Arm:
    """Return the arm of section 5.1's model verification, with one mode per link."""
    link = Link(length=0.5, linear_density=6.0, flexural_rigidity=100.0, modes=1)
    return Arm(name='hanging', links=(link, link), joints=(Joint(), Joint()),
               gravity=[0.0, -9.81])


def swing(model: ArmModel, p: Array, times: Array) -> Array:
    """Return the joint angles of fig. 4's motion: freely from (-1.5, -0.5) rad at rest."""
    rate, start = model.state_rate(p), np.zeros(2 * model.arm.n_coordinates)
    start[:2] = -1.5, -0.5
    motion = solve_ivp(lambda t, x: rate(x, np.zeros(2)).copy(), (0, times[-1]), start,
                       method='DOP853', t_eval=times, rtol=1e-8, atol=1e-10)
    angles: Array = motion.y[:2]
    return angles


def test_response_tends_to_that_of_the_rigid_arm_as_it_stiffens(hanging_arm: Arm) -> None:
    times, model = np.linspace(0, 0.6, 61), ArmModel(hanging_arm)
    rigid = hanging_arm.rigid()
    expected = swing(ArmModel(rigid), parameters(rigid, 0.0), times)
    distances = []
    for rigidity in (100.0, 400.0, 1600.0):
        soft = replace(Parameters.of(hanging_arm), rigidity=np.full(2, rigidity))
        distances.append(np.abs(swing(model, soft.physical, times) - expected).max())
    # fig. 4: E I = 100 is very close; the sag, and with it the distance, goes as 1 / E I
    assert distances[0] < 0.01
    np.testing.assert_allclose(np.divide(distances[:-1], distances[1:]), 4.0, rtol=0.15)


# At rest


def test_equilibrium_leaves_no_force_on_the_modes(workshop_arm: Arm,
                                                  workshop_model: ArmModel) -> None:
    p = loaded(workshop_arm)
    coordinates, torque = equilibrium(workshop_model, np.array([0.3, -0.8]), p)
    x = np.concatenate([coordinates, np.zeros(5)])[None]
    force = workshop_model.inverse_dynamics(x, np.zeros((1, 5)), p.physical)[0]
    np.testing.assert_allclose(force[2:], 0, atol=1e-12)  # rounding of ~10 N
    assert coordinates[:2].tolist() == [0.3, -0.8]
    # another order of summation: rounding of ~30 N m
    np.testing.assert_allclose(torque, force[:2], rtol=1e-13)
    assert np.abs(torque).min() > 1.0


def test_equilibrium_of_a_level_link_is_the_sag_of_a_beam(hanging_arm: Arm) -> None:
    # simply supported under its weight: 5 rho g L^4 / (384 E I) in the middle, of which the
    # first sine carries 4 rho g L^4 / (pi^5 E I)
    coordinates, _ = equilibrium(ArmModel(hanging_arm), np.zeros(2),
                                 loaded(hanging_arm))
    expected = -4 * 6.0 * 9.81 * 0.5**4 / (np.pi**5 * 100.0)
    np.testing.assert_allclose(coordinates, [0, 0, expected, expected], rtol=1e-12)  # rounding


def test_rigid_arm_is_held_by_the_moment_of_its_weight(hanging_arm: Arm) -> None:
    rigid = hanging_arm.rigid()
    coordinates, torque = equilibrium(ArmModel(rigid), np.zeros(2),
                                      loaded(rigid, 1.0))
    assert coordinates.tolist() == [0.0, 0.0]
    # two rods of 3 kg and a payload of 1 kg, level: levers 0.25, 0.75, 1 and 0.25, 0.5 m
    np.testing.assert_allclose(torque, [9.81 * 4.0, 9.81 * 1.25], rtol=1e-13)  # rounding


def test_locked_links_ring_with_the_frequencies_of_pinned_beams(uneven_arm: Arm,
                                                                uneven_model: ArmModel) -> None:
    # the payload does not load pinned links, and locked joints part them
    q, p = np.array([0.5, 1.0, 0, 0, 0, 0]), loaded(uneven_arm)
    frequencies, vectors = natural_modes(uneven_model, q, p, locked=True)
    order = np.array([1, 2])
    expected = [*(order * np.pi / 0.6)**2 * np.sqrt(50 / 6.0),
                *(order * np.pi / 0.35)**2 * np.sqrt(20 / 6.0)]
    np.testing.assert_allclose(frequencies, np.sort(expected), rtol=1e-12)  # rounding
    stiffness = uneven_model.static_forces(q[None], p.physical)[1][0, 2:, 2:]
    np.testing.assert_allclose(vectors.T @ stiffness @ vectors, np.diag(frequencies**2),
                               atol=1e-12 * frequencies[-1]**2)


@pytest.mark.parametrize(('entry', 'value', 'expected'), [
    # a half-sine of 2 mm; of mode 2, which the stations meet at its peak; a speed over omega
    (2, 2e-3, 2e-3), (3, 1e-3, 1e-3), (8, 0.1, 0.1 / ((np.pi / 0.6)**2 * np.sqrt(50 / 6.0)))])
def test_residual_vibration_is_the_amplitude_of_the_ringing(
        uneven_arm: Arm, uneven_model: ArmModel, entry: int, value: float,
        expected: float) -> None:
    rest, state = np.array([0.5, 1.0, 0, 0, 0, 0]), np.zeros(12)
    state[:6], state[entry] = rest, value
    found = residual_vibration(uneven_model, state, rest, loaded(uneven_arm))
    assert found == pytest.approx(expected, rel=1e-12)  # rounding


def test_arm_at_rest_or_rigid_does_not_ring(uneven_arm: Arm, uneven_model: ArmModel,
                                            rigid_arm: Arm, rigid_model: ArmModel) -> None:
    rest = np.array([0.5, 1.0, 0, 0, 0, 0])
    state = np.concatenate([rest, np.zeros(6)])
    assert residual_vibration(uneven_model, state, rest, loaded(uneven_arm)) == 0.0
    assert residual_vibration(rigid_model, np.ones(4), np.ones(2), loaded(rigid_arm)) == 0.0


def test_failed_simulation_is_nan(rigid_model: ArmModel, rigid_arm: Arm) -> None:
    end = simulate(rigid_model, parameters(rigid_arm), np.zeros(4),
                   lambda t: np.full(2, np.nan if t > 0.5 else 0.1), 1.0)
    assert np.isnan(end).all()
