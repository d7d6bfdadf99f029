"""Plans of spatial arms: the same in every frame, as planar arms, in an independent model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.joint import Motor
from flex_planner.arms.joint_units import units_of
from flex_planner.arms.kinematics import tip_position
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_body import as_matrix, as_point, SpatialBody, turn_rpy
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.validation import Array
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.planning.kinds.clusters import describe_path
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.way_limits import LimitKind, LimitViolation
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from spatial_arms import flexible_3r, tudor, ur5, yaw_pitch
from spatial_energies import SpatialEnergies

TURN = turn_rpy(0.4, -1.1, 2.0)


def task_of(arm: SpatialArm) -> Task:
    return Task(arm=arm, start_positions=[0, -0.2], goal_positions=[1.2, 0.3], duration=0.8,
                payload_mass=0.4, payload_inertia=1e-3)


@pytest.fixture(scope='module')
def plan() -> Plan:
    return plan_path(task_of(yaw_pitch()), search='fast')


def assert_same(one: Plan, other: Plan) -> None:
    assert one.solution is not None
    assert other.solution is not None
    assert other.cost == pytest.approx(one.cost, rel=1e-9)
    times = np.linspace(0, one.task.duration, 51)
    expected, found = one.solution(times), other.solution(times)
    size = np.abs(expected).max(axis=0)
    half = size.size // 2  # states, then costates
    for part in (slice(0, half), slice(half, None)):
        np.testing.assert_allclose(found[:, part], expected[:, part], rtol=0,
                                   atol=1e-9 * size[part].max())


def test_plan_is_certified(plan: Plan) -> None:
    assert plan.status is PlanStatus.SOLVED
    assert plan.certificate.tip_error < 1e-8
    assert plan.certificate.hamiltonian_drift < 1e-6


def test_plan_is_the_same_when_base_and_gravity_are_turned(plan: Plan) -> None:
    arm = yaw_pitch()
    first = replace(arm.joints[0], rotation=as_matrix(TURN))
    turned = replace(arm, joints=(first, arm.joints[1]), gravity=TURN @ arm.gravity,
                     base=as_point(TURN @ [0.3, 0.1, -0.2]))
    assert_same(plan, plan_path(task_of(turned), search='fast'))


def test_planar_arm_in_space_has_the_same_plan() -> None:
    planar = load_arm('clamped_motors')
    plans = [plan_path(Task(arm=arm, start_positions=[-0.5, 0.2], goal_positions=[0.5, 0.4],
                            duration=1.5, payload_mass=1.0), search='fast')
             for arm in (planar, SpatialArm.of_planar(planar))]
    assert plans[0].solved
    assert_same(*plans)


def independent_rate(arm: SpatialArm, payload: float, inertia: float) -> Callable[..., Array]:
    """Return x' by Lagrange's equations of point masses, as a function of x and torque."""
    n, n_t = arm.n_joints, arm.n_coordinates
    q, rates, u = ca.SX.sym('q', n_t), ca.SX.sym('v', n_t), ca.SX.sym('u', n)
    energies = SpatialEnergies(arm, q, rates, payload, inertia)
    momentum = ca.gradient(energies.kinetic, rates)
    forces = (ca.gradient(energies.kinetic - energies.potential, q)
              - ca.jtimes(momentum, q, rates))
    for i, joint in enumerate(arm.joints):
        forces[i] += u[i] - joint.viscous_friction * rates[i]
    function = ca.Function('f', [q, rates, u], [ca.jacobian(momentum, rates), forces])

    def rate(x: Array, torque: Array) -> Array:
        mass, force = function(x[:n_t], x[n_t:], torque)
        return np.concatenate([x[n_t:], np.linalg.solve(np.array(mass),
                                                        np.array(force).ravel())])

    return rate


def test_torques_lead_an_independent_model_to_the_goal(plan: Plan) -> None:
    arm, task = plan.arm, plan.task
    assert isinstance(arm, SpatialArm)
    rate = independent_rate(arm, task.payload_mass, task.payload_inertia)
    found = solve_ivp(lambda t, x: rate(x, plan.sample([min(t, task.duration)]).torques[0]),
                      (0, task.duration), plan.problem.start, method='DOP853', rtol=1e-8,
                      atol=1e-10)
    np.testing.assert_allclose(found.y[:, -1], plan.problem.goal, atol=2e-6)


def test_saved_plan_comes_back(plan: Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / 'plan')
    loaded = Plan.load(tmp_path / 'plan')
    assert isinstance(loaded.arm, SpatialArm)
    assert loaded.cost == plan.cost
    assert loaded.svg() == ''


def test_joints_keep_limits_and_pass_via_points(plan: Plan) -> None:
    first, second = plan.arm.joints
    slow = replace(first, motor=replace(first.motor, max_speed=2.1))
    task = replace(plan.task, arm=replace(plan.arm, joints=(slow, second)))
    limited = plan_path(task, search='fast')
    assert limited.solved
    speeds = limited.sample(np.linspace(0, task.duration, 400)).rates[:, 0]
    assert np.abs(speeds).max() == pytest.approx(2.1, rel=1e-3)
    assert limited.cost > plan.cost
    passing = plan_path(replace(plan.task, via_points=(
        ViaPoint(positions=[0.5, 0.5], time=0.4),)), search='fast')
    assert passing.solved
    np.testing.assert_allclose(passing.sample([0.4]).coordinates[0, :2], 0.5, atol=1e-9)


@pytest.mark.thorough
def test_shortest_duration_is_found_and_nothing_is_proved_of_it() -> None:
    found = find_min_duration(task_of(yaw_pitch()), search='fast')
    assert found.solved
    assert 0.3 < found.duration < 0.4
    assert found.plan is not None
    assert found.plan.certificate.tip_error < 1e-5


def slide(stall: float = np.inf, **joint: float) -> SpatialArm:
    """Return a mass of 2 kg on an oblique rail."""
    return SpatialArm(
        name='slide', gravity=[0, 0, -9.81],
        joints=(SpatialJoint(axis=(1, 0, 1), slides=True, motor=Motor(stall_torque=stall),
                             **joint),),
        links=(SpatialLink(end=(0.1, 0, 0), body=SpatialBody(mass=2.0)),))


def test_mass_on_a_rail_has_the_effort_of_the_double_integrator() -> None:
    weightless = replace(slide(), gravity=[0, 0, 0])
    found = plan_path(Task(arm=weightless, start_positions=[0.1], goal_positions=[0.7],
                           duration=0.5, payload_mass=1.0), search='fast')
    # u = m a with a linear in time: J = 6 m^2 d^2 / T^3
    assert found.cost == pytest.approx(6 * 3.0**2 * 0.6**2 / 0.5**3, rel=1e-9)


def test_ways_and_forces_of_a_rail_are_in_metres_and_newtons() -> None:
    ends: dict[str, Any] = {'start_positions': [0.0], 'goal_positions': [0.5], 'duration': 0.5}
    weak = plan_path(Task(arm=slide(stall=10.0), **ends))
    assert weak.status is PlanStatus.INFEASIBLE
    # 2 kg on a slope of 45 degrees
    assert 'joint 1 needs 13.87 N to hold the arm at the goal, its motor gives 10' in weak.message
    beyond = LimitViolation(joint=0, kind=LimitKind.LOWER_ANGLE, time=0.1, value=-0.3,
                            limit=-0.2, units=units_of(slide().joints[0]))
    assert str(beyond) == ('joint 1 is at -0.3 m at 0.1 s, 0.1 m beyond its lower limit of '
                           '-0.2 m')
    path = np.array([[0.0], [-0.3], [1.0]])
    assert describe_path(path, slide().joints) == 'joint 1 swings back 0.3 m first'


def test_rail_keeps_its_limit() -> None:
    found = plan_path(Task(arm=slide(lower_limit=-0.01), start_positions=[0.0],
                           goal_positions=[0.5], start_velocities=[-2.0], duration=0.5),
                      search='fast')
    assert found.solved
    ways = found.sample(np.linspace(0, 0.5, 500)).coordinates[:, 0]
    assert -0.01 - 1e-6 < ways.min() < -0.009


def test_a_point_of_a_task_has_three_coordinates() -> None:
    with pytest.raises(InvalidValueError, match='goal_point has 2 numbers, but must be a list of '
                                                '3 numbers'):
        Task.to_point(yaw_pitch(), [0, 0], [0.5, 0.2], duration=1.0)


# IPOPT finds those of 3R, TUDOR and UR5 from a straight line, too, to 1e-4, 1e-5 and 1e-6 on the
# mesh of bench/spatial.py
COLD = {
    '3R': (flexible_3r, [0, -0.3, 0.9], [1.2, -0.6, 0.4], 1.0, 0.5, 9.638871),
    '3R, heavy': (flexible_3r, [0, -0.3, 0.9], [1.2, -0.6, 0.4], 1.5, 1.0, 34.562947),
    'TUDOR': (tudor, [0, -0.5, 1.0], [1.0, -1.0, 0.6], 1.0, 0.1, 3.903387),
    'UR5': (ur5, [0, -1.2, 1.2, -1.5, -1.5, 0], [1.0, -0.8, 0.9, -1.0, -1.2, 0.5], 1.2, 2.0,
            8.654055),
}


def cold_task(name: str) -> tuple[Task, float]:
    make, start, goal, duration, payload, cost = COLD[name]
    arm = make()
    stall = np.array([joint.motor.stall_torque for joint in arm.joints])
    return Task(arm=arm, start_positions=start, goal_positions=goal, duration=duration,
                payload_mass=payload, effort_weights=(100 / stall)**2 / 100), cost


@pytest.mark.thorough
@pytest.mark.parametrize('name', COLD)
def test_spatial_arms_are_planned_from_cold(name: str) -> None:
    task, cost = cold_task(name)
    found = plan_path(task, search='fast')
    assert found.solved
    assert found.cost == pytest.approx(cost, rel=1e-6)


@pytest.mark.thorough
def test_tip_rests_at_points_that_are_asked_for() -> None:
    arm = load_arm('spatial_3r')
    task = Task.between_points(arm, [1.0, 0.2, 0.5], [0.6, 0.9, 0.9], duration=1.2,
                               payload_mass=0.5)
    found = plan_path(task, search='fast')
    assert found.solved
    n_t = arm.n_coordinates
    np.testing.assert_allclose(tip_position(arm, found.problem.goal[:n_t]), [0.6, 0.9, 0.9],
                               atol=1e-9)
    assert np.abs(found.problem.goal[arm.n_joints:n_t]).max() > 1e-4
    assert found.certificate.tip_error < 1e-7
