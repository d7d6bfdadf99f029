"""The motors' limits as a barrier: derivatives, and what is left when mu vanishes."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.validation import Array
from flex_planner.collocation import GaussRule
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.barrier_problem import MotionBarrier, PayloadBarrier
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.smoothed_torque import SmoothedTorque
from flex_planner.optimal_control.task import Task
from flex_planner.paper.cases import paper_arm, point_to_point
import numpy as np
import pytest

MU = 0.3


def capped_arm() -> Arm:
    """Return an arm whose motors have caps besides their lines."""
    arm = paper_arm(50.0, 1)
    return replace(arm, joints=tuple(replace(joint, motor=replace(joint.motor, max_torque=6.0))
                                     for joint in arm.joints))


def barrier_of(arm: Arm, *, payload: bool) -> MotionBarrier:
    """Return the barrier of a motion of an arm."""
    n = arm.n_joints
    task = Task(arm=arm, start_positions=np.zeros(n), goal_positions=np.full(n, 0.4),
                duration=1.0, payload_mass=1.0)
    motion = MotionProblem(ArmModel.of(arm), task, task_parameters(task))
    return PayloadBarrier(motion, 10.0) if payload else MotionBarrier(motion)


def points(barrier: MotionBarrier, count: int = 5) -> tuple[Array, Array]:
    """Return random points whose y fulfil their conditions."""
    draw = np.random.default_rng(0)
    n_t, n = barrier.motion.model.arm.n_coordinates, barrier.free
    z = draw.normal(size=(count, barrier.size))
    z[:, n:n_t] *= 1e-2
    if barrier.size > 4 * n_t:
        z[:, -2] = draw.uniform(0.5, 2, count)
    caps = barrier.motion.parameters.torque_limits.capped.any()
    y = np.ones((count, n * (9 if caps else 5)))
    y[:, :n] = 0.0
    return z, settle(barrier, z, y)


def settle(barrier: MotionBarrier, z: Array, y: Array) -> Array:
    """Return y moved until its conditions hold, z as it is."""
    for _ in range(60):
        step = barrier.find_step(z, y, np.zeros_like(z), MU)
        fall = np.max(-step[:, barrier.free:] / y[:, barrier.free:])
        y = y + min(1.0, 0.9 / max(fall, 1e-9)) * step
    assert np.abs(step).max() < 1e-9
    return y


ARMS = {'rigid': paper_arm(np.inf), 'flexible': paper_arm(50.0, 1), 'capped': capped_arm(),
        'clamped': paper_arm(5.0, 1, 'clamped_free'), 'desk': load_arm('desk_arm')}


@pytest.mark.parametrize('payload', [False, True])
@pytest.mark.parametrize('name', ARMS)
def test_condensed_step_is_the_derivative_along_the_conditions(name: str, payload: bool) -> None:
    barrier = barrier_of(ARMS[name], payload=payload)
    z, y = points(barrier)
    rate, jacobian = barrier.condense(z, y, MU)
    size = np.abs(jacobian).max(axis=(1, 2))
    for j in range(barrier.size):
        h = 1e-5
        shift = np.zeros_like(z)
        shift[:, j] = h
        ahead, behind = (settle(barrier, at, y) for at in (z + shift, z - shift))
        slope = (barrier.condense(z + shift, ahead, MU)[0]
                 - barrier.condense(z - shift, behind, MU)[0]) / (2 * h)
        # second-order differences of functions as large as `size`
        assert (np.abs(slope - jacobian[..., j]).max(axis=1) < 2e-6 * size).all()
        of_y = barrier.find_step(z, y, shift, MU)
        assert np.abs(of_y - (ahead - behind) / 2).max() < 1e-5 * max(np.abs(of_y).max(), h)


@pytest.mark.parametrize('name', ARMS)
def test_conditions_without_a_barrier_are_those_of_the_bounded_torque(name: str) -> None:
    barrier = barrier_of(ARMS[name], payload=False)
    motion, n = barrier.motion, barrier.free
    z, y = points(barrier)
    for mu in MU * 10.0**-np.arange(1, 13):
        for _ in range(8):
            step = barrier.find_step(z, y, np.zeros_like(z), mu)
            fall = np.max(-step[:, n:] / y[:, n:])
            y = y + min(1.0, 0.9 / max(fall, 1e-9)) * step
    rate, _ = barrier.condense(z, y, mu)
    expected = motion.rate(np.zeros(len(z)), z)
    torque = motion.model.controls(z, motion.p).torque
    assert (torque != motion.model.controls(z, motion.p).free_torque).any()
    np.testing.assert_allclose(y[:, :n], torque, atol=1e-5 * np.abs(torque).max())
    np.testing.assert_allclose(rate, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize('name', ['flexible', 'capped', 'desk'])
def test_smoothed_torque_is_what_the_conditions_lead_to(name: str) -> None:
    barrier = barrier_of(ARMS[name], payload=False)
    z, y = points(barrier)
    motion, n, half = barrier.motion, barrier.free, barrier.size // 2
    smoothed = SmoothedTorque(motion.model, motion.parameters, MU)
    rate, jacobian = smoothed.rate_jacobian(z)
    for given, wanted in zip((rate, jacobian), barrier.condense(z, y, MU), strict=True):
        np.testing.assert_allclose(given, wanted, atol=1e-9 * np.abs(wanted).max())
    found = smoothed.controls(z)
    np.testing.assert_allclose(found.torque, y[:, :n], rtol=1e-9)
    lower, upper = motion.parameters.torque_limits.bounds(z[:, half // 2:half // 2 + n])
    assert ((lower < found.torque) & (found.torque < upper)).all()
    # what dH/dpsi = z' and dH/dz = -psi' take: H itself, barrier and all
    for j in range(barrier.size):
        shift = np.zeros_like(z)
        shift[:, j] = 1e-6
        ahead, behind = (smoothed.controls(at).hamiltonian + smoothed.barrier_rate(at)
                         for at in (z + shift, z - shift))
        wanted = rate[:, j - half] if j >= half else -rate[:, j + half]
        assert np.abs((ahead - behind) / 2e-6 - wanted).max() < 1e-5 * np.abs(rate).max()
    heavier, lighter = (SmoothedTorque(motion.model, replace(
        motion.parameters, payload_mass=1.0 + change), MU) for change in (1e-6, -1e-6))
    share = (heavier.controls(z).hamiltonian - lighter.controls(z).hamiltonian) / 2e-6
    more = (heavier.barrier_rate(z) - lighter.barrier_rate(z)) / 2e-6
    np.testing.assert_allclose(found.payload_share, share + more,
                               atol=1e-5 * np.abs(share).max())


def test_motors_without_limits_leave_the_torque_alone() -> None:
    arm = paper_arm(50.0, 1)
    free = replace(arm, joints=tuple(replace(joint, motor=replace(
        joint.motor, stall_torque=np.inf, no_load_speed=np.inf)) for joint in arm.joints))
    barrier = barrier_of(free, payload=False)
    z, y = points(barrier)
    torque = barrier.motion.model.controls(z, barrier.motion.p).free_torque
    np.testing.assert_allclose(y[:, :2], torque, rtol=1e-9)
    smoothed = SmoothedTorque(barrier.motion.model, barrier.motion.parameters, MU)
    np.testing.assert_array_equal(smoothed.controls(z).torque, torque)
    assert smoothed.terms == 0


def test_first_torques_are_inside_the_limits() -> None:
    task = point_to_point(paper_arm(50.0, 1), 5.5)
    motion = MotionProblem(ArmModel.of(task.arm), task, task_parameters(task))
    barrier = MotionBarrier(motion)
    guess = motion.straight_line(12, GaussRule.of(4))
    y = barrier.guess(guess, 0.1)
    assert y.shape == (12, 4, 10)
    assert (y[..., 2:] > 0).all()
    np.testing.assert_allclose(y[..., 2:6] * y[..., 6:], 0.1)


def test_payload_stays_positive_and_makes_no_jump() -> None:
    barrier = barrier_of(paper_arm(50.0, 1), payload=True)
    node, step = np.zeros(barrier.size), np.zeros(barrier.size)
    node[-2] = 1.0
    step[-2] = -2.0
    assert barrier.longest(node, step) == pytest.approx(0.4)
    step[-2] = 100.0
    links = sum(link.mass for link in barrier.motion.model.arm.links)
    assert barrier.longest(node, step) == pytest.approx(0.4 * links / 100)
    assert barrier.longest(node, np.zeros(barrier.size)) == 1.0
