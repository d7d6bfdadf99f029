"""
How far a moving arm is off the plan that it carries out, at a time that is still to come.

From a state that somebody has estimated, or from the angles of the encoders by an observer. Either
way the model of the arm goes on from there under its joint controller along the trajectory.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import ControlledArm
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.control.linearisation import hold_inputs, linearise_dynamics
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
import numpy as np

# of encoders of 16 bits [rad], and of what the model has of the torques [N m], rms
_NOISE, _TORQUE_ERROR = 2 * np.pi / 2**16 / np.sqrt(12), 0.1
# how far off it is known to be at first: joints [rad, rad/s], and bending by the largest of the
# plan meanwhile; and at least, in any unit
_JOINTS_OFF, _BENDING_OFF, _LEAST = (0.01, 0.1), 0.2, 1e-8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackedArm:
    """
    An arm that carries out a trajectory under a joint controller.

    Attributes
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    parameters : PhysicalParameters
        Of the plan.
    controller : JointController
        Of the joints.
    reference : JointReference
        The trajectory with all n_t coordinates; its torques are the efforts of the n joints.

    """

    dynamics: ArmDynamics
    parameters: PhysicalParameters
    controller: JointController
    reference: JointReference

    def planned(self, time: float) -> Array:
        """Return the planned state at a time of the trajectory, shape (2 n_t,)."""
        return np.concatenate(self.reference.motion(time))

    def predict(self, state: Array, since: float, until: float) -> Array:
        """
        Return how far off the trajectory the arm will be, shape (2 n_t,).

        Parameters
        ----------
        state : numpy.ndarray, shape (2 n_t,)
            Of the arm at `since`.
        since, until : float
            Times of the trajectory [s].

        Returns
        -------
        numpy.ndarray
            Up to a period of the controller before `until`; NaN if the arm runs away.

        """
        period = self.controller.period
        count = int(np.floor((until - since) / period + 1e-6))
        if count < 1:
            off: Array = state - self.planned(since)
            return off
        n = self.dynamics.arm.n_joints
        arm = ControlledArm(dynamics=self.dynamics, parameters=self.parameters,
                            controller=self.controller)
        motion = arm.follow(_Joints(self.reference, n, since), state, count * period)
        final: Array = motion.states[-1] - self.planned(since + count * period)
        return final

    def observe(self, times: Array, angles: Array) -> Array:
        """
        Return how far off the trajectory the arm is at the last of some times, shape (2 n_t,).

        A Kalman filter of the equations linearised along the trajectory, under the PD; Brown and
        Hwang, Introduction to Random Signals and Applied Kalman Filtering, chapter 4. How exact it
        is the model decides: a tenth less stiffness leaves more than half of the error.

        Parameters
        ----------
        times : numpy.ndarray, shape (k,)
            Strictly increasing, of the trajectory, at least one [s].
        angles : numpy.ndarray, shape (k, n)
            Of the joints, measured then [rad].

        """
        coordinates, rates = self.reference.motion(times)
        n, states = angles.shape[1], np.hstack([coordinates, rates])
        free, forced = self._steps(times, states)
        errors = angles - coordinates[:, :n]
        off: Array = np.zeros(states.shape[1])
        spread = np.diag(self._first_size(states, n)**2)
        for k, error in enumerate(errors):
            if k:
                off = free[k - 1] @ off
                spread = (free[k - 1] @ spread @ free[k - 1].T
                          + _TORQUE_ERROR**2 * forced[k - 1] @ forced[k - 1].T)
            gain = np.linalg.solve(spread[:n, :n] + _NOISE**2 * np.eye(n), spread[:n]).T
            off = off + gain @ (error - off[:n])
            spread = spread - gain @ spread[:n]
        return off

    def _steps(self, times: Array, states: Array) -> tuple[Array, Array]:
        """Return what the times between samples make of deviations, and of torques, under PD."""
        A, B = linearise_dynamics(self.dynamics, states, self.reference.torque(times),
                                  self.parameters.physical)
        gains, n, n_t = self.controller.gains, B.shape[-1], states.shape[1] // 2
        pull = np.zeros((n, 2 * n_t))
        pull[:, :n], pull[:, n_t:n_t + n] = np.diag(gains.stiffness), np.diag(gains.damping)
        A, steps = A - B @ pull, np.diff(times)[:, None, None]
        return hold_inputs(steps * (A[1:] + A[:-1]) / 2, steps * (B[1:] + B[:-1]) / 2, 1.0)

    @staticmethod
    def _first_size(states: Array, joints: int) -> Array:
        """Return how far off the arm may be at first, shape (2 n_t,)."""
        size, half = _BENDING_OFF * np.abs(states).max(axis=0), states.shape[1] // 2
        size[:joints], size[half:half + joints] = _JOINTS_OFF
        least: Array = np.maximum(size, _LEAST)
        return least


@dataclass(frozen=True, slots=True)
class _Joints:
    """The joints of a trajectory from a time on, as a reference of their controller."""

    reference: JointReference
    joints: int
    begin: float

    def motion(self, times: Array) -> tuple[Array, Array]:
        """Return positions and velocities, shape (m, n)."""
        positions, velocities = self.reference.motion(times + self.begin)
        return positions[:, :self.joints], velocities[:, :self.joints]

    def torque(self, times: Array) -> Array:
        """Return the efforts, shape (m, n)."""
        return self.reference.torque(times + self.begin)
