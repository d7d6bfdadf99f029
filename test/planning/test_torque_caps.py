"""Motors with a largest torque in all quadrants, besides the line of eq. (15)."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
import pytest


def capped(name: str, cap: float) -> Arm:
    """Return a preset whose motors have a cap."""
    arm = load_arm(name)
    return replace(arm, joints=tuple(
        replace(joint, motor=replace(joint.motor, max_torque=cap)) for joint in arm.joints))


def plan_of(name: str, cap: float, payload: float = 1.0) -> Plan:
    """Return a plan that a line alone would drive to 7 N m."""
    return plan_path(Task.between_points(capped(name, cap), (0.8, 0.0), (-0.2, 0.6),
                                         duration=1.3, payload_mass=payload))


@pytest.mark.parametrize('name', ['korayem_rigid', 'korayem_ei50'])
@pytest.mark.parametrize('cap', [6.0, 4.5])
def test_plan_is_optimal_within_line_and_cap(name: str, cap: float) -> None:
    plan = plan_of(name, cap)
    assert plan.certified
    samples = plan.uniform_samples(1000)
    n = plan.arm.n_joints
    line = 8.0 - 8.0 / 3.5 * samples.rates[:, :n]  # K_1 - K_2 q' of the preset
    assert (samples.torques <= np.minimum(cap, line) + 1e-9).all()
    assert (samples.torques >= np.maximum(-cap, line - 16.0) - 1e-9).all()
    # both are met: driving at some speed by the line, braking by the cap
    assert np.isclose(samples.torques, -cap).any() or np.isclose(samples.torques, cap).any()
    assert plan.certificate.hamiltonian_drift < 1e-7
    direct = DirectProblem(plan.problem.model, DirectSettings(degree=4, intervals=60))
    other = direct.solve(plan.problem.parameters, plan.problem.start, plan.problem.goal,
                         plan.task.duration, guess=plan.solution)
    assert np.abs(other.torques).max() < cap * (1 + 1e-6)
    # its equal intervals have no node where a motor switches
    assert plan.cost <= other.cost * (1 + 1e-9)
    assert other.cost == pytest.approx(plan.cost, rel=1e-4)


def test_cost_grows_with_the_payload_as_the_hamiltonian_says() -> None:
    plan, step = plan_of('korayem_rigid', 4.5), 1e-4
    around = [plan_of('korayem_rigid', 4.5, 1.0 + change).cost for change in (-step, step)]
    assert plan.solution is not None
    z = plan.solution.stage_values().reshape(-1, plan.problem.size)
    share = plan.problem.model.controls(z, plan.problem.p).payload_share
    weights = (plan.solution.steps[:, None] * plan.solution.rule.weights).ravel()
    assert weights @ share == pytest.approx((around[1] - around[0]) / (2 * step), rel=1e-6)


def test_model_without_the_cap_of_a_motor_is_not_used_for_it() -> None:
    arm = capped('korayem_rigid', 4.5)
    partly = replace(arm, joints=(arm.joints[0], capped('korayem_rigid', np.inf).joints[1]))
    model, other = ArmModel.of(arm), ArmModel.of(partly)
    assert ArmModel.for_arm(arm, other) is model
    # caps that the task's motors do not have are infinite to it
    assert ArmModel.for_arm(partly, model) is model


def test_line_alone_is_capped_at_the_stall_torque_unless_it_says_unlimited() -> None:
    free, bound = plan_of('korayem_rigid', np.inf), plan_of('korayem_rigid', 5.0)
    assert free.cost < bound.cost
    motor = replace(free.arm.joints[0].motor, max_torque=None)
    assert motor.torque_cap == motor.stall_torque == 8.0
