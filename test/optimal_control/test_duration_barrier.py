"""Free durations with a barrier: derivatives, and the shortest time of one link."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint import Joint, Motor
from flex_planner.arms.link import Link
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import GaussRule
from flex_planner.collocation.interior_point import BarrierSchedule, solve_barrier
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.duration_barrier import DurationBarrier
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.paper.cases import paper_arm
import numpy as np
import pytest

MU, PRICE = 0.3, 50.0


def capped_arm() -> Arm:
    """Return an arm whose motors have caps besides their lines."""
    arm = paper_arm(50.0, 1)
    return replace(arm, joints=tuple(replace(joint, motor=replace(joint.motor, max_torque=6.0))
                                     for joint in arm.joints))


def barrier_of(arm: Arm, duration: float = 1.0) -> DurationBarrier:
    """Return the barrier of a motion of an arm."""
    n = arm.n_joints
    task = Task(arm=arm, start_positions=np.zeros(n), goal_positions=np.full(n, 0.4),
                duration=duration, payload_mass=1.0)
    return DurationBarrier(MotionProblem(ArmModel.of(arm), task, task_parameters(task)), PRICE)


def settle(barrier: DurationBarrier, z: Array, y: Array) -> Array:
    """Return y moved until its conditions hold, z as it is."""
    for _ in range(60):
        step = barrier.find_step(z, y, np.zeros_like(z), MU)
        fall = np.max(-step[:, barrier.free:] / y[:, barrier.free:])
        y = y + min(1.0, 0.9 / max(fall, 1e-9)) * step
    assert np.abs(step).max() < 1e-9
    return y


def points(barrier: DurationBarrier) -> tuple[Array, Array]:
    """Return random points whose y fulfil their conditions."""
    draw, n = np.random.default_rng(1), barrier.free
    z = draw.normal(size=(4, barrier.size))
    z[:, n:barrier.motion.model.arm.n_coordinates] *= 1e-2
    z[:, -2] = draw.uniform(0.5, 2, 4)
    caps = barrier.motion.parameters.torque_limits.capped.any()
    y = np.ones((4, n * (9 if caps else 5)))
    y[:, :n] = 0.0
    return z, settle(barrier, z, y)


ARMS = {'rigid': paper_arm(np.inf), 'flexible': paper_arm(50.0, 1), 'capped': capped_arm()}


@pytest.mark.parametrize('name', ARMS)
def test_condensed_step_is_the_derivative_along_the_conditions(name: str) -> None:
    barrier = barrier_of(ARMS[name])
    z, y = points(barrier)
    rate, jacobian = barrier.condense(z, y, MU)
    size, h = np.abs(jacobian).max(axis=(1, 2)), 1e-5
    for j in range(barrier.size):
        shift = np.zeros_like(z)
        shift[:, j] = h
        ahead, behind = (barrier.condense(at, settle(barrier, at, y), MU)[0]
                         for at in (z + shift, z - shift))
        # second-order differences of functions as large as `size`
        slope = (ahead - behind) / (2 * h)
        assert (np.abs(slope - jacobian[..., j]).max(axis=1) < 2e-6 * size).all()
    assert (rate[:, -2] == 0).all()


def test_hamiltonian_foresees_the_step_of_the_torques() -> None:
    barrier = barrier_of(ARMS['flexible'])
    z, y = points(barrier)
    moved = y * (1 + 1e-4 * np.random.default_rng(2).normal(size=y.shape))
    there, here = (barrier.condense(z, at, MU)[0][:, -1] for at in (moved, y))
    np.testing.assert_allclose(there, here, atol=1e-5 * np.abs(here).max())


@pytest.mark.parametrize('guess', [0.4, 1.0, 3.0])
def test_one_link_takes_the_shortest_time_and_what_the_barrier_costs(guess: float) -> None:
    # torque 2 on a rod of 3 kg m^2 / 3 and a payload of 1 kg m^2: 0.4 rad by full torque and back
    link = Link(length=1.0, linear_density=3.0)
    motor = Motor(stall_torque=2.0, no_load_speed=np.inf)
    arm = Arm(name='rod', links=(link,), joints=(Joint(motor=motor),))
    shortest = 2 * np.sqrt(0.4 * 2.0 / 2.0)
    barrier = barrier_of(arm, guess)
    start = barrier.extend(barrier.motion.straight_line(40, GaussRule.of(4)))
    schedule = BarrierSchedule(first=PRICE, last=1e-4 * PRICE, tolerance=1e-6)
    met = solve_barrier(barrier, start, barrier.guess(start, schedule.first), schedule, Monitor())
    duration, motion = barrier.restrict(met.solution)
    assert met.converged and motion.mesh[-1] == pytest.approx(duration)
    # two limits, as long as the motion takes, and all effort that the motor can spend
    effort = 2.0**2 / 2 * barrier.motion.parameters.effort_weights[0]
    assert 0 < duration / shortest - 1 < 2e-4 + effort / PRICE
