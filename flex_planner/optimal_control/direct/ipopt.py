"""
Direct collocation of the optimal control problem, solved by IPOPT.

It needs no costates to start from and returns them, from the multipliers of the programme of
`flex_planner.optimal_control.direct.programme`.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
import time
from typing import Any

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor, StopReason
from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.mesh import Mesh, SCHEMES
from flex_planner.optimal_control.direct.programme import Programme
from flex_planner.optimal_control.parameters import Parameters
import numpy as np

Guess = Callable[[Array], Array]

# MUMPS orders these matrices best by minimum degree: its own choice takes up to four times as long
_ALWAYS = {'print_level': 0, 'sb': 'yes', 'option_file_name': '', 'acceptable_iter': 0,
           'mumps_pivot_order': 0}
_PUSHES = ('bound_push', 'bound_frac', 'slack_bound_push', 'slack_bound_frac', 'mult_bound_push')
_WARM = {'warm_start_init_point': 'yes', 'mu_init': 1e-6,
         **{f'warm_start_{name}': 1e-9 for name in _PUSHES}}


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectSettings:
    """
    How the problem is discretised, and when IPOPT is done.

    Parameters
    ----------
    scheme : str
        ``gauss``, which is what the indirect solver uses; ``radau``, which damps fast modes; or
        ``hermite_simpson``.
    degree : int
        Collocation points per interval of the first two, 1 to 12.
    intervals : int
        Of equal length, 2 to 20000.
    max_iterations : int
        Of IPOPT, 1 to 100000.
    tolerance : float
        Of IPOPT's scaled optimality error, 1e-14 to 1e-2.
    free_payload : bool
        Whether the payload is an unknown with a price, see `DirectProblem.solve`.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    scheme: str = 'gauss'
    degree: int = 3
    intervals: int = 40
    max_iterations: int = 500
    tolerance: float = 1e-8
    free_payload: bool = False

    def __post_init__(self) -> None:
        if self.scheme not in SCHEMES:
            raise InvalidValueError('scheme', self.scheme, f'one of {", ".join(SCHEMES)}')
        integer('degree', self.degree, at_least=1, at_most=12)
        integer('intervals', self.intervals, at_least=2, at_most=20000)
        integer('max_iterations', self.max_iterations, at_least=1, at_most=100000)
        number('tolerance', self.tolerance, at_least=1e-14, at_most=1e-2)


class DirectStatus(Enum):
    """How a solve ended."""

    CONVERGED = 'converged'
    FAILED = 'failed'
    STOPPED = 'stopped'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectResult:
    """
    The last iterate of IPOPT; a solution only if it converged.

    Attributes
    ----------
    status : DirectStatus
        Only ``CONVERGED`` is a solution.
    message : str
        What IPOPT says, or why it was stopped.
    cost : float
        J of eq. (6), by the quadrature of the scheme.
    payload : float
        m_p [kg].
    times, states, costates : numpy.ndarray, shapes (N + 1,), (N + 1, 2 n_t) twice
        (q, q') and (psi_1, psi_2) at the nodes of the mesh.
    point_times, point_states, point_costates : numpy.ndarray, shapes (k,), (k, 2 n_t) twice
        The same at the collocation points. These costates belong to the torques through eq. (13);
        except for ``gauss`` they are of lower order than those at the nodes.
    torques : numpy.ndarray, shape (k, n)
        At the collocation points [N m].
    iterations : int
        Of IPOPT.
    seconds : float
        Time of the solve.
    iterate : dict of str to numpy.ndarray
        Unknowns and multipliers of IPOPT, for a warm start.

    """

    status: DirectStatus
    message: str
    cost: float
    payload: float
    times: Array
    states: Array
    costates: Array
    point_times: Array
    point_states: Array
    point_costates: Array
    torques: Array
    iterations: int
    seconds: float
    iterate: dict[str, Array]

    @property
    def converged(self) -> bool:
        """Whether this is a solution."""
        return self.status is DirectStatus.CONVERGED

    def __call__(self, times: Array) -> Array:
        """Return z, linear between the nodes, at times (k,), shape (k, 4 n_t)."""
        z = np.hstack([self.states, self.costates])
        return np.stack([np.interp(times, self.times, column) for column in z.T], axis=1)


class DirectProblem:
    """
    The motions of one arm on one mesh: derived once, solved as often as wanted.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    settings : DirectSettings, optional
        Mesh and tolerances.
    breaks : numpy.ndarray, shape (intervals + 1,), optional
        Ends of the intervals from 0 to 1; equal intervals if not given.

    Attributes
    ----------
    build_seconds : float
        What the derivation took.

    """

    def __init__(self, model: ArmModel, settings: DirectSettings | None = None,
                 breaks: Array | None = None) -> None:
        began = time.perf_counter()
        self.model, self.settings = model, settings or DirectSettings()
        self._mesh = Mesh.of(self.settings.scheme, self.settings.degree, self.settings.intervals,
                             breaks)
        self._programme = Programme.of(model.arm, self._mesh, self.settings.free_payload)
        self._watch = self._programme.watch(self.settings.intervals)
        self._solvers: dict[bool, Any] = {}
        self._solver(warm=False)
        self.build_seconds = time.perf_counter() - began

    def solve(self, parameters: Parameters, start: Array, goal: Array, duration: float, *,
              guess: Guess | None = None, warm: DirectResult | None = None, price: float = 0.0,
              monitor: Monitor | None = None) -> DirectResult:
        """
        Minimise eq. (6) between two states within the motor limits of eq. (15).

        With a free payload, minimise that less price times payload, from the given one on.

        Parameters
        ----------
        parameters : Parameters
            Weights, limits and payload.
        start, goal : numpy.ndarray, shape (2 n_t,)
            States at both ends.
        duration : float
            t_f, > 0 [s].
        guess : callable, optional
            Times (k,) to z (k, 4 n_t), such as a `CollocationSolution` or a `DirectResult`; a
            straight line if not given.
        warm : DirectResult, optional
            Of this problem with other data: IPOPT starts from its unknowns and multipliers.
        price : float
            sigma of a free payload [1/kg].
        monitor : Monitor, optional
            Receives every iteration with the largest violation of a row, and may stop it.

        Raises
        ------
        InvalidValueError
            If a state or the duration is none.

        """
        n_x = 2 * self.model.arm.n_coordinates
        start, goal = vector('start', start, n_x), vector('goal', goal, n_x)
        number('duration', duration, above=0, unit='s')
        solver, (lower, upper) = self._solver(warm=warm is not None), self._bounds(parameters)
        began = time.perf_counter()
        iterate = warm.iterate if warm else {
            'x0': self._guess_unknowns(guess, parameters, duration) if guess
            else self._straight_line(start, goal, duration)}
        prices = [price] if self.settings.free_payload else []
        if prices and not warm:
            iterate = {'x0': np.append(iterate['x0'], parameters.payload_mass)}
        self._watch.follow(monitor or Monitor())
        found = solver(**iterate, lbx=lower, ubx=upper, lbg=0, ubg=0,
                       p=np.concatenate([parameters.stack(), start, goal, [duration], prices]))
        if self._watch.error is not None:
            raise self._watch.error
        arrays = {name: np.array(found[name])[:, 0] for name in ('x', 'lam_x', 'lam_g')}
        payload = float(arrays['x'][-1]) if prices else parameters.payload_mass
        cost = float(found['f']) + price * payload * len(prices)
        return self._result(arrays, cost, solver.stats(), replace(
            parameters, payload_mass=payload), duration, time.perf_counter() - began)

    def _solver(self, *, warm: bool) -> Any:
        """Return IPOPT for the programme, created once for each kind of start."""
        if warm not in self._solvers:
            options = {**_ALWAYS, 'max_iter': self.settings.max_iterations,
                       'tol': self.settings.tolerance, **(_WARM if warm else {})}
            self._solvers[warm] = self._programme.ipopt(options, self._watch)
        return self._solvers[warm]

    def _bounds(self, parameters: Parameters) -> tuple[Array, Array]:
        """Return bounds of the unknowns: of those at points, w alone has some."""
        arm, mesh = self.model.arm, self._mesh
        upper = np.full((mesh.points.size, 3 * arm.n_coordinates + arm.n_joints), np.inf)
        upper[:, -arm.n_joints:] = parameters.stall_torque
        others = (mesh.P.shape[1] - mesh.points.size) * 2 * arm.n_coordinates
        both = np.concatenate([upper.ravel(), np.full(others, np.inf)])
        free = int(self.settings.free_payload)
        return np.append(-both, [0.0] * free), np.append(both, [np.inf] * free)

    def _guess_unknowns(self, guess: Guess, parameters: Parameters, duration: float) -> Array:
        """Return the unknowns on a motion with costates."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        times, node_times = self._times(duration)
        z = guess(times)
        control = self.model.controls(z, parameters.stack())
        w = control.torque + parameters.torque_slope * z[:, n_t:n_t + n]
        y = np.hstack([z[:, :2 * n_t], control.acceleration, w])
        return np.concatenate([y.ravel(), guess(node_times)[:, :2 * n_t].ravel()])

    def _straight_line(self, start: Array, goal: Array, duration: float) -> Array:
        """Return the unknowns at constant velocity; free fall would lead to worse minima."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        velocity = (goal - start)[:n_t] / duration

        def states(times: Array) -> Array:
            positions = start[:n_t] + np.outer(times, velocity)
            return np.hstack([positions, np.tile(velocity, (times.size, 1))])

        times, node_times = self._times(duration)
        y = np.hstack([states(times), np.zeros((times.size, n_t + n))])
        return np.concatenate([y.ravel(), states(node_times).ravel()])

    def _times(self, duration: float) -> tuple[Array, Array]:
        """Return the times of the points, and of the nodes that are no points."""
        mesh = self._mesh
        nodes = duration * mesh.breaks
        return duration * mesh.points, nodes[mesh.nodes >= mesh.points.size]

    def _result(self, arrays: dict[str, Array], cost: float, stats: dict[str, Any],
                parameters: Parameters, duration: float, seconds: float) -> DirectResult:
        """Return IPOPT's solution in the terms of the problem."""
        arm, mesh = self.model.arm, self._mesh
        n, n_t, K = arm.n_joints, arm.n_coordinates, mesh.points.size
        y = arrays['x'][:K * (3 * n_t + n)].reshape(K, -1)
        others = arrays['x'][y.size:arrays['x'].size - self.settings.free_payload]
        values = np.vstack([y[:, :2 * n_t], others.reshape(-1, 2 * n_t)])
        rows = arrays['lam_g'][:mesh.P.shape[0] * 2 * n_t].reshape(-1, 2 * n_t)
        costates, point_costates = mesh.costates(rows)
        status, message = _outcome(stats, self._watch.stopped)
        return DirectResult(
            status=status, message=message, cost=cost, payload=parameters.payload_mass,
            times=duration * mesh.breaks,
            states=values[mesh.nodes], costates=costates, point_times=duration * mesh.points,
            point_states=values[:K], point_costates=point_costates,
            torques=y[:, 3 * n_t:] - parameters.torque_slope * y[:, n_t:n_t + n],
            iterations=int(stats['iter_count']), seconds=seconds,
            iterate={'x0': arrays['x'], 'lam_x0': arrays['lam_x'], 'lam_g0': arrays['lam_g']})


def solve_direct(model: ArmModel, parameters: Parameters, start: Array, goal: Array,
                 duration: float, settings: DirectSettings | None = None,
                 guess: Guess | None = None, monitor: Monitor | None = None) -> DirectResult:
    """Solve a problem once, see `DirectProblem`; shapes and units are explained there."""
    return DirectProblem(model, settings).solve(parameters, start, goal, duration, guess=guess,
                                                monitor=monitor)


def _outcome(stats: dict[str, Any], stopped: StopReason | None) -> tuple[DirectStatus, str]:
    """Return status and message of a solve."""
    if stopped is not None:
        return DirectStatus.STOPPED, stopped.value
    message = str(stats['return_status']).replace('_', ' ').lower()
    return (DirectStatus.CONVERGED if stats['success'] else DirectStatus.FAILED), message
