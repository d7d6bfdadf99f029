"""The vibration of an arm with more modes: as a simulation of that arm has it, about."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory
from flex_planner.arms.arm import Arm, Link, MAX_MODES
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import simulate
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium, residual_vibration
from flex_planner.optimal_control.planned_torque import PlannedTorque
from flex_planner.optimal_control.task import Task
from flex_planner.planning.mode_count import estimate_left_out
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
from plan_checks import solution_of
import pytest

# of estimate and simulation, for these arms; more have more
ABOUT = 3.0


def estimate(plan: Plan) -> float:
    """Return the estimate of a plan, by the quadrature of its mesh."""
    solution = solution_of(plan)
    z = solution.stage_values().reshape(-1, plan.problem.size)
    weights = (solution.steps[:, None] * solution.rule.weights).ravel()
    return estimate_left_out(plan.task, solution.stage_times().ravel(), weights,
                             plan.model.controls(z, plan.problem.p).torque)


def with_modes(arm: Arm, more: int) -> Arm:
    return replace(arm, links=tuple(replace(link, modes=link.modes + more) for link in arm.links))


def simulated(plan: Plan) -> float:
    """Return the vibration that the planned torque leaves in the arm with another mode."""
    model = ArmDynamics(with_modes(plan.arm, 1))
    parameters = PhysicalParameters.of_arm(model.arm, payload_mass=plan.task.payload_mass)
    start, goal = (equilibrium(model, positions, parameters)[0] for positions in (
        plan.task.start_positions, plan.task.goal_positions))
    end = simulate(model, parameters.physical, np.concatenate([start, np.zeros_like(start)]),
                   PlannedTorque.of(plan.problem, solution_of(plan)), plan.task.duration,
                   rtol=1e-8, atol=1e-10)
    return residual_vibration(model, end, goal, parameters)


@pytest.fixture(scope='module')
def clamped() -> Plan:
    """Return the plan of links that two modes say nothing right of, though it is certified."""
    arm = load_arm('clamped_motors')
    return plan_path(Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0,
                                         payload_mass=1.0, effort_weights=[1 / 8, 1 / 8]))


@pytest.mark.parametrize(('name', 'largest'), [('ei50', 1e-5), ('ei5', 1e-4)])
def test_pinned_links_need_no_further_mode(plan_of: PlanFactory, name: str,
                                           largest: float) -> None:
    plan = plan_of(name)
    left = simulated(plan)
    assert left < largest
    assert left / ABOUT < estimate(plan) < ABOUT * left


def test_one_mode_of_soft_pinned_links_is_not_enough(ei5_arm: Arm, plan_of: PlanFactory) -> None:
    task = plan_of('ei5').task
    plan = plan_path(Task(arm=with_modes(ei5_arm, -1), start_positions=task.start_positions,
                          goal_positions=task.goal_positions, duration=1.0, payload_mass=1.0,
                          effort_weights=[1 / 8, 1 / 8]))
    left = simulated(plan)
    assert left > 1e-4
    assert left / ABOUT < estimate(plan) < ABOUT * left


def test_clamped_links_swing_by_millimetres_that_their_modes_do_not_have(clamped: Plan) -> None:
    left = simulated(clamped)
    assert clamped.certificate.residual_vibration < 1e-6
    assert left > 3e-3
    assert left / ABOUT < estimate(clamped) < ABOUT * left


def test_rigid_arm_has_nothing_to_leave_out(plan_of: PlanFactory) -> None:
    assert estimate(plan_of('rigid')) == 0


def test_link_that_has_all_modes_is_left_as_it_is(ei50_arm: Arm) -> None:
    full = Link(length=0.5, linear_density=6.0, flexural_rigidity=50.0, modes=MAX_MODES)
    task = Task(arm=replace(ei50_arm, links=(full, full)), start_positions=[0, 1],
                goal_positions=[1, 1], duration=1.0)
    assert estimate_left_out(task, np.ones(3), np.ones(3), np.ones((3, 2))) == 0


def test_estimate_is_linear_in_the_torque(clamped: Plan) -> None:
    # the same torque twice as large, from the same quadrature
    times, weights = np.linspace(0, 1, 401), np.full(401, 1 / 401)
    torques = np.column_stack([np.sin(9 * times), np.cos(40 * times)])
    once, twice = (estimate_left_out(clamped.task, times, weights, factor * torques)
                   for factor in (1.0, 2.0))
    assert twice == pytest.approx(2 * once, rel=1e-9)


def test_planar_arm_in_space_has_the_same_estimate(clamped: Plan) -> None:
    times, weights = np.linspace(0, 1, 401), np.full(401, 1 / 401)
    torques = np.column_stack([np.sin(9 * times), np.cos(40 * times)])
    task = Task(arm=SpatialArm.of_planar(clamped.arm), duration=1.0, payload_mass=1.0,
                start_positions=clamped.task.start_positions,
                goal_positions=clamped.task.goal_positions)
    expected, found = (estimate_left_out(one, times, weights, torques)
                       for one in (clamped.task, task))
    assert expected > 1e-4
    assert found == pytest.approx(expected, rel=1e-9)
