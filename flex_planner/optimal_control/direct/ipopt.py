"""
Direct collocation of the optimal control problem, solved by IPOPT.

It needs no costates to start from and returns them, from the multipliers of the programme of
`flex_planner.optimal_control.direct.programme`.

"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import time
from typing import Any

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor, StopReason
from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.mesh import Mesh, SCHEMES
from flex_planner.optimal_control.direct.programme import Programme
from flex_planner.optimal_control.direct.unknowns import Free, Guess, Path, Unknowns
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import MAX_PAYLOAD
import numpy as np

# MUMPS orders these matrices best by minimum degree: its own choice takes up to four times as long
_ALWAYS = {'print_level': 0, 'sb': 'yes', 'option_file_name': '', 'acceptable_iter': 0,
           'mumps_pivot_order': 0}
_PUSHES = ('bound_push', 'bound_frac', 'slack_bound_push', 'slack_bound_frac', 'mult_bound_push')
_WARM = {'warm_start_init_point': 'yes', 'mu_init': 1e-6,
         **{f'warm_start_{name}': 1e-9 for name in _PUSHES}}
# to compare motions of several kinds, not to have them exactly
_EXPLORING = {'mu_strategy': 'adaptive', 'constr_viol_tol': 1e-5, 'dual_inf_tol': 1e2,
              'compl_inf_tol': 1e-3}


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
    exploring : bool
        Whether motions are to be compared rather than to be exact: conditions other than the
        tolerance are loose, and the barrier is lowered adaptively.

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
    exploring: bool = False

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
    payload, duration : float
        m_p [kg] and t_f [s].
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
    duration: float
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
        self._programme = Programme.of(model.arm, self._mesh)
        self._unknowns = Unknowns(model, self._mesh)
        self._watch = self._programme.watch(self.settings.intervals)
        self._solvers: dict[bool, Any] = {}
        self._solver(warm=False)
        self.build_seconds = time.perf_counter() - began

    def solve(self, parameters: Parameters, start: Array, goal: Array, duration: float, *,
              guess: Guess | None = None, path: Path | None = None,
              warm: DirectResult | None = None, free: Free = Free.NOTHING, price: float = 0.0,
              most_payload: float = MAX_PAYLOAD,
              monitor: Monitor | None = None) -> DirectResult:
        """
        Minimise eq. (6) between two states within the motor limits of eq. (15).

        With a free payload, minimise that less price times payload, from the given one on; with
        a free duration, that and price times duration.

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
        path : callable, optional
            Instead of a guess: times (k,) to q, q', q'' (k, n_t) each.
        warm : DirectResult, optional
            Of this problem with other data: IPOPT starts from its unknowns and multipliers.
        free : Free
            What is an unknown besides the motion.
        price : float
            Of a free payload [1/kg] or duration [1/s].
        most_payload : float
            Largest free payload [kg].
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
        solver, began = self._solver(warm=warm is not None), time.perf_counter()
        lower, upper = self._unknowns.bounds(parameters, duration, free, most_payload)
        iterate = warm.iterate if warm else {
            'x0': self._first(guess, path, parameters, start, goal, duration)}
        prices = [1.0, price * (free is Free.PAYLOAD), price * (free is Free.DURATION)]
        self._watch.follow(monitor or Monitor())
        found = solver(**iterate, lbx=lower, ubx=upper, lbg=0, ubg=0,
                       p=np.concatenate([parameters.stack(), start, goal, prices]))
        if self._watch.error is not None:
            raise self._watch.error
        arrays = {name: np.array(found[name])[:, 0] for name in ('x', 'lam_x', 'lam_g')}
        cost = float(found['f']) + prices[1] * arrays['x'][-2] - prices[2] * arrays['x'][-1]
        return self._result(arrays, cost, solver.stats(), parameters, time.perf_counter() - began)

    def _first(self, guess: Guess | None, path: Path | None, parameters: Parameters,
               start: Array, goal: Array, duration: float) -> Array:
        """Return the first unknowns."""
        if path is not None:
            return self._unknowns.on_path(path, parameters, duration)
        if guess is not None:
            return self._unknowns.on_motion(guess, parameters, duration)
        return self._unknowns.on_straight_line(start, goal, parameters, duration)

    def _solver(self, *, warm: bool) -> Any:
        """Return IPOPT for the programme, created once for each kind of start."""
        if warm not in self._solvers:
            options = {**_ALWAYS, 'max_iter': self.settings.max_iterations,
                       'tol': self.settings.tolerance, **(_WARM if warm else {}),
                       **(_EXPLORING if self.settings.exploring else {})}
            self._solvers[warm] = self._programme.ipopt(options, self._watch)
        return self._solvers[warm]

    def _result(self, arrays: dict[str, Array], cost: float, stats: dict[str, Any],
                parameters: Parameters, seconds: float) -> DirectResult:
        """Return IPOPT's solution in the terms of the problem."""
        n_t, mesh = self.model.arm.n_coordinates, self._mesh
        y, states, used, duration = self._unknowns.split(arrays['x'], parameters)
        rows = arrays['lam_g'][:mesh.P.shape[0] * 2 * n_t].reshape(-1, 2 * n_t)
        costates, point_costates = mesh.costates(rows)
        status, message = _outcome(stats, self._watch.stopped)
        speeds = y[:, n_t:n_t + self.model.arm.n_joints]
        return DirectResult(
            status=status, message=message, cost=cost, payload=used.payload_mass,
            duration=duration, times=duration * mesh.breaks, states=states, costates=costates,
            point_times=duration * mesh.points, point_states=y[:, :2 * n_t],
            point_costates=point_costates, torques=y[:, 3 * n_t:] - used.torque_slope * speeds,
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
