"""How differing arms arrive, against simulations of every step."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor
from flex_planner.control.extent import peak_to_peak
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.control.linearisation import hold_inputs, linearise_dynamics
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.robust.arrivals import tabulate_reference
from flex_planner.planning.robust.differing_plans import as_keys, CarriedOut, DifferingArms
from flex_planner.planning.robust.objective import Robustness
from flex_planner.simulation.settling import bending_peak_to_peak
import numpy as np
import pytest
from scipy.linalg import expm
from spatial_arms import yaw_pitch


def test_residual_is_that_of_a_second_of_simulation(clamped_plan: Plan,
                                                    controller: JointController) -> None:
    arms = DifferingArms(clamped_plan, Robustness(max_residual=1e-3, controller=controller))
    carried_out, errors = CarriedOut(clamped_plan, arms, Monitor()), (-0.1, 0.1)
    arm = arms.arm(errors)
    assert arm is not None
    execution = replace(arm[0], duration=2.0)
    motion = execution.arm.follow(tabulate_reference(clamped_plan, controller),
                                  execution.start, 2.0)
    after = motion.states[motion.times >= 1 - 1e-9]
    simulated = bending_peak_to_peak(clamped_plan.arm, after[:, :clamped_plan.arm.n_coordinates])
    # linearised about the rest, after an arrival 12 mm away from it
    assert carried_out.residual(errors) == pytest.approx(simulated, rel=0.02)


def test_arm_in_space_rings_as_a_simulation_does() -> None:
    task = Task(arm=yaw_pitch(), start_positions=[0, -0.2], goal_positions=[1.2, 0.3],
                duration=0.8, payload_mass=0.4)
    plan = plan_path(task, search='fast')
    controller = JointController(gains=Gains.of(2, 200.0, 20.0))
    arms = DifferingArms(plan, Robustness(max_residual=1e-3, controller=controller))
    execution, _ = arms.arm((-0.1, 0.1)) or pytest.fail('buckles')
    motion = execution.arm.follow(tabulate_reference(plan, controller), execution.start, 1.8)
    after = motion.states[motion.times >= 0.8 - 1e-9][:, :4]
    # of the link in both planes, and of the tip by the link alone
    still = np.hstack([np.tile(after[-1, :2], (len(after), 1)), after[:, 2:]])
    simulated = max(bending_peak_to_peak(plan.arm, after),
                    peak_to_peak(tip_position(plan.arm, still)))
    found = CarriedOut(plan, arms, Monitor()).residual((-0.1, 0.1))
    assert found == pytest.approx(simulated, rel=0.02)
    planes = np.ptp(after[:, 2:], axis=0)
    assert planes.min() > 0.1 * planes.max() > 1e-4


def test_arms_that_are_looked_at_are_closer_where_vibrations_are_fast(
        clamped_plan: Plan, plan_of: PlanFactory) -> None:
    robustness = Robustness(max_residual=1e-3)
    slow, fast = (DifferingArms(plan, robustness) for plan in (clamped_plan, plan_of('ei50')))
    assert len(slow.weighed) == 4 and len(fast.weighed) > 8
    assert len(fast.looked_at) > len(slow.looked_at) > 4
    for arms in (slow, fast):
        assert set(as_keys(arms.weighed)) < set(as_keys(arms.looked_at))
    for arms in (slow, fast):
        assert np.abs(arms.looked_at).max() == pytest.approx(0.1)


def test_without_a_payload_there_is_no_error_of_it(clamped_plan: Plan) -> None:
    arms = DifferingArms(clamped_plan, Robustness(max_residual=1e-3, payload_error=0.0))
    assert arms.weighed.tolist() == [[-0.1, 0.0], [0.1, 0.0]]


def test_linearisation_against_differences_and_the_exponential(clamped_plan: Plan) -> None:
    dynamics = ArmDynamics.of(clamped_plan.arm)
    physical = clamped_plan.problem.parameters.physical
    sample = clamped_plan.sample([0.3])
    state = np.concatenate([sample.coordinates[0], sample.rates[0]])
    A, B = linearise_dynamics(dynamics, state[None], sample.torques, physical)
    move, push = 1e-4 * np.ones_like(state), np.array([0.01, -0.02])

    def rate(sign: float) -> np.ndarray:
        return dynamics.forward_dynamics((state + sign * move)[None],
                                         sample.torques + sign * push, physical)[0]

    np.testing.assert_allclose((rate(1) - rate(-1)) / 2, A[0] @ move + B[0] @ push, rtol=1e-5,
                               atol=1e-6)
    size, inputs = B[0].shape
    system = np.zeros((size + inputs, size + inputs))
    system[:size, :size], system[:size, size:] = A[0], B[0]
    exact = expm(system * 1e-3)
    free, forced = hold_inputs(A, B, 1e-3)
    # velocities in other units than angles, which is no reason for more terms
    units = np.array([1.0] * (size // 2) + [1e4] * (size // 2))
    other = hold_inputs(A * (units[:, None] / units), B * units[:, None], 1e-3)[0]
    np.testing.assert_allclose(other * (units / units[:, None]), free, rtol=1e-9,
                               atol=1e-9 * np.abs(exact).max())
    np.testing.assert_allclose(free[0], exact[:size, :size], atol=1e-7 * np.abs(exact).max())
    np.testing.assert_allclose(forced[0], exact[:size, size:], atol=1e-7 * np.abs(exact).max())
