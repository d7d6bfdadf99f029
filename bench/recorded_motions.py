"""Logs of a simulated arm under a drive with delay and encoder offsets, by another integrator."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.control.joint_reference import JointReference
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.identification.drive import Drive
from flex_planner.identification.joint_log import JointLog
import numpy as np

LSB = 2 * np.pi / 2**16


def record_motion(arm: Arm, payload: float, drive: Drive, reference: JointReference,
                  seconds: float, *, offset: Array | None = None, delay: float = 0.0,
                  lead: float = 0.02, resolution: float = LSB, every: int = 1,
                  seed: int = 0, away: Array | None = None) -> JointLog:
    """
    Return the log of a motion, from rest or `away` from it: passive coordinates and all rates.

    The true arm and its encoders differ by the offset; the torque is `delay` late. Steps are of
    the method of Dormand and Prince of order 8, each with the torque that acts then.

    """
    n, rng, period = arm.n_joints, np.random.default_rng(seed), 1 / drive.rate
    shift = np.zeros(n) if offset is None else offset
    dynamics = ArmDynamics.of(arm)
    physical = PhysicalParameters.of_arm(arm, payload_mass=payload).physical
    advance = dynamics.held_step(physical)
    state: Array = np.zeros(2 * arm.n_coordinates)
    state[:n] = reference.positions[0] - shift
    if away is not None:
        state[n:] = away
    lag, share = divmod(delay / period, 1)
    past: list[Array] = [np.zeros(n)] * (int(lag) + 2)
    keeps = np.exp(-2 * np.pi * drive.speed_filter * period) if drive.speed_filter else 0.0

    def read() -> Array:
        angles = state[:n] + shift
        if not resolution:
            return angles
        return np.round((angles + resolution / 2 * rng.normal(size=n)) / resolution) * resolution

    times, seen, torques = [], [], []
    last, speeds = read(), np.zeros(n)
    for k in range(int(round((lead + seconds) * drive.rate))):
        time = k * period - lead
        angles = read()
        speeds = keeps * speeds + (1 - keeps) * (angles - last) / period
        last = angles
        moving = time > -period / 2
        goal, goal_speed = reference.motion(max(time, 0.0))
        effort = reference.torque(max(time, 0.0) + drive.hold.delay * period) * moving
        used = state[arm.n_coordinates:][:n] if drive.measured_speeds else speeds
        command = (effort + drive.gains.stiffness * (goal - angles)
                   + drive.gains.damping * (goal_speed * moving - used))
        times.append(time)
        seen.append(angles)
        torques.append(command)
        past = [command, *past[:-1]]
        for torque, length in ((past[int(lag) + 1], share * period),
                               (past[int(lag)], (1 - share) * period)):
            if length > 0:
                state = advance(state, torque, length)[0].copy()
    return JointLog(name=f'log {seed}', times=np.array(times)[::every],
                    angles=np.array(seen)[::every], torques=np.array(torques)[::every],
                    reference=reference, reference_start=0.0)
