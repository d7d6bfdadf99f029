"""The simulated arm under its controller."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flex_planner.arm import Arm
from flex_planner.errors import InvalidSizeError, InvalidValueError, NotFiniteError
from flex_planner.kinematics import tip_position
from flex_planner.model import ArmModel
from flex_planner.path import plan_path
from flex_planner.plan import Plan
from flex_planner.plant import Gains, JointReference, Plant
from flex_planner.reference import sample_reference, SamplingSettings
import numpy as np
import pytest

GAINS = Gains(stiffness=np.full(2, 100.0), damping=np.full(2, 10.0))
POSTURE = np.array([-1.3, 0.3])  # off the vertical
PERIOD = 1e-3


@pytest.fixture(scope='module')
def plan(ei50_model: ArmModel, ei50_arm: Arm, paper_task: Any) -> Plan:
    plan = plan_path(paper_task(ei50_arm), model=ei50_model)
    assert plan.solved, plan.message
    return plan


@pytest.fixture(scope='module')
def reference(plan: Plan) -> JointReference:
    sampled, n = sample_reference(plan, SamplingSettings(torque_tolerance=2e-3)), 2
    return JointReference(
        times=sampled.times_ns * 1e-9, positions=sampled.samples.coordinates[:, :n],
        velocities=sampled.samples.rates[:, :n], torques=sampled.samples.torques)


def plant_at_start(plan: Plan, gains: Gains = GAINS, payload_mass: float = 1.0) -> Plant:
    return Plant(plan.model, payload_mass=payload_mass, gains=gains,
                 positions=plan.task.start_positions)


def distance_to_goal(plan: Plan, plant: Plant) -> float:
    """Return how far the tip is from the goal [m]."""
    n_t = plan.arm.n_coordinates
    tips = tip_position(plan.arm, np.stack([plant.state[:n_t], plan.problem.goal[:n_t]]))
    return float(np.linalg.norm(tips[0] - tips[1]))


def test_plant_at_rest_stays_under_gravity(workshop_model: ArmModel) -> None:
    plant = Plant(workshop_model, payload_mass=0.3, gains=GAINS, positions=POSTURE)
    before, holding = plant.state.copy(), plant.torque.copy()
    plant.advance(1.0)
    np.testing.assert_allclose(plant.state, before, atol=1e-10)
    np.testing.assert_allclose(plant.torque, holding, atol=1e-8)
    assert np.abs(holding).min() > 1


def test_arm_that_sags_under_more_load_than_known_leaves_its_place(
        workshop_model: ArmModel) -> None:
    plant = Plant(workshop_model, payload_mass=0.3, gains=GAINS, positions=POSTURE)
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
    plain = replace(reference, torques=np.zeros_like(reference.torques))
    errors = []
    for followed in (reference, plain):
        plant = plant_at_start(plan)
        plant.follow(followed)
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
    plant = plant_at_start(plan, Gains(stiffness=np.full(2, 5e3), damping=np.full(2, 50.0)))
    plant.follow(JointReference.hold(plan.task.start_positions + [1.0, -0.5], np.zeros(2)))
    reached = 0
    for k in range(1, 301):
        lower, upper = plan.arm.torque_bounds(plant.state[6:8])
        plant.advance(k * PERIOD)
        assert (lower <= plant.torque).all()
        assert (plant.torque <= upper).all()
        reached += int((plant.torque == lower).any() or (plant.torque == upper).any())
    assert reached > 10


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
    ({'rate': 1.0}, InvalidValueError, 'rate is 1.0'),
    ({'rate': np.inf}, NotFiniteError, 'rate is inf'),
    ({'payload_mass': -1.0}, InvalidValueError, 'payload_mass is -1.0'),
    ({'payload_mass': np.nan}, NotFiniteError, 'payload_mass is nan'),
    ({'positions': [0.0]}, InvalidSizeError, 'positions'),
    ({'positions': [0.0, np.nan]}, NotFiniteError, r'positions\[1\]'),
    ({'gains': Gains(stiffness=np.ones(1), damping=np.ones(1))}, InvalidSizeError, 'stiffness'),
    ({'gains': Gains(stiffness=np.ones(2), damping=np.ones(3))}, InvalidSizeError, 'damping'),
])
def test_bad_plant_is_refused(ei50_model: ArmModel, changes: dict[str, Any],
                              error: type[Exception], text: str) -> None:
    good = {'payload_mass': 1.0, 'gains': GAINS, 'positions': [0.1, 0.2]}
    with pytest.raises(error, match=text):
        Plant(ei50_model, **{**good, **changes})


@pytest.mark.parametrize(('stiffness', 'damping', 'text'), [
    ([-1.0, 1.0], [1.0, 1.0], r'stiffness\[0\] is -1.0'),
    ([1.0, 1.0], [1.0, np.nan], r'damping\[1\] is nan')])
def test_bad_gains_are_refused(stiffness: list[float], damping: list[float], text: str) -> None:
    with pytest.raises(InvalidValueError, match=text):
        Gains(stiffness=np.array(stiffness), damping=np.array(damping))
