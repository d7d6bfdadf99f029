"""
The planned torques applied to the arm, open loop, by an integrator of another kind.

Steps of the Dormand-Prince method of order 8 with SciPy's coefficients and error control,
compiled together with the arm's dynamics; they end at the nodes of the plan's mesh, where the
torque has its corners.

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.collocation.mesh import switching_times
from flex_planner.dynamics.integration import PiecewisePolynomial
from flex_planner.optimal_control.arm_model import ArmModel, RUNGE_KUTTA_STAGES, RungeKuttaSteps
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np
from scipy.integrate import DOP853

_STAGE_TIMES: Array = np.array(DOP853.C[:RUNGE_KUTTA_STAGES], dtype=float)
_SAFETY, _LARGEST_GROWTH = 0.9, 5.0
# an interval of the mesh is not cut finer: the motion must have run away
_MOST_STEPS = 4096
_SAME_TIME = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class PlannedTorque:
    """
    The torque of eq. (14) as a function of time.

    The torque without bounds and the speeds are polynomials in every interval of the mesh; the
    bounds of eq. (15) are applied last, so that the corners where a motor switches stay sharp.

    Attributes
    ----------
    pieces : PiecewisePolynomial
        Free torques, then joint speeds, 2 n values.
    stall, slope : numpy.ndarray, shape (n,)
        K_1 [N m] and K_2 [N m s/rad].

    """

    pieces: PiecewisePolynomial
    stall: Array
    slope: Array

    @classmethod
    def of(cls, problem: MotionProblem, solution: CollocationSolution) -> PlannedTorque:
        """Interpolate the torque of a solution, cut where a motor switches."""
        cuts = switching_times(problem, solution)
        if cuts.size:
            solution = solution.on_mesh(_merged(solution.mesh, cuts))
        n, n_t = problem.model.arm.n_joints, problem.model.arm.n_coordinates
        theta = np.concatenate([[0.0], solution.rule.nodes, [1.0]])
        z = solution.values_at(theta).reshape(-1, problem.size)
        free = problem.model.controls(z, problem.p).free_torque
        values = np.hstack([free, z[:, n_t:n_t + n]]).reshape(solution.intervals, theta.size, -1)
        parameters = problem.parameters
        return cls(PiecewisePolynomial.through(solution.mesh, theta, values),
                   parameters.stall_torque, parameters.torque_slope)

    def __call__(self, time: float) -> Array:
        """Return the torques at one time, shape (n,)."""
        return self._bounded(self.pieces(time))

    def within(self, interval: int, basis: Array) -> Array:
        """Return the torques where `pieces.basis` was taken, in a mesh interval, shape (k, n)."""
        return self._bounded(basis @ self.pieces.coefficients[interval])

    def _bounded(self, values: Array) -> Array:
        n = self.stall.size
        shift = self.slope * values[..., n:]
        bounded: Array = np.minimum(np.maximum(values[..., :n], -self.stall - shift),
                                    self.stall - shift)
        return bounded


def _merged(mesh: Array, cuts: Array) -> Array:
    """Return a mesh with cuts added, except those at its nodes."""
    distance = np.abs(cuts[:, None] - mesh).min(axis=1)
    new = cuts[distance > _SAME_TIME * (mesh[-1] - mesh[0])]
    merged: Array = np.sort(np.concatenate([mesh, new]))
    return merged


def resimulated(model: ArmModel, p: Array, state: Array, torque: PlannedTorque,
                monitor: Monitor | None = None, *, rtol: float = 1e-8,
                atol: float = 1e-10) -> Array:
    """
    Return the state after a planned motion.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    p : numpy.ndarray
        Stacked `Parameters` of the plant; its motor limits are not applied.
    state : numpy.ndarray, shape (2 n_t,)
        At time 0.
    torque : PlannedTorque
        Open loop.
    monitor : Monitor, optional
        May stop it.
    rtol, atol : float
        Error of a step, relative and absolute.

    Returns
    -------
    numpy.ndarray, shape (2 n_t,)
        NaN if the integration failed.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    watch, advance = monitor or Monitor(), model.runge_kutta_steps(p)
    basis = cache(lambda count: torque.pieces.basis(_positions(count)))
    steps = 1.0  # that an interval needs
    with np.errstate(over='ignore', invalid='ignore'):
        for interval in range(torque.pieces.breaks.size - 1):
            error = np.inf
            while not error <= 1:
                watch.check()
                count = int(np.ceil(steps))
                if count > _MOST_STEPS:
                    return np.full_like(state, np.nan)
                length = float(torque.pieces.breaks[interval + 1] - torque.pieces.breaks[interval])
                torques = torque.within(interval, basis(count)).reshape(count, -1)
                after, error = _crossed(advance, state, torques, length / count, (rtol, atol))
                needed = error ** (1 / 8) / _SAFETY if np.isfinite(error) else _LARGEST_GROWTH
                steps = count * min(max(needed, 1 / _LARGEST_GROWTH), _LARGEST_GROWTH)
            state = after
    return state


def _crossed(advance: RungeKuttaSteps, state: Array, torques: Array, step: float,
             tolerances: tuple[float, float]) -> tuple[Array, float]:
    """Return the state after equal steps, and the error of the worst of them."""
    after, *errors = advance(state, torques, step)
    rtol, atol = tolerances
    size = np.abs(np.vstack([state, after]))
    scale = atol + rtol * np.maximum(size[:-1], size[1:])
    fifth, third = (((error / scale) ** 2).sum(axis=1) for error in errors)
    # Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.10
    bound = np.sqrt(np.maximum((fifth + 0.01 * third) * state.size, np.finfo(float).tiny))
    worst = float((fifth / bound).max())
    return after[-1], worst if np.isfinite(worst) else np.inf


def _positions(count: int) -> Array:
    """Return the times of the stages of equal steps, as shares of what they cross."""
    positions: Array = ((np.arange(count)[:, None] + _STAGE_TIMES) / count).ravel()
    return positions
