"""An arm under its joint controller, against the same step by step."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import ControlledArm, locked_bending
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import integrate, LinearTorque
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np
import pytest
from scipy.integrate import solve_ivp

GAINS = Gains(stiffness=np.array([60.0, 30.0]), damping=np.array([4.0, 2.0]))
FREE = Gains.of(2, 0.0, 0.0)
START = np.array([-1.3, 0.3])


@pytest.fixture(scope='module')
def dynamics(workshop_arm: Arm) -> ArmDynamics:
    return ArmDynamics(workshop_arm)


@pytest.fixture(scope='module')
def parameters(workshop_arm: Arm) -> PhysicalParameters:
    return PhysicalParameters.of_arm(workshop_arm, payload_mass=0.3)


def controlled(dynamics: ArmDynamics, parameters: PhysicalParameters,
               gains: Gains = GAINS, **changes: object) -> ControlledArm:
    controller = JointController(gains=gains, **changes)  # type: ignore[arg-type]
    return ControlledArm(dynamics=dynamics, parameters=parameters, controller=controller)


def at_rest(dynamics: ArmDynamics, parameters: PhysicalParameters) -> Array:
    rest, _ = equilibrium(dynamics, START, parameters)
    return np.concatenate([rest, np.zeros_like(rest)])


@pytest.fixture(scope='module')
def reference() -> JointReference:
    """Return a trajectory that asks for about as much as the motors can do, and for more."""
    rng, count = np.random.default_rng(3), 8
    positions, velocities, accelerations, torques = rng.uniform(-1, 1, (4, count, 2))
    return JointReference(
        times=np.linspace(0, 0.14, count), positions=START + 0.05 * positions,
        velocities=velocities, accelerations=10 * accelerations,
        torques=np.sign(torques) * (0.9 + 0.2 * np.abs(torques)) * [9.0, 5.0])


@pytest.mark.parametrize('hold', [EffortHold.END, EffortHold.START, EffortHold.MIDDLE])
def test_arm_moves_as_scipy_has_it_period_by_period(
        dynamics: ArmDynamics, parameters: PhysicalParameters, reference: JointReference,
        hold: EffortHold) -> None:
    rate, state = 100.0, at_rest(dynamics, parameters)
    found = controlled(dynamics, parameters, rate=rate, hold=hold).follow(reference, state, 0.12)
    limits, crossed = TorqueLimits.of(dynamics.arm), 0
    n_t = dynamics.arm.n_coordinates
    for k in range(12):
        position, velocity = reference.motion(k / rate)
        wanted = (GAINS.stiffness * (position - state[:2])
                  + GAINS.damping * (velocity - state[n_t:n_t + 2])
                  + reference.torque((k + hold.delay) / rate))

        # the motors have their limits at the speeds of every instant
        def state_rate(time: float, x: Array, wanted: Array = wanted) -> Array:
            torque = np.clip(wanted, *limits.bounds(x[n_t:n_t + 2]))
            rates: Array = dynamics.forward_dynamics(x[None], torque[None],
                                                     parameters.physical)[0]
            return rates

        # steps that never cross the end of a limit by more than 50 us
        solved = solve_ivp(state_rate, (0, 1 / rate), state, method='DOP853', max_step=5e-5)
        state = solved.y[:, -1]
        beyond = np.array([wanted != np.clip(wanted, *limits.bounds(speeds))
                           for speeds in solved.y[n_t:n_t + 2].T])
        crossed += int((beyond.any(axis=0) & ~beyond.all(axis=0)).any())
        # every step is good to 1e-8 of the state
        np.testing.assert_allclose(found.states[k + 1], state, rtol=1e-6, atol=1e-7)
    assert crossed


def test_efforts_without_a_hold_are_linear(dynamics: ArmDynamics, parameters: PhysicalParameters,
                                           reference: JointReference) -> None:
    times = np.linspace(0, 0.14, 15)
    weak = JointReference(
        times=times, torques=np.sin(30 * times)[:, None] * [1.0, 0.5],
        positions=np.zeros((15, 2)), velocities=np.zeros((15, 2)),
        accelerations=np.zeros((15, 2)))
    start = at_rest(dynamics, parameters)
    found = controlled(dynamics, parameters, FREE, hold=EffortHold.LINEAR).follow(
        weak, start, 0.14)
    expected = integrate(dynamics, parameters.physical, start, LinearTorque(times, weak.torques))
    np.testing.assert_allclose(found.states[::10], expected, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(found.times[::10], times, atol=1e-12)


def test_steps_are_as_short_as_their_error_wants(
        dynamics: ArmDynamics, parameters: PhysicalParameters, reference: JointReference,
        monkeypatch: pytest.MonkeyPatch) -> None:
    start = at_rest(dynamics, parameters)
    arm = controlled(dynamics, parameters, FREE, rate=500.0)
    expected = arm.follow(reference, start, 0.14).states
    monkeypatch.setattr('flex_planner.control.controlled_motion._LONGEST_STEP', 1.0)
    # one step of 2 ms in each period, where the error allows it
    np.testing.assert_allclose(arm.follow(reference, start, 0.14).states, expected, rtol=1e-5,
                               atol=1e-6)


def test_arm_that_runs_away_is_not_a_number_from_there(
        dynamics: ArmDynamics, parameters: PhysicalParameters, reference: JointReference) -> None:
    strong = controlled(dynamics, parameters, Gains.of(2, 1e9, 1e9))
    free = ArmDynamics(dynamics.arm)  # its motors have no limits
    monkey = TorqueLimits(np.full(2, np.inf), np.zeros(2), np.full(2, np.inf))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TorqueLimits, 'of', classmethod(lambda cls, arm: monkey))
        states = strong.follow(reference, at_rest(free, parameters), 0.14).states
    assert np.isfinite(states[0]).all()
    assert np.isnan(states[-1]).all()


def test_motion_ends_with_the_period_of_its_end(dynamics: ArmDynamics,
                                                parameters: PhysicalParameters,
                                                reference: JointReference) -> None:
    start = at_rest(dynamics, parameters)
    for until, periods in ((0.0101, 2), (0.02, 2), (0.01, 1)):
        found = controlled(dynamics, parameters, rate=100.0).follow(reference, start, until)
        assert found.times.size == periods + 1 == len(found.states)


def test_motion_listens_to_its_monitor(dynamics: ArmDynamics, parameters: PhysicalParameters,
                                       reference: JointReference) -> None:
    with pytest.raises(StoppedError):
        controlled(dynamics, parameters).follow(reference, at_rest(dynamics, parameters), 1.0,
                                                Monitor(canceled=lambda: True))


def test_bending_with_locked_joints_is_what_bends_and_what_turns(
        dynamics: ArmDynamics, parameters: PhysicalParameters) -> None:
    rest = at_rest(dynamics, parameters)
    n_t = dynamics.arm.n_coordinates
    moving, bent = rest.copy(), rest.copy()
    moving[n_t:n_t + 2] = 3.0
    bent[2] += 1e-3
    assert locked_bending(dynamics, rest, parameters) < 1e-9
    assert locked_bending(dynamics, moving, parameters) > 1e-2
    assert locked_bending(dynamics, bent, parameters) > 5e-4
    assert locked_bending(dynamics, np.full_like(rest, np.nan), parameters) == np.inf
