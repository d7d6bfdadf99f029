"""
The optimality conditions of a motion with limits on the way, held by a logarithmic barrier.

To J is added ``-mu`` times the integral of ``sum ln s_k(q, q')``, so that each limit has the
multiplier ``lam_k = mu / s_k``, and the costates of eq. (12) change by ``s_q^T lam`` and ``s_q'^T
lam``. The torque of eqs. (13) to (15) stays as it is. What H lacks to be constant is the barrier.

"""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation.problem import CompiledRate
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import limits_of_arm, PathSlacks
import numpy as np

# slacks at both ends are taken as at least so much, see `PathSlacks.relieved`
_AT_ENDS = 1e-6


class ConstrainedMotion(MotionProblem):
    """
    The conditions of `MotionProblem` with the barrier; F is undefined where a slack is not > 0.

    Parameters
    ----------
    motion : MotionProblem
        Without the barrier.
    slacks : PathSlacks
        Of the limits, at least one.
    mu : float
        > 0 [J of eq. (6) per second].

    """

    def __init__(self, motion: MotionProblem, slacks: PathSlacks, mu: float) -> None:
        super().__init__(motion.model, motion.task, motion.parameters)
        self.slacks, self.mu = slacks, mu

    def rate(self, t: Array, z: Array) -> Array:
        """Return z', not a number where a slack is not positive."""
        rate = super().rate(t, z)
        half = self.size // 2
        states = z[:, :half]
        rate[:, half:] += add_multipliers(self.slacks, states, self._multipliers(states))
        return rate

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return z' and its Jacobian."""
        rate, jacobian = super().rate_jacobian(t, z)
        half = self.size // 2
        states = z[:, :half]
        lam = self._multipliers(states)
        slacks, slopes, curvature = self.slacks.linearise(states, lam)
        rate[:, half:] += _pull(slopes, lam)
        jacobian[:, half:, :half] += curvature - _stiffen(slopes, lam / slacks)
        return rate, jacobian

    def compiled_rate(self) -> CompiledRate | None:
        """Return None: what limits add is not compiled with the rest."""
        return None

    def barrier_rate(self, z: Array) -> Array:
        """Return what the barrier adds to L and H, shape (k,)."""
        with np.errstate(invalid='ignore', divide='ignore'):
            rate: Array = -self.mu * np.log(self.slacks(z[:, :self.size // 2])).sum(axis=1)
        return rate

    def with_changes(self, **changes: float) -> ConstrainedMotion:
        """Return the problem of the same task changed in payload or duration."""
        return ConstrainedMotion(super().with_changes(**changes), self.slacks, self.mu)

    def with_mu(self, mu: float) -> ConstrainedMotion:
        """Return the same problem with another barrier."""
        return ConstrainedMotion(self, self.slacks, mu)

    def multipliers(self, z: Array) -> Array:
        """Return lam at points, shape (k, n_c)."""
        return self._multipliers(z[:, :self.size // 2])

    def _multipliers(self, states: Array) -> Array:
        slacks = self.slacks(states)
        return np.where(slacks > 0, self.mu / np.where(slacks > 0, slacks, 1.0), np.nan)


def slacks_of(motion: MotionProblem) -> PathSlacks | None:
    """Return the slacks of all limits on the way, the arm's and the task's; None without any."""
    arm, task = motion.model.arm, motion.task
    every = (*limits_of_arm(task.arm), *task.path_constraints)
    constraints = tuple(one for one in every if arm.n_modes or not one.bends)
    slacks = PathSlacks(arm, constraints) if constraints else None
    return slacks if slacks is not None and slacks.count else None


def end_states(motion: MotionProblem) -> Array:
    """Return the states at both ends that a motion must have, shape (1 or 2, 2 n_t)."""
    hard = bool(np.isinf(motion.goal_weights).all())
    return np.stack([motion.start, motion.goal]) if hard else motion.start[None]


def relieve_ends(motion: MotionProblem, slacks: PathSlacks) -> PathSlacks:
    """Return slacks that a barrier can have at both ends, which may be on a limit."""
    return slacks.relieved(end_states(motion), _AT_ENDS)


def add_multipliers(slacks: PathSlacks, states: Array, multipliers: Array) -> Array:
    """Return what multipliers (k, n_c) add to the rates of the costates, shape (k, 2 n_t)."""
    return _pull(slacks.linearise(states, multipliers)[1], multipliers)


def eliminate_slacks(slacks: PathSlacks, states: Array, sigma: Array, multipliers: Array,
                     mu: float) -> tuple[Array, Array]:
    """
    Return what linearised ``s - sigma = 0`` and ``lam sigma = mu`` add to psi' = F + J dx.

    Parameters
    ----------
    slacks : PathSlacks
        s(x).
    states : numpy.ndarray, shape (k, 2 n_t)
        x = (q, q').
    sigma, multipliers : numpy.ndarray, shape (k, n_c)
        Of the iterate, > 0.
    mu : float
        Their product, once solved.

    Returns
    -------
    rate, jacobian : numpy.ndarray
        (k, 2 n_t) and (k, 2 n_t, 2 n_t).

    """
    values, slopes, curvature = slacks.linearise(states, multipliers)
    ratio = multipliers / sigma
    return (_pull(slopes, mu / sigma - ratio * (values - sigma)),
            curvature - _stiffen(slopes, ratio))


def step_slacks(slacks: PathSlacks, states: Array, sigma: Array, multipliers: Array,
                dx: Array, mu: float) -> tuple[Array, Array]:
    """Return the steps of sigma and lam (k, n_c) that go with one of x (k, 2 n_t)."""
    values, slopes, _ = slacks.linearise(states, multipliers)
    step = values - sigma + (slopes @ dx[..., None])[..., 0]
    return step, mu / sigma - multipliers - multipliers / sigma * step


def _pull(slopes: Array, multipliers: Array) -> Array:
    pull: Array = (multipliers[:, None, :] @ slopes)[:, 0]
    return pull


def _stiffen(slopes: Array, ratio: Array) -> Array:
    stiffness: Array = slopes.swapaxes(1, 2) @ (ratio[..., None] * slopes)
    return stiffness
