"""
Feedback of the whole state, estimated from encoders: a regulator and an observer, both constant.

Linear-quadratic regulator and Kalman filter of the arm about the posture in which it comes to
rest, with torques that are held; Franklin, Powell and Workman, Digital Control of Dynamic Systems,
chapters 8 and 9. The weights are energies, so that nothing has to be scaled by hand.

"""

from __future__ import annotations

from dataclasses import dataclass, field

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array
from flex_planner.control.linear_feedback import LinearFeedback
from flex_planner.control.linearisation import hold_inputs, linearise_dynamics
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
import numpy as np

# of an error of a joint by which it counts as much as energy of bending does [N m/rad]
_JOINT_STIFFNESS = 100.0
# beside what motors do, so that no direction is taken as known for good
_DRIFT = 1e-16
# each one squares what a period leaves of an error
_MOST_DOUBLINGS, _CONVERGED = 40, 1e-14


class NoFeedbackError(FlexPlannerError):
    """There is no gain with which the linear equations are stable."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StateFeedback:
    """
    Gains of a regulator and its observer: ``du = -K x_hat - d_hat``.

    Attributes
    ----------
    transition, inputs : numpy.ndarray, shape (2 n_t, 2 n_t) and (2 n_t, n)
        What a period makes of an error of the state, and of a torque that is held.
    state_gain : numpy.ndarray, shape (n, 2 n_t)
        K [N m per unit].
    observer_gain : numpy.ndarray, shape (2 n_t, n)
        What an error of the predicted joint angles corrects of the state [unit per rad].
    disturbance_gain : numpy.ndarray, shape (n, n) or (0, n)
        What it corrects of d_hat, a torque that acts beside the motors; empty where that is not
        estimated [N m/rad].
    rate : float
        Of the controller [Hz].

    """

    transition: Array
    inputs: Array
    state_gain: Array
    observer_gain: Array
    rate: float
    disturbance_gain: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def law(self) -> LinearFeedback:
        """Return it as a law, whose state is x_hat predicted for the next update, and d_hat."""
        n, size = self.state_gain.shape
        disturbances = len(self.disturbance_gain)
        total = size + disturbances
        free, forced, gain = np.eye(total), np.zeros((total, n)), np.zeros((n, total))
        free[:size, :size], forced[:size], gain[:, :size] = (
            self.transition, self.inputs, self.state_gain)
        correction = self.observer_gain
        if disturbances:
            free[:size, size:], gain[:, size:] = self.inputs, np.eye(n)
            correction = np.vstack([correction, self.disturbance_gain])
        left = np.eye(total) - correction @ np.eye(n, total)
        return LinearFeedback(A=free @ left, B=free @ correction, C=-gain @ left,
                              D=-gain @ correction, E=forced, rate=self.rate)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearArm:
    """
    An arm about a posture at rest, with torques that are held for a period.

    Attributes
    ----------
    rest, torque : numpy.ndarray, shape (2 n_t,) and (n,)
        The state there, and what holds it [N m].
    free, forced : numpy.ndarray, shape (2 n_t, 2 n_t) and (2 n_t, n)
        What a period makes of a deviation from it, and of torques beyond those.
    stiffness, mass : numpy.ndarray, shape (n_t, n_t)
        Of the arm.
    rate : float
        [Hz].

    """

    rest: Array
    torque: Array
    free: Array
    forced: Array
    stiffness: Array
    mass: Array
    rate: float

    @classmethod
    def of(cls, dynamics: ArmDynamics, positions: Array, parameters: PhysicalParameters,
           rate: float) -> LinearArm:
        """
        Return it for joint angles (n,) [rad].

        Raises
        ------
        NoEquilibriumError
            If the arm buckles there.

        """
        physical = parameters.physical
        rest, torque = equilibrium(dynamics, positions, parameters)
        state = np.concatenate([rest, np.zeros_like(rest)])
        A, B = (part[0] for part in linearise_dynamics(dynamics, state[None], torque[None],
                                                       physical))
        free, forced = hold_inputs(A, B, 1 / rate)
        return cls(rest=state, torque=torque, free=free, forced=forced, rate=rate,
                   stiffness=dynamics.static_forces(rest[None], physical)[1][0],
                   mass=dynamics.mass_and_energy(state[None], physical)[0][0])

    def regulate(self, torque_weight: float) -> Array:
        """
        Return the gain of the regulator, shape (n, 2 n_t).

        Parameters
        ----------
        torque_weight : float
            Price of a squared torque, beside energies [rad^2/(N m)].

        Raises
        ------
        NoFeedbackError
            If there is none.

        """
        n_t, n = len(self.mass), self.forced.shape[1]
        weights = np.zeros((2 * n_t, 2 * n_t))
        weights[:n, :n] = _JOINT_STIFFNESS * np.eye(n)
        weights[n:n_t, n:n_t] = self.stiffness[n:, n:]
        weights[n_t:, n_t:] = self.mass
        price = np.diag(np.full(n, torque_weight))
        P = _solve_riccati(self.free, self.forced, weights, price)
        through = self.forced.T @ P
        gain: Array = np.linalg.solve(through @ self.forced + price, through @ self.free)
        return gain

    def observe(self, noise: float, torque_error: float,
                disturbance: float = 0.0) -> tuple[Array, Array]:
        """
        Return the gains of the observer, (2 n_t, n) and (n, n), or (0, 0) without a disturbance.

        Parameters
        ----------
        noise : float
            Of an encoder, rms [rad].
        torque_error : float
            Of motors in every period, rms [N m].
        disturbance : float
            By how much a torque beside the motors wanders within a second, rms; 0 if there is
            none [N m/sqrt(s)].

        Raises
        ------
        NoFeedbackError
            If there are none.

        """
        size, n = self.forced.shape
        total = size + n if disturbance else size
        free, wander = np.eye(total), np.zeros((total, total))
        free[:size, :size] = self.free
        wander[:size, :size] = self.spread(torque_error)
        if disturbance:
            free[:size, size:] = self.forced
            wander[size:, size:] = disturbance**2 / self.rate * np.eye(n)
        seen, spread = np.eye(n, total), noise**2 * np.eye(n)
        S = _solve_riccati(free.T, seen.T, wander, spread)
        gain = S @ seen.T @ np.linalg.inv(seen @ S @ seen.T + spread)
        return gain[:size], gain[size:] if disturbance else np.zeros((0, 0))

    def project(self, gain: Array, torque_error: float) -> Array:
        """
        Return the gain on joints alone that comes next to one on the state, shape (n, 2 n).

        It makes the same torques in the mean of the states that errors of the motors lead to;
        Levine and Athans, On the determination of the optimal constant output feedback gains,
        IEEE Transactions on Automatic Control 15 (1970).

        """
        from scipy.linalg import solve_discrete_lyapunov

        n, size = gain.shape
        covariance = solve_discrete_lyapunov(self.free - self.forced @ gain,
                                             self.spread(torque_error))
        seen = np.zeros((2 * n, size))
        seen[:n, :n], seen[n:, size // 2:size // 2 + n] = np.eye(n), np.eye(n)
        projected: Array = np.linalg.solve(seen @ covariance @ seen.T,
                                           seen @ covariance @ gain.T).T
        return projected

    def spread(self, torque_error: float) -> Array:
        """Return what errors of torques [N m] spread in a period, shape (2 n_t, 2 n_t)."""
        spread: Array = (torque_error**2 * self.forced @ self.forced.T
                         + _DRIFT * np.eye(len(self.forced)))
        return spread


def _solve_riccati(free: Array, forced: Array, weights: Array, price: Array) -> Array:
    """
    Return the stabilising solution of the discrete algebraic Riccati equation.

    By doubling, which needs no eigenvalues to be told apart: Chu, Fan, Lin and Wang, International
    Journal of Control 77 (2004).

    """
    one = np.eye(len(free))
    A, G, H = free, forced @ np.linalg.solve(price, forced.T), weights
    with np.errstate(over='ignore', invalid='ignore'):
        for _ in range(_MOST_DOUBLINGS):
            inner = np.linalg.solve(one + G @ H, np.hstack([A, G @ A.T]))
            more = A.T @ H @ inner[:, :len(free)]
            A, G = A @ inner[:, :len(free)], G + A @ inner[:, len(free):]
            H = H + (more + more.T) / 2
            if not np.isfinite(H).all():
                break
            if np.abs(more).max() <= _CONVERGED * np.abs(H).max():
                return H
    raise NoFeedbackError('no gain makes the linear equations of the arm stable at the goal: '
                          'motors or encoders do not reach all of its vibrations')
