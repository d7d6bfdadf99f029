"""
Direct collocation of the optimal control problem, solved by IPOPT.

It needs no costates to start from and returns them, from the multipliers of the programme of
`flex_planner.optimal_control.direct.programme`.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
import time

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt_crew import solve_each
from flex_planner.optimal_control.direct.ipopt_start import Answer, pack_recipe, Start
from flex_planner.optimal_control.direct.mesh import Mesh, SCHEMES
from flex_planner.optimal_control.direct.point_layout import TorqueRates
from flex_planner.optimal_control.direct.result import DirectResult, DirectStatus
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
            raise InvalidValueError('scheme', self.scheme, one_of(self.scheme, SCHEMES))
        integer('degree', self.degree, at_least=1, at_most=12)
        integer('intervals', self.intervals, at_least=2, at_most=20000)
        integer('max_iterations', self.max_iterations, at_least=1, at_most=100000)
        number('tolerance', self.tolerance, at_least=1e-14, at_most=1e-2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Case:
    """The data of a motion: its parameters, the states at its ends, prices, and IPOPT's inputs."""

    parameters: Parameters
    ends: tuple[Array, Array]
    prices: list[float]
    inputs: dict[str, Array]


class DirectProblem:
    """
    The motions of one arm on one mesh: derived once, solved as often as wanted.

    Both happens in another process, see `ipopt_crew`.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    settings : DirectSettings, optional
        Mesh and tolerances.
    breaks : numpy.ndarray, shape (intervals + 1,), optional
        Ends of the intervals from 0 to 1; equal intervals if not given.
    rates : TorqueRates, optional
        Of torques that are states; torques may jump if it is not given.

    Attributes
    ----------
    build_seconds : float
        What the derivation took; 0 before the first solve, and where it was known.

    """

    def __init__(self, model: ArmModel, settings: DirectSettings | None = None,
                 breaks: Array | None = None, rates: TorqueRates | None = None) -> None:
        self.model, self.settings = model, settings or DirectSettings()
        self._mesh = Mesh.of(self.settings.scheme, self.settings.degree, self.settings.intervals,
                             breaks)
        self._unknowns, self._rates = Unknowns(model, self._mesh, rates), rates
        self._recipes: dict[bool, bytes] = {}
        self.build_seconds = 0.0

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
            Times (k,) to z (k, m) of a `MotionProblem`, such as a `CollocationSolution` or a
            `DirectResult`; a straight line if not given.
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
        ValueError
            If the payload is free under gravity, where the torques at both ends change with it.

        """
        case = self._case(parameters, start, goal, duration, free, price, most_payload)
        start, goal = case.ends
        iterate = warm.iterate if warm else {
            'x0': self._first(guess, path, parameters, start, goal, duration)}
        [found] = self._solve_each(case, [iterate], warm is not None, monitor or Monitor())
        return found

    def solve_from_paths(self, paths: Sequence[Path], parameters: Parameters, start: Array,
                         goal: Array, duration: float, *, free: Free = Free.NOTHING,
                         price: float = 0.0, most_payload: float = MAX_PAYLOAD,
                         monitor: Monitor | None = None) -> Iterator[DirectResult]:
        """
        Yield what each of several paths leads to, in their order; see `solve`.

        They are solved side by side where there are processors. Once the monitor has stopped one
        of them it is the last.

        """
        case = self._case(parameters, start, goal, duration, free, price, most_payload)
        iterates = [{'x0': self._unknowns.on_path(path, parameters, duration)} for path in paths]
        return self._solve_each(case, iterates, False, monitor or Monitor())

    def _case(self, parameters: Parameters, start: Array, goal: Array, duration: float,
              free: Free, price: float, most_payload: float) -> _Case:
        """Return the data of a motion, checked."""
        n_x = 2 * self.model.arm.n_coordinates
        ends = vector('start', start, n_x), vector('goal', goal, n_x)
        number('duration', duration, above=0, unit='s')
        if self._rates is not None and free is Free.PAYLOAD and self.model.arm.gravity.any():
            raise ValueError('the payload is free, but must be given under gravity where torques '
                             'have rates')
        prices = [1.0, price * (free is Free.PAYLOAD), price * (free is Free.DURATION)]
        lower, upper = self._unknowns.bounds(parameters, duration, free, most_payload)
        least, most = self._unknowns.rows(parameters)
        return _Case(parameters=parameters, ends=ends, prices=prices, inputs={
            'lbx': lower, 'ubx': upper, 'lbg': least, 'ubg': most,
            'p': np.concatenate([parameters.stack(), *self._given(ends), prices])})

    def _given(self, ends: tuple[Array, Array]) -> tuple[Array, ...]:
        """Return what the programme is to know of rates of torques, and all states at the ends."""
        if self._rates is None:
            return ends
        rates, (start, goal) = self._rates, ends
        return rates.weights, start, rates.start, goal, rates.goal

    def _solve_each(self, case: _Case, iterates: Sequence[dict[str, Array]], warm: bool,
                    monitor: Monitor) -> Iterator[DirectResult]:
        """Yield what each iterate leads to."""
        recipe = self._recipe(warm=warm)
        starts = [Start(recipe=recipe, inputs={**case.inputs, **iterate}) for iterate in iterates]
        began, before = time.perf_counter(), monitor.iteration
        with closing(solve_each(starts, monitor, self.settings.intervals)) as answers:
            for start in starts:
                try:
                    answer, status = next(answers), None
                except StoppedError as error:
                    status = DirectStatus.STOPPED
                    answer = Answer.failed(start, str(error), max(
                        monitor.iteration - before - 1, 0), time.perf_counter() - began)
                self.build_seconds = max(self.build_seconds, answer.build_seconds)
                yield self._result(answer, case, status)
                if status is not None:
                    return
                began, before = time.perf_counter(), monitor.iteration

    def _first(self, guess: Guess | None, path: Path | None, parameters: Parameters,
               start: Array, goal: Array, duration: float) -> Array:
        """Return the first unknowns."""
        if path is not None:
            return self._unknowns.on_path(path, parameters, duration)
        if guess is not None:
            return self._unknowns.on_motion(guess, parameters, duration)
        return self._unknowns.on_straight_line(start, goal, parameters, duration)

    def _recipe(self, *, warm: bool) -> bytes:
        """Return the recipe of the programme, packed once for each kind of start."""
        if warm not in self._recipes:
            options = {**_ALWAYS, 'max_iter': self.settings.max_iterations,
                       'tol': self.settings.tolerance, **(_WARM if warm else {}),
                       **(_EXPLORING if self.settings.exploring else {})}
            self._recipes[warm] = pack_recipe(
                self.model.arm, self._mesh.transcription(), options,
                with_rates=self._rates is not None)
        return self._recipes[warm]

    def _result(self, answer: Answer, case: _Case, status: DirectStatus | None) -> DirectResult:
        """Return IPOPT's answer in the terms of the problem."""
        n_t, mesh, layout = self.model.arm.n_coordinates, self._mesh, self._unknowns.layout
        y, states, used, duration = self._unknowns.split(answer.x, case.parameters)
        rows = answer.lam_g[:mesh.P.shape[0] * layout.states].reshape(-1, layout.states)
        costates, point_costates = (self._of_torques(psi, used) for psi in mesh.costates(rows))
        half, speeds = 2 * n_t, slice(n_t, n_t + self.model.arm.n_joints)
        rates = {} if self._rates is None else {
            'node_torques': states[:, half:] - used.torque_slope * states[:, speeds],
            'torque_costates': costates[:, half:],
            'point_torque_costates': point_costates[:, half:],
            'torque_rates': self._unknowns.torque_rates(y, used)}
        ended = DirectStatus.CONVERGED if answer.converged else DirectStatus.FAILED
        return DirectResult(
            status=status or ended, message=answer.message,
            cost=answer.objective + case.prices[1] * answer.x[-2] - case.prices[2] * answer.x[-1],
            payload=used.payload_mass, duration=duration, times=duration * mesh.breaks,
            states=states[:, :half], costates=costates[:, :half],
            point_times=duration * mesh.points, point_states=y[:, :half],
            point_costates=point_costates[:, :half],
            torques=y[:, layout.drives] - used.torque_slope * y[:, speeds],
            iterations=answer.iterations, seconds=answer.seconds, **rates,
            iterate={'x0': answer.x, 'lam_x0': answer.lam_x, 'lam_g0': answer.lam_g})

    def _of_torques(self, costates: Array, parameters: Parameters) -> Array:
        """Return costates of (q, q', w) as those of (q, q', tau), where w is a state."""
        n_t, n = self.model.arm.n_coordinates, self.model.arm.n_joints
        found = costates.copy()
        if self._rates is not None:
            found[:, n_t:n_t + n] += parameters.torque_slope * costates[:, 2 * n_t:]
        return found


def solve_direct(model: ArmModel, parameters: Parameters, start: Array, goal: Array,
                 duration: float, settings: DirectSettings | None = None,
                 guess: Guess | None = None, monitor: Monitor | None = None) -> DirectResult:
    """Solve a problem once, see `DirectProblem`; shapes and units are explained there."""
    return DirectProblem(model, settings).solve(parameters, start, goal, duration, guess=guess,
                                                monitor=monitor)
