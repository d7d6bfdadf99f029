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
from flex_planner.optimal_control.path_constraints.path_constraint import PathConstraint
from flex_planner.optimal_control.smoothed_torque import smooth_torques, SmoothedTorque
from flex_planner.optimal_control.smoothed_torque_state import (
    smooth_rates,
    SmoothedTorqueState,
)
from flex_planner.optimal_control.torque_slacks import TorqueSlacks
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
    smooth : bool
        Whether the motors' limits have the barrier, too, see `SmoothedTorque`.

    """

    def __init__(self, motion: MotionProblem, slacks: PathSlacks, mu: float,
                 floor: Array | None = None, *, smooth: bool = False) -> None:
        super().__init__(motion.model, motion.task, motion.parameters,
                         via_times=motion.junctions if motion.junctions.size else None,
                         ends=motion.ends)
        self.slacks, self.mu, self.smooth = slacks, mu, smooth
        self.conditions = smooth_rates(self.conditions, mu)
        if smooth:
            self.conditions = smooth_torques(self.conditions, self.parameters, mu)
        self.floor: Array = np.zeros(slacks.count) if floor is None else floor

    def rate(self, t: Array, z: Array) -> Array:
        """Return z'."""
        rate, layout = super().rate(t, z), self.layout
        rate[:, layout.costates] += add_multipliers(self.slacks, layout.take_states(z),
                                                    self.multipliers(z))
        return rate

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return z' and its Jacobian."""
        rate, jacobian = super().rate_jacobian(t, z)
        states, costates = self.layout.states, self.layout.costates
        lam = self.multipliers(z)
        slacks, slopes, curvature = self.slacks.linearise(self.layout.take_states(z), lam)
        rate[:, costates] += _pull(slopes, lam)
        kept = np.maximum(slacks, self.floor)
        ratio = np.where(kept > 0, self.mu / np.where(kept > 0, kept, 1.0)**2, np.nan)
        jacobian[:, costates[:, None], states] += curvature - _stiffen(slopes, ratio)
        return rate, jacobian

    def compiled_rate(self) -> CompiledRate | None:
        """Return None: what limits add is not compiled with the rest."""
        return None

    def barrier_rate(self, z: Array) -> Array:
        """Return what the barrier adds to L and H, shape (k,)."""
        slacks = self.slacks(self.layout.take_states(z))
        with np.errstate(invalid='ignore', divide='ignore'):
            kept, share = np.maximum(slacks, self.floor), np.maximum(1 - slacks / self.floor, 0.0)
            beyond = np.where(slacks < self.floor, share + share**2 / 2, 0.0)
            rate: Array = self.mu * (beyond - np.log(kept)).sum(axis=1)
        if isinstance(self.conditions, SmoothedTorqueState | SmoothedTorque):
            rate += self.conditions.barrier_rate(z)
        return rate

    @property
    def terms(self) -> int:
        """Return how many logarithms the barrier has."""
        if isinstance(self.conditions, SmoothedTorque):
            return self.slacks.count + self.conditions.terms
        smoothed = isinstance(self.conditions, SmoothedTorqueState)
        return self.slacks.count + (
            2 * int(np.isfinite(self.task.max_torque_rate).sum()) if smoothed else 0)

    def multipliers(self, z: Array) -> Array:
        """Return lam at points (k, m), shape (k, n_c)."""
        slacks = self.slacks(self.layout.take_states(z))
        kept = np.maximum(slacks, self.floor)
        inside = np.where(kept > 0, kept, 1.0)
        lam: Array = np.where(kept > 0, self.mu / inside * (1 + (inside - slacks) / inside),
                              np.nan)
        return np.where((slacks >= self.floor) & (kept > 0), self.mu / inside, lam)

    def with_changes(self, **changes: float) -> ConstrainedMotion:
        """Return the problem of the same task changed in payload or duration."""
        return ConstrainedMotion(super().with_changes(**changes), self.slacks, self.mu,
                                 self.floor, smooth=self.smooth)

    def with_via_times(self, times: Array) -> ConstrainedMotion:
        """Return the same problem with its via points passed at other times (K,) [s]."""
        return ConstrainedMotion(super().with_via_times(times), self.slacks, self.mu, self.floor,
                                 smooth=self.smooth)

    def with_mu(self, mu: float) -> ConstrainedMotion:
        """Return the same problem with another barrier."""
        return ConstrainedMotion(self, self.slacks, mu, self.floor, smooth=self.smooth)

    def floored(self, near: CollocationSolution, share: float) -> ConstrainedMotion:
        """Return the same problem with a floor at a share of the smallest slacks of a motion."""
        z = near.stage_values().reshape(-1, self.size)
        least = np.maximum(self.slacks(self.layout.take_states(z)).min(axis=0), _LEAST_FLOOR)
        return ConstrainedMotion(self, self.slacks, self.mu, share * least, smooth=self.smooth)


def slacks_of(motion: MotionProblem) -> PathSlacks | None:
    """
    Return the slacks of all limits of the states, None without any.

    They are those of `way_slacks_of`, and of the motors where torques are states.

    """
    if not motion.layout.torques:
        return way_slacks_of(motion)
    slacks = TorqueSlacks(motion.model.arm, _limits_on_the_way(motion),
                          motion.parameters.torque_limits)
    return slacks if slacks.count else None


def way_slacks_of(motion: MotionProblem) -> PathSlacks | None:
    """Return the slacks of all limits on the way, the arm's and the task's; None without any."""
    slacks = PathSlacks(motion.model.arm, _limits_on_the_way(motion))
    return slacks if slacks.count else None


def _limits_on_the_way(motion: MotionProblem) -> tuple[PathConstraint, ...]:
    """Return the limits that functions of q and q' are to keep."""
    arm, task = motion.model.arm, motion.task
    every = (*limits_of_arm(task.arm), *task.path_constraints)
    return tuple(one for one in every if arm.n_modes or not one.bends)


def end_states(motion: MotionProblem) -> Array:
    """
    Return the states at both ends that a motion must have, shape (1 or 2, 2 n_t or 2 n_t + n).

    A torque that is free there is one within its limits.

    """
    hard = bool(np.isinf(motion.goal_weights).all())
    states = np.stack([motion.start, motion.goal]) if hard else motion.start[None]
    if motion.torque_ends is None:
        return states
    n_t, n = motion.layout.coordinates, motion.layout.torques
    lower, upper = motion.parameters.torque_limits.bounds(states[:, n_t:n_t + n])
    torques = np.clip(0.0, lower, upper)
    for torque, held in zip(torques, (motion.torque_ends.start, motion.torque_ends.goal),
                            strict=False):
        torque[:held.size] = held
    return np.hstack([states, torques])


def relieve_ends(motion: MotionProblem, slacks: PathSlacks) -> PathSlacks:
    """Return slacks that a barrier can have at both ends, which may be on a limit."""
    return slacks.relieved(end_states(motion), _AT_ENDS)


def add_multipliers(slacks: PathSlacks, states: Array, multipliers: Array) -> Array:
    """Return what multipliers (k, n_c) add to the rates of the costates, shape (k, n_x)."""
    return _pull(slacks.linearise(states, multipliers)[1], multipliers)


def eliminate_slacks(slacks: PathSlacks, states: Array, sigma: Array, multipliers: Array,
                     mu: float) -> tuple[Array, Array]:
    """
    Return what linearised ``s - sigma = 0`` and ``lam sigma = mu`` add to psi' = F + J dx.

    Parameters
    ----------
    slacks : PathSlacks
        s(x).
    states : numpy.ndarray, shape (k, n_x)
        x = (q, q'), and tau where torques are states.
    sigma, multipliers : numpy.ndarray, shape (k, n_c)
        Of the iterate, > 0.
    mu : float
        Their product, once solved.

    Returns
    -------
    rate, jacobian : numpy.ndarray
        (k, n_x) and (k, n_x, n_x).

    """
    values, slopes, curvature = slacks.linearise(states, multipliers)
    # where no motion keeps the limits sigma vanishes: who calls sees that this is not finite
    with np.errstate(over='ignore', invalid='ignore'):
        ratio = multipliers / sigma
        return (_pull(slopes, mu / sigma - ratio * (values - sigma)),
                curvature - _stiffen(slopes, ratio))


def step_slacks(slacks: PathSlacks, states: Array, sigma: Array, multipliers: Array,
                dx: Array, mu: float) -> tuple[Array, Array]:
    """Return the steps of sigma and lam (k, n_c) that go with one of x (k, n_x)."""
    values, slopes, _ = slacks.linearise(states, multipliers)
    step = values - sigma + (slopes @ dx[..., None])[..., 0]
    return step, mu / sigma - multipliers - multipliers / sigma * step


def _pull(slopes: Array, multipliers: Array) -> Array:
    pull: Array = (multipliers[:, None, :] @ slopes)[:, 0]
    return pull


def _stiffen(slopes: Array, ratio: Array) -> Array:
    stiffness: Array = slopes.swapaxes(1, 2) @ (ratio[..., None] * slopes)
    return stiffness
