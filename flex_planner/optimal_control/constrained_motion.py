"""
The optimality conditions of a motion with limits on the way, held by a logarithmic barrier.

To J is added ``-mu`` times the integral of ``sum ln s_k(q, q')``, so that each limit has the
multiplier ``lam_k = mu / s_k``, and the costates of eq. (12) change by ``s_q^T lam`` and ``s_q'^T
lam``. The torque of eqs. (13) to (15) stays as it is. What H lacks to be constant is the barrier.

"""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.problem import CompiledRate
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import limits_of_arm, PathSlacks
import numpy as np

# slacks at both ends are taken as at least so much, see `PathSlacks.relieved`
_AT_ENDS = 2e-7
# of slacks of a motion, before a share of it is a floor
_LEAST_FLOOR = 1e-8


class ConstrainedMotion(MotionProblem):
    """
    The conditions of `MotionProblem` with the barrier.

    Parameters
    ----------
    motion : MotionProblem
        Without the barrier.
    slacks : PathSlacks
        Of the limits, at least one.
    mu : float
        > 0 [J of eq. (6) per second].
    floor : numpy.ndarray, shape (n_c,), optional
        Slacks below which multipliers grow no more than linearly, > 0: an iterate may be there, a
        solution is not. Without it F is undefined where a slack is not positive.

    """

    def __init__(self, motion: MotionProblem, slacks: PathSlacks, mu: float,
                 floor: Array | None = None) -> None:
        super().__init__(motion.model, motion.task, motion.parameters,
                         via_times=motion.junctions if motion.junctions.size else None)
        self.slacks, self.mu = slacks, mu
        self.floor: Array = np.zeros(slacks.count) if floor is None else floor

    def rate(self, t: Array, z: Array) -> Array:
        """Return z'."""
        rate = super().rate(t, z)
        half = self.size // 2
        states = z[:, :half]
        rate[:, half:] += add_multipliers(self.slacks, states, self.multipliers(z))
        return rate

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return z' and its Jacobian."""
        rate, jacobian = super().rate_jacobian(t, z)
        half = self.size // 2
        lam = self.multipliers(z)
        slacks, slopes, curvature = self.slacks.linearise(z[:, :half], lam)
        rate[:, half:] += _pull(slopes, lam)
        kept = np.maximum(slacks, self.floor)
        ratio = np.where(kept > 0, self.mu / np.where(kept > 0, kept, 1.0)**2, np.nan)
        jacobian[:, half:, :half] += curvature - _stiffen(slopes, ratio)
        return rate, jacobian

    def compiled_rate(self) -> CompiledRate | None:
        """Return None: what limits add is not compiled with the rest."""
        return None

    def barrier_rate(self, z: Array) -> Array:
        """Return what the barrier adds to L and H, shape (k,)."""
        slacks = self.slacks(z[:, :self.size // 2])
        with np.errstate(invalid='ignore', divide='ignore'):
            kept, share = np.maximum(slacks, self.floor), np.maximum(1 - slacks / self.floor, 0.0)
            beyond = np.where(slacks < self.floor, share + share**2 / 2, 0.0)
            rate: Array = self.mu * (beyond - np.log(kept)).sum(axis=1)
        return rate

    def multipliers(self, z: Array) -> Array:
        """Return lam at points (k, m), shape (k, n_c)."""
        slacks = self.slacks(z[:, :self.size // 2])
        kept = np.maximum(slacks, self.floor)
        inside = np.where(kept > 0, kept, 1.0)
        lam: Array = np.where(kept > 0, self.mu / inside * (1 + (inside - slacks) / inside),
                              np.nan)
        return np.where((slacks >= self.floor) & (kept > 0), self.mu / inside, lam)

    def with_changes(self, **changes: float) -> ConstrainedMotion:
        """Return the problem of the same task changed in payload or duration."""
        return ConstrainedMotion(super().with_changes(**changes), self.slacks, self.mu,
                                 self.floor)

    def with_via_times(self, times: Array) -> ConstrainedMotion:
        """Return the same problem with its via points passed at other times (K,) [s]."""
        return ConstrainedMotion(super().with_via_times(times), self.slacks, self.mu, self.floor)

    def with_mu(self, mu: float) -> ConstrainedMotion:
        """Return the same problem with another barrier."""
        return ConstrainedMotion(self, self.slacks, mu, self.floor)

    def floored(self, near: CollocationSolution, share: float) -> ConstrainedMotion:
        """Return the same problem with a floor at a share of the smallest slacks of a motion."""
        states = near.stage_values()[..., :self.size // 2].reshape(-1, self.size // 2)
        least = np.maximum(self.slacks(states).min(axis=0), _LEAST_FLOOR)
        return ConstrainedMotion(self, self.slacks, self.mu, share * least)


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
    # where no motion keeps the limits sigma vanishes: who calls sees that this is not finite
    with np.errstate(over='ignore', invalid='ignore'):
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
