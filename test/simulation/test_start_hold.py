"""
Trajectories that hold the arm before its motion, for controllers that let it sag until then.

A joint_trajectory_controller holds an arm with effort 0 until its first trajectory comes: under
gravity the joints are where its PD alone keeps them.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import locked_bending
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import EffortHold, JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SampledPlan, SamplingSettings
from flex_planner.simulation.plant import Control, Plant
import numpy as np
import pytest

START, GOAL, DURATION, PAYLOAD = [-1.2, 0.6], [-0.6, 0.9], 1.2, 0.5


@pytest.fixture(scope='module')
def plan() -> Plan:
    return plan_path(Task(arm=load_arm('korayem_hanging'), start_positions=START,
                          goal_positions=GOAL, duration=DURATION, payload_mass=PAYLOAD),
                     search='fast')


@pytest.fixture(scope='module')
def held(plan: Plan) -> SampledPlan:
    return sample_plan(plan, SamplingSettings(start_hold=1.0))


def static_torque(plan: Plan) -> Array:
    torque: Array = equilibrium(plan.model, np.array(START), plan.problem.parameters)[1]
    return torque


def controller(plan: Plan, hold: EffortHold, rate: float) -> JointController:
    return JointController(gains=default_gains(plan.model, rate), rate=rate, hold=hold)


def sagged(plan: Plan) -> Plant:
    """Return the arm as its PD alone holds it."""
    plant = Plant(plan.model, Control(gains=default_gains(plan.model)), payload_mass=PAYLOAD,
                  positions=np.array(START))
    plant.follow(JointReference.hold(np.array(START), np.zeros(2)))
    plant.advance(3.0)
    assert np.abs(plant.joint_state[0] - START).max() > 0.1
    return plant


def points(sampled: SampledPlan) -> JointReference:
    """Return the points of a trajectory as they are published, without the start that is ours."""
    samples = sampled.samples
    return JointReference(times=sampled.times_ns * 1e-9, positions=samples.coordinates[:, :2],
                          velocities=samples.rates[:, :2],
                          accelerations=samples.accelerations[:, :2], torques=sampled.efforts)


def test_first_points_hold_the_start_with_the_torque_that_this_takes(plan: Plan,
                                                                     held: SampledPlan) -> None:
    assert held.times_ns[:2].tolist() == [500_000_000, 1_000_000_000]
    assert held.times_ns[-2] == 2_200_000_000
    torque = static_torque(plan)
    assert np.abs(torque).min() > 2
    for k in (0, 1):
        assert held.samples.coordinates[k, :2].tolist() == START
        assert not held.samples.rates[k].any()
        assert not held.samples.accelerations[k].any()
        assert held.efforts[k] == pytest.approx(torque, abs=1e-9)
        assert held.samples.torques[k] == pytest.approx(torque, abs=1e-9)


@pytest.mark.parametrize('hold', EffortHold)
def test_motion_after_a_hold_arrives_like_one_without(plan: Plan, hold: EffortHold) -> None:
    settings = SamplingSettings(controller=controller(plan, hold, 300.0))
    bare = sample_plan(plan, settings).execution
    # begins in the middle of a period and ends with one
    start_hold = 600 / 333 - DURATION
    settings = SamplingSettings(controller=controller(plan, hold, 333.0), start_hold=start_hold)
    waited = sample_plan(plan, settings).execution
    # measured: 1.8e-5 to 3.5e-5 and 1.7e-5 to 2.6e-5 of the tip; 6e-6 to 1.3e-5 of vibration
    assert waited.tip_error < 1.5 * bare.tip_error
    assert waited.residual_vibration < 1.5 * bare.residual_vibration


def test_arm_that_sags_is_led_to_its_start_without_a_jerk(plan: Plan, held: SampledPlan) -> None:
    jumps = {}
    for sampled in (sample_plan(plan, SamplingSettings()), held):
        plant = sagged(plan)
        before, torques = plant.torque, list[Array]()
        plant.follow(points(sampled).after(*plant.joint_state, before))
        plant.advance(plant.time + 0.01, lambda moved, found=torques: found.append(moved.torque))
        jumps[sampled.start_hold] = float(np.abs(torques[0] - before).max())
    assert jumps[0.0] > 4  # [N m]
    assert jumps[1.0] < 0.1


@pytest.mark.parametrize('late', [0.0, 0.2, 0.45])
def test_controller_that_starts_within_the_hold_arrives(plan: Plan, held: SampledPlan,
                                                        late: float) -> None:
    plant = sagged(plan)
    reference = points(held)
    plant.follow(replace(reference, times=reference.times - late).after(
        *plant.joint_state, plant.torque))
    plant.advance(plant.time + 1.0 + DURATION - late)
    assert plant.joint_state[0] == pytest.approx(GOAL, abs=1e-4)
    assert locked_bending(plan.model, plant.state, plan.problem.parameters) < 1e-4


def test_arm_that_moves_at_the_start_is_not_held(rigid_model: ArmModel) -> None:
    moving = plan_path(Task(arm=rigid_model.arm, start_positions=[1.0, -2.0],
                            start_velocities=[0.1, 0.0], goal_positions=[0.8, -1.5],
                            duration=1.0), model=rigid_model)
    sampled = sample_plan(moving, SamplingSettings(start_hold=1.0))
    assert sampled.start_hold == 0
    assert sampled.times_ns[0] == 0


@pytest.mark.parametrize(('start_hold', 'rate'), [
    (-1.0, 1000.0), (0.003, 1000.0), (0.03, 100.0), (61.0, 1000.0), (np.nan, 1000.0)])
def test_hold_that_is_none_is_refused(plan: Plan, start_hold: float, rate: float) -> None:
    with pytest.raises(InvalidValueError, match='start_hold is .* but must be a'):
        SamplingSettings(start_hold=start_hold, controller=controller(plan, EffortHold.END, rate))
