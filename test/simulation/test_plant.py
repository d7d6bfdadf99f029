"""The simulated arm under its controller."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from bench.recorded_motions import record_motion
from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import (
    FlexPlannerError,
    InvalidSizeError,
    InvalidValueError,
    NotFiniteError,
)
from flex_planner.base.validation import Array
from flex_planner.control.feedback_motion import Course, FeedbackArm
from flex_planner.control.joint_controller import EffortHold, Gains
from flex_planner.control.joint_reference import JointReference
from flex_planner.control.linear_feedback import pd_feedback
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import simulate
from flex_planner.identification.drive import Drive
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.simulation.joint_control import Disturbance, Encoder
from flex_planner.simulation.plant import Control, Plant, RunawayError
import numpy as np
import pytest

GAINS = Gains.of(2, 100.0, 10.0)
FREE = Gains.of(2, 0.0, 0.0)
POSTURE = np.array([-1.3, 0.3])  # off the vertical
PERIOD = 1e-3


@pytest.fixture(scope='module')
def plan(ei50_model: ArmModel, ei50_arm: Arm, paper_task: Any) -> Plan:
    plan = plan_path(paper_task(ei50_arm), model=ei50_model)
    assert plan.solved, plan.message
    return plan


@pytest.fixture(scope='module')
def ei50_plant(ei50_arm: Arm) -> ArmDynamics:
    return ArmDynamics(ei50_arm)


@pytest.fixture(scope='module')
def workshop_plant(workshop_arm: Arm) -> ArmDynamics:
    return ArmDynamics(workshop_arm)


@pytest.fixture(scope='module')
def reference(plan: Plan) -> JointReference:
    return sample_plan(plan, SamplingSettings(torque_tolerance=2e-3)).reference


def plant_at_start(plan: Plan, gains: Gains = GAINS, payload_mass: float = 1.0,
                   **control: Any) -> Plant:
    return Plant(ArmDynamics(plan.arm), Control(gains=gains, **control),
                 payload_mass=payload_mass, positions=plan.task.start_positions)


def distance_to_goal(plan: Plan, plant: Plant) -> float:
    """Return how far the tip is from the goal [m]."""
    n_t = plan.arm.n_coordinates
    tips = tip_position(plan.arm, np.stack([plant.state[:n_t], plan.problem.goal[:n_t]]))
    return float(np.linalg.norm(tips[0] - tips[1]))


def test_plant_at_rest_stays_under_gravity(workshop_plant: ArmDynamics) -> None:
    plant = Plant(workshop_plant, Control(gains=GAINS), payload_mass=0.3, positions=POSTURE)
    before, holding = plant.state.copy(), plant.torque.copy()
    plant.advance(1.0)
    np.testing.assert_allclose(plant.state, before, atol=1e-10)
    np.testing.assert_allclose(plant.torque, holding, atol=1e-8)
    assert np.abs(holding).min() > 1


def test_arm_that_sags_under_more_load_than_known_leaves_its_place(
        workshop_plant: ArmDynamics) -> None:
    plant = Plant(workshop_plant, Control(gains=GAINS), payload_mass=0.3, positions=POSTURE)
    before = plant.state.copy()
    plant.follow(JointReference.hold(before[:2], np.zeros(2)))
    plant.advance(1.0)
    assert np.abs(plant.state - before).max() > 1e-2


def test_feedforward_takes_the_arm_to_its_goal(plan: Plan, reference: JointReference) -> None:
    plant = plant_at_start(plan)
    plant.follow(reference)
    plant.advance(1.0)
    assert distance_to_goal(plan, plant) < 1e-6
    plant.advance(1.5)
    assert distance_to_goal(plan, plant) < 1e-6
    assert np.abs(plant.state[plan.arm.n_coordinates:]).max() < 1e-4


def test_arm_is_100_times_worse_without_feedforward(plan: Plan,
                                                    reference: JointReference) -> None:
    errors = []
    for feedforward in (True, False):
        plant = plant_at_start(plan, feedforward=feedforward)
        plant.follow(reference)
        plant.advance(1.0)
        errors.append(distance_to_goal(plan, plant))
    assert errors[1] > 100 * errors[0]
    assert errors[1] > 5e-3  # [m], of a motion of 0.5 m


def test_motion_begins_when_it_is_asked_for(plan: Plan, reference: JointReference) -> None:
    late, early = plant_at_start(plan), plant_at_start(plan)
    late.advance(0.25)
    late.follow(reference)
    early.follow(reference)
    late.advance(0.75)
    early.advance(0.5)
    np.testing.assert_allclose(late.state, early.state, atol=1e-9)


def test_many_small_advances_are_one_big_one(plan: Plan, reference: JointReference) -> None:
    small, big = plant_at_start(plan), plant_at_start(plan)
    for plant in (small, big):
        plant.follow(reference)
    for time in np.linspace(0, 0.3, 777):
        small.advance(float(time))
    big.advance(0.3)
    assert small.time == big.time == pytest.approx(0.3)
    assert small.state.tolist() == big.state.tolist()


def test_time_does_not_run_back(plan: Plan) -> None:
    plant = plant_at_start(plan)
    plant.advance(0.1)
    plant.advance(0.05)
    assert plant.time == pytest.approx(0.1)


def test_torque_never_leaves_the_bounds_of_the_motors(plan: Plan) -> None:
    plant = plant_at_start(plan, Gains.of(2, 5e3, 50.0))
    plant.follow(JointReference.hold(plan.task.start_positions + [1.0, -0.5], np.zeros(2)))
    reached = 0
    for k in range(1, 301):
        lower, upper = TorqueLimits.of(plan.arm).bounds(plant.state[6:8])
        plant.advance(k * PERIOD)
        assert (lower <= plant.torque).all()
        assert (plant.torque <= upper).all()
        reached += int((plant.torque == lower).any() or (plant.torque == upper).any())
    assert reached > 10


def test_torque_stays_below_the_cap_also_when_braking(ei50_arm: Arm) -> None:
    joints = tuple(replace(joint, motor=replace(joint.motor, max_torque=2.0))
                   for joint in ei50_arm.joints)
    plant = Plant(ArmDynamics(replace(ei50_arm, joints=joints)),
                  Control(gains=Gains.of(2, 5e3, 50.0)), payload_mass=1.0,
                  positions=np.array([0.5, 0.5]))
    plant.follow(JointReference.hold(np.array([1.5, 0.0]), np.zeros(2)))
    torques, speeds = [], []
    for k in range(1, 601):
        speeds.append(plant.joint_state[1])
        plant.advance(k * PERIOD)
        torques.append(plant.torque)
    capped = np.abs(torques) == 2.0
    assert np.abs(torques).max() == 2.0
    braking = np.array(torques) * np.array(speeds) < 0
    assert (capped & braking).any()  # where eq. (15) would let it grow with the speed
    assert (capped & ~braking).any()


def test_last_sample_is_held(plan: Plan, reference: JointReference) -> None:
    plant = plant_at_start(plan)
    plant.follow(reference)
    plant.advance(1.0)
    arrived = plant.state[:2].copy()
    plant.advance(3.0)
    np.testing.assert_allclose(plant.state[:2], arrived, atol=1e-6)
    np.testing.assert_allclose(plant.torque, reference.torques[-1], atol=1e-3)


def test_reference_that_starts_late_is_led_into(plan: Plan, reference: JointReference) -> None:
    late = replace(reference, times=reference.times + 0.2)
    assert reference.after(np.zeros(2), np.zeros(2), np.zeros(2)) is reference
    plant = plant_at_start(plan)
    plant.follow(late.after(plant.state[:2], plant.state[6:8], plant.torque))
    start = plant.state[:2].copy()
    plant.advance(0.1)
    np.testing.assert_allclose(plant.state[:2], start, atol=0.02)
    plant.advance(1.2)
    assert distance_to_goal(plan, plant) < 5e-3


def test_heavier_payload_than_planned_shows_at_the_tip(plan: Plan,
                                                       reference: JointReference) -> None:
    plant = plant_at_start(plan, payload_mass=1.5)
    plant.follow(reference)
    plant.advance(1.0)
    assert 1e-3 < distance_to_goal(plan, plant) < 0.2


@pytest.mark.parametrize(('changes', 'error', 'text'), [
    ({'payload_mass': -1.0}, InvalidValueError, 'payload_mass is -1.0'),
    ({'payload_mass': np.nan}, NotFiniteError, 'payload_mass is nan'),
    ({'positions': [0.0]}, InvalidSizeError, 'positions'),
    ({'positions': [0.0, np.nan]}, NotFiniteError, r'positions\[1\]'),
    ({'stiffness': np.ones(1)}, InvalidSizeError, 'stiffness'),
    ({'damping': np.ones(3)}, InvalidSizeError, 'damping'),
    ({'stiffness': np.array([-1.0, 1.0])}, InvalidValueError, r'stiffness\[0\] is -1.0'),
    ({'damping': np.array([1.0, np.nan])}, NotFiniteError, r'damping\[1\] is nan'),
    ({'rate': 1.0}, InvalidValueError, 'rate is 1.0'),
    ({'rate': np.inf}, NotFiniteError, 'rate is inf'),
    ({'disturbance': {'joint': 3}}, InvalidValueError, 'disturbance_joint is 3'),
    ({'disturbance': {'torque': np.nan}}, NotFiniteError, 'disturbance_torque is nan'),
    ({'disturbance': {'start': -1.0}}, InvalidValueError, 'disturbance_start is -1.0'),
    ({'disturbance': {'duration': -1.0}}, InvalidValueError, 'disturbance_duration is -1.0'),
    ({'encoder': {'rate': -1.0}}, InvalidValueError, 'encoder_rate is -1.0'),
    ({'encoder': {'resolution': 2.0}}, InvalidValueError, 'encoder_resolution is 2.0')])
def test_bad_plant_is_refused(ei50_plant: ArmDynamics, changes: dict[str, Any],
                              error: type[Exception], text: str) -> None:
    values = {'payload_mass': 1.0, 'positions': [0.1, 0.2], 'stiffness': np.ones(2),
              'damping': np.ones(2), 'rate': 1e3, 'disturbance': {}, 'encoder': {}, **changes}
    with pytest.raises(error, match=text):
        Plant(ei50_plant, Control(
            gains=Gains(stiffness=values['stiffness'], damping=values['damping']),
            rate=values['rate'], disturbance=Disturbance(**values['disturbance']),
            encoder=Encoder(**values['encoder'])),
            payload_mass=values['payload_mass'], positions=values['positions'])


def test_plant_integrates_as_scipy_does(workshop_plant: ArmDynamics) -> None:
    # held for 50 ms each, so that the integrator meets torques that are constant
    rate, torques = 20.0, np.random.default_rng(1).uniform(-3, 3, (12, 2))
    plant = Plant(workshop_plant, Control(gains=FREE, rate=rate, limit_torques=False,
                                          hold=EffortHold.MIDDLE),
                  payload_mass=0.3, positions=POSTURE)
    state, times = plant.state, (np.arange(12) + 0.5) / rate
    still = np.zeros((12, 2))
    plant.follow(JointReference(times=np.append(0, times[1:]), positions=still, velocities=still,
                                accelerations=still, torques=torques))
    for k in range(12):
        plant.advance((k + 1) / rate)
        held = plant.torque.copy()
        state = simulate(workshop_plant, plant.parameters.physical, state, lambda t, u=held: u,
                         1 / rate, rtol=1e-11, atol=1e-13)
        # every step is good to 1e-8 of the state
        np.testing.assert_allclose(plant.state, state, rtol=1e-6, atol=2e-7)
    assert np.abs(plant.state[:2] - POSTURE).max() > 0.1
    np.testing.assert_allclose(held, torques[-1], atol=1e-12)


@pytest.mark.parametrize('rate', [50.0, 2000.0])
def test_error_of_a_step_is_watched_at_every_rate(ei50_plant: ArmDynamics, rate: float) -> None:
    plants = [Plant(ei50_plant, Control(gains=FREE, rate=each, limit_torques=False),
                    payload_mass=1.0, positions=POSTURE) for each in (rate, 1000.0)]
    for plant in plants:
        plant.follow(JointReference.hold(POSTURE, np.array([3.0, -2.0])))
        plant.advance(0.3)
    np.testing.assert_allclose(plants[0].state, plants[1].state, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(('hold', 'share'), [
    (EffortHold.START, 0.0), (EffortHold.MIDDLE, 0.5), (EffortHold.END, 1.0)])
def test_torque_of_a_trajectory_is_held_as_the_controller_does(
        plan: Plan, reference: JointReference, hold: EffortHold, share: float) -> None:
    plant = plant_at_start(plan, FREE, hold=hold, limit_torques=False)
    plant.follow(reference)
    for period in range(50):
        plant.advance((period + 1) * PERIOD)
        expected = reference.torque((period + share) * PERIOD)
        np.testing.assert_allclose(plant.torque, expected, atol=1e-9)
    assert Control(gains=FREE).hold is EffortHold.END


def test_every_period_of_a_plan_takes_a_single_step(
        plan: Plan, reference: JointReference, monkeypatch: pytest.MonkeyPatch) -> None:
    plant = plant_at_start(plan, encoder=Encoder(resolution=1e-4, differentiates=True))
    (integrator,), lengths = plant._integrators, []
    step = integrator._step

    def counted(state: Array, torque: Array, length: float) -> tuple[Array, Array, Array]:
        lengths.append(length)
        return step(state, torque, length)

    monkeypatch.setattr(integrator, '_step', counted)
    plant.follow(reference)
    plant.advance(1.0)
    assert len(lengths) == 1000


def test_motors_without_limits_do_what_they_are_told(plan: Plan) -> None:
    plant = plant_at_start(plan, Gains.of(2, 5e3, 50.0), limit_torques=False)
    plant.follow(JointReference.hold(plan.task.start_positions + [0.1, 0], np.zeros(2)))
    plant.advance(PERIOD)
    assert plant.torque == pytest.approx([500.0, 0.0])  # the motor stalls at 8 N m


def test_arm_that_runs_away_is_stopped(plan: Plan) -> None:
    plant = plant_at_start(plan, Gains.of(2, 1e24, 0.0), limit_torques=False)
    plant.follow(JointReference.hold(plan.task.start_positions + [0.1, 0], np.zeros(2)))
    with pytest.raises(RunawayError, match=r'has run away after 0\.\d+ s: the gains'):
        plant.advance(1.0)


def test_encoder_rounds_and_is_slow(plan: Plan, reference: JointReference) -> None:
    encoder = Encoder(rate=200.0, resolution=2 * np.pi / 4096, differentiates=True)
    plant = plant_at_start(plan, encoder=encoder)
    plant.follow(reference)
    seen, true = [], []
    plant.advance(0.5, lambda p: (seen.append((p.sensor.positions, p.sensor.speeds)),
                                  true.append(p.joint_state[0].copy())))
    positions, speeds = (np.array(values) for values in zip(*seen, strict=True))
    counts = positions / encoder.resolution
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    sampled = slice(4, None, 5)  # the fifth period of 1 ms ends with a sample
    errors = np.abs(positions - np.array(true))[sampled]
    assert 0.4 * encoder.resolution < errors.max() <= 0.5 * encoder.resolution + 1e-12
    assert (np.diff(positions, axis=0)[np.arange(499) % 5 != 3] == 0).all()
    differences = np.diff(positions[sampled], axis=0) * encoder.rate
    np.testing.assert_allclose(speeds[sampled][1:], differences, atol=1e-12)


def test_coarse_encoder_makes_the_joints_less_exact(plan: Plan,
                                                    reference: JointReference) -> None:
    errors = []
    for encoder in (Encoder(), Encoder(resolution=1e-3, differentiates=True)):
        plant = plant_at_start(plan, encoder=encoder)
        plant.follow(reference)
        plant.advance(1.5)
        errors.append(np.abs(plant.joint_state[0] - plan.task.goal_positions).max())
    assert errors[0] < 1e-6
    assert 1e-5 < errors[1] < 0.01  # some steps of the encoder


def test_plant_under_a_law_is_the_arm_that_gains_are_tried_on(
        plan: Plan, reference: JointReference) -> None:
    law = pd_feedback(Gains.of(2, 60.0, 4.0), 1000.0)
    plant = plant_at_start(plan, payload_mass=1.1, encoder=Encoder(resolution=1e-4))
    arm = FeedbackArm(dynamics=ArmDynamics.of(plan.arm), parameters=plant.parameters, law=law,
                      resolution=1e-4)
    motion = arm.follow(Course.of(reference, EffortHold.END, 1000.0, 0.3), plant.state)
    plant.use_law(law)
    plant.follow(reference)
    plant.advance(0.3)
    # encoders that round may do so at different moments
    np.testing.assert_allclose(plant.state[:6], motion.states[-1, :6], rtol=0, atol=1e-5)
    assert np.abs(motion.states[-1, :2] - reference.motion(0.3)[0]).max() > 1e-4


def test_law_for_another_rate_is_refused(plan: Plan) -> None:
    plant = plant_at_start(plan)
    with pytest.raises(InvalidValueError, match='rate of the law is 500.0, but must be'):
        plant.use_law(pd_feedback(GAINS, 500.0))
    with pytest.raises(InvalidValueError, match='joints of the law is 3, but must be'):
        plant.use_law(pd_feedback(Gains.of(3, 1.0, 1.0), 1000.0))


@pytest.mark.parametrize('delay', [0.0, 0.4e-3, 2e-3, 2.7e-3])
def test_arm_under_a_late_drive_moves_as_another_integrator_has_it(
        ei50_arm: Arm, reference: JointReference, delay: float) -> None:
    drive = Drive(gains=Gains.of(2, 40.0, 4.0), speed_filter=50.0)
    offset = np.array([0.01, -0.02])
    log = record_motion(ei50_arm, 1.2, drive, reference, 0.4, offset=offset, delay=delay,
                        resolution=0.0, lead=0.0)
    encoder = Encoder(differentiates=True, speed_filter=50.0, offsets=tuple(offset))
    plant = Plant(ArmDynamics.of(ei50_arm), Control(
        gains=drive.gains, limit_torques=False, encoder=encoder, delay=delay),
        payload_mass=1.2, positions=reference.positions[0])
    plant.follow(reference)
    seen = [plant.sensor.positions]
    plant.advance(0.399, lambda plant: seen.append(plant.sensor.positions))
    assert np.ptp(log.angles, axis=0).min() > 0.03
    np.testing.assert_allclose(seen, log.angles, atol=1e-7)


@pytest.mark.parametrize(('changes', 'message'), [
    ({'delay': -1e-3}, 'torque_delay is -0.001, but must be'),
    ({'encoder': Encoder(offsets=(0.1,))}, 'encoder_offsets')])
def test_delay_and_offsets_that_cannot_be_are_named(ei50_plant: ArmDynamics, message: str,
                                                    changes: dict[str, Any]) -> None:
    with pytest.raises(FlexPlannerError, match=message):
        Plant(ei50_plant, Control(gains=GAINS, **changes), payload_mass=1.0, positions=POSTURE)
