"""Plans of arms with rotors, housings, elastic joints, friction and payloads off the tip."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Elasticity, Joint, Link, Motor, Node
from flex_planner.arms.arm_files import load_arm
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
import pytest


def geared_arm(stiffness: float = 0.0, **changes: object) -> Arm:
    """Return two rigid links with geared motors, elastic if they have a stiffness."""
    spring = Elasticity(stiffness=stiffness, damping=0.5) if stiffness else None
    joint = Joint(motor=Motor(stall_torque=30.0, no_load_speed=5.0, gear_ratio=100.0,
                              rotor_inertia=2e-5), viscous_friction=0.1, elasticity=spring,
                  housing=Node(mass=0.5, inertia=1e-3))
    link = Link(length=0.5, linear_density=3.0)
    arm = Arm(name='geared', links=(link, link), joints=(joint, joint))
    return replace(arm, **changes)  # type: ignore[arg-type]


def plan_of(arm: Arm, payload: float = 1.0, tolerance: float = 1e-6) -> Plan:
    """Return a motion that takes up to 80 % of the motors' torque."""
    return plan_path(Task(arm=arm, start_positions=[-1.2, 0.4], goal_positions=[0.0, 1.2],
                          duration=1.2, payload_mass=payload),
                     solver=Solver(SolverSettings(error_tolerance=tolerance)))


def everything(friction_speed: float = 0.1) -> Arm:
    """Return an arm with all that a data sheet may say, under gravity."""
    arm = geared_arm(2000.0, gravity=[0.0, -9.81], payload_com=[0.05, 0.03],
                     payload_inertia=0.002)
    link = replace(arm.links[0], modes=1, mode_family='clamped_free', flexural_rigidity=80.0,
                   damping_ratio=0.01)
    joints = tuple(replace(joint, coulomb_friction=1.0, coulomb_speed=friction_speed)
                   for joint in arm.joints)
    return replace(arm, links=(link, link), joints=joints)


def payload_price(plan: Plan) -> float:
    """Return dJ/dm_p by the integral of dH/dm_p."""
    assert plan.solution is not None
    z = plan.solution.stage_values().reshape(-1, plan.problem.size)
    share = plan.problem.model.controls(z, plan.problem.p).payload_share
    weights = (plan.solution.steps[:, None] * plan.solution.rule.weights).ravel()
    return float(weights @ share)


def test_elastic_joint_tends_to_the_rigid_one_with_the_rotor_as_its_inertia() -> None:
    rigid = plan_of(geared_arm()).cost
    away = [plan_of(geared_arm(stiffness)).cost - rigid for stiffness in (1e3, 1e4, 1e5)]
    # to first order in the compliance
    assert away[0] / away[1] == pytest.approx(10, rel=0.3)
    assert away[1] / away[2] == pytest.approx(10, rel=0.3)
    assert abs(away[2]) < 1e-4 * rigid
    # without the rotors it would be another motion
    bare = tuple(replace(joint, motor=replace(joint.motor, rotor_inertia=0.0))
                 for joint in geared_arm().joints)
    assert plan_of(geared_arm(joints=bare)).cost < 0.9 * rigid


def test_plan_does_not_depend_on_the_frame_of_the_base() -> None:
    arm, angle = load_arm('desk_arm'), 0.7
    c, s = np.cos(angle), np.sin(angle)
    tilted = replace(arm, gravity=np.array([[c, -s], [s, c]]) @ arm.gravity)
    plan, turned = (plan_path(Task(
        arm=one, start_positions=[first - np.pi / 2, np.pi / 6],
        goal_positions=[first, np.pi / 3], duration=1.0, payload_mass=0.3))
        for one, first in ((arm, 0.0), (tilted, angle)))
    assert turned.cost == pytest.approx(plan.cost, rel=1e-9)
    times = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(turned.sample(times).torques, plan.sample(times).torques,
                               atol=1e-5 * np.abs(plan.sample(times).torques).max())


def test_everything_in_play_is_an_extremal_that_is_certified() -> None:
    plan = plan_of(everything(), tolerance=1e-7)
    assert plan.solved, plan.message
    assert plan.certificate.hamiltonian_drift < 1e-7


def test_price_of_the_payload_is_the_slope_of_the_cost() -> None:
    # without gravity, where the postures at both ends do not follow the payload
    plan, step = plan_of(replace(everything(), gravity=[0.0, 0.0])), 1e-3
    assert plan.solved, plan.message
    around = [plan_path(replace(plan.task, payload_mass=1.0 + change), start_from=plan).cost
              for change in (-step, step)]
    assert payload_price(plan) == pytest.approx((around[1] - around[0]) / (2 * step), rel=1e-5)


@pytest.mark.parametrize('speed', [0.2, 0.05])
def test_coulomb_friction_that_fades_late_is_planned(speed: float) -> None:
    arm = geared_arm()
    rubbing = tuple(replace(joint, coulomb_friction=1.0, coulomb_speed=speed)
                    for joint in arm.joints)
    plan = plan_of(replace(arm, joints=rubbing))
    assert plan.solved, plan.message
    # the motor gives what the arm without friction takes, and the friction
    samples = plan.uniform_samples(200)
    free = plan.model.inverse_dynamics(
        np.hstack([samples.coordinates, samples.rates]), samples.accelerations,
        replace(plan.problem.parameters, coulomb_friction=np.zeros(2)).physical)
    np.testing.assert_allclose(samples.torques - free, np.tanh(samples.rates / speed), atol=1e-9)


def test_payload_off_the_tip_costs_more() -> None:
    away = plan_of(geared_arm(payload_com=[0.05, 0.0])).cost
    assert away > 1.02 * plan_of(geared_arm()).cost
