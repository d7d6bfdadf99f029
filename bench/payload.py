"""
Maximum payload: time to a correct result, against IPOPT maximising the payload.

A result is correct if the payload is within an accuracy of the limit, and if its torque, applied
to the original dynamics, brings the tip to the goal, see `ACCURACIES`. The time of the solution
counts for both; that of the re-simulation only for the planner, whose search does it.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
import statistics
import time

from bench.solver import paper_problem
from flex_planner import find_max_payload, find_min_duration, Monitor
from flex_planner.arms.kinematics import tip_position
from flex_planner.capacity.results import PayloadMethod
from flex_planner.dynamics.integration import PiecewisePolynomial, simulate
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.mesh import Mesh
from flex_planner.optimal_control.direct.result import DirectResult
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.certificate import CertificateLimits
import numpy as np

# of the payload [kg]: errors of the tip [m] that go with it. The first is what a plan must keep.
# The finest bracket is a millionth of the payload wide, 6e-6 kg here.
ACCURACIES = {1e-3: CertificateLimits().tip_error, 1e-5: 1e-8}
ARMS = {'korayem_rigid': 'rigid', 'korayem_ei50': 'EI 50, 2 x 2 modes',
        'korayem_ei5': 'EI 5, 2 x 2 modes'}
SCHEMES = {'IPOPT, Radau 3': ('radau', 3), 'IPOPT, Gauss 8': ('gauss', 8),
           'IPOPT, Hermite-Simpson': ('hermite_simpson', 3)}
INTERVALS = (10, 20, 40, 80, 160, 320, 640)
SEARCH_SECONDS = 60.0
# of the payload against the cost for IPOPT: so high that the limit is a hundredth of it away
_PRICES = {1e-3: 1e3, 1e-5: 3e4}
_LIGHT, _EXACT = 1.0, 1e-6
# runs of which the median is taken: over kinds of motion, and of IPOPT where it is as quick [s]
_FEW, _QUICK = 3, 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """
    A method on an arm.

    Attributes
    ----------
    reached : bool
        Whether it was right within the time; otherwise the figures are those of the finest run.
    intervals : int
        Of its mesh.
    seconds : float
        Of the search, or of the solve on that mesh.
    payload_error : float
        From the limit [kg].
    tip_error : float
        Of the re-simulation [m].

    """

    arm: str
    accuracy: float
    method: str
    reached: bool
    intervals: int
    seconds: float
    payload_error: float
    tip_error: float


def measure(arm: str, repeats: int = 7) -> list[Row]:
    """Return the rows of one arm."""
    problem = paper_problem(0.0, arm)
    exact = find_max_payload(problem.task, model=problem.model, accuracy=_EXACT)
    limit, rows = (exact.payload + exact.local_upper) / 2, []
    for accuracy in ACCURACIES:
        print(f'payload: {arm}, {accuracy:g} kg', flush=True)
        rows.append(_ours(arm, problem, limit, PayloadMethod.DIRECT, accuracy, repeats, 'fast'))
        rows.append(_ours(arm, problem, limit, PayloadMethod.DIRECT, accuracy, _FEW))
        if accuracy == max(ACCURACIES):
            rows.append(_ours(arm, problem, limit, PayloadMethod.INCREMENTAL, accuracy, 1))
        rows += [_rival(arm, problem, limit, name, accuracy) for name in SCHEMES]
    return rows


def _ours(arm: str, problem: MotionProblem, limit: float, method: PayloadMethod,
          accuracy: float, repeats: int, search: str = 'normal') -> Row:
    """Return the planner's row: everything from nothing to a certified plan."""
    found = [find_max_payload(problem.task, model=problem.model, method=method,
                              accuracy=accuracy, search=search) for _ in range(repeats)]
    plan = found[0].plan
    assert plan is not None
    error, tip = abs(found[0].payload - limit), plan.certificate.tip_error
    kinds = ', one kind' if search == 'fast' else ''
    return Row(arm=arm, accuracy=accuracy, method=f'flex_planner, {method.name}{kinds}',
               intervals=plan.mesh_intervals,
               seconds=statistics.median(one.planning_time for one in found),
               reached=found[0].solved and error <= accuracy and tip <= ACCURACIES[accuracy],
               payload_error=error, tip_error=tip)


def _rival(arm: str, problem: MotionProblem, limit: float, name: str, accuracy: float) -> Row:
    """Return IPOPT's row: the coarsest mesh that is right, or the finest that time allows."""
    monitor, row, (scheme, degree) = Monitor(time_limit=SEARCH_SECONDS), None, SCHEMES[name]
    for intervals in INTERVALS:
        direct = DirectProblem(problem.model, DirectSettings(
            scheme=scheme, degree=degree, intervals=intervals))
        found, seconds = _solve(direct, problem, accuracy, monitor)
        if not found.converged:
            break
        error = abs(found.payload - limit)
        tip = _tip_error(problem, direct.settings, found)
        row = Row(arm=arm, accuracy=accuracy, method=name, intervals=intervals, seconds=seconds,
                  reached=error <= accuracy and tip <= ACCURACIES[accuracy],
                  payload_error=error, tip_error=tip)
        if row.reached or monitor.stop_reason():
            break
    if row and row.reached and row.seconds < _QUICK:
        again = [_solve(direct, problem, accuracy, monitor)[1] for _ in range(_FEW - 1)]
        row = replace(row, seconds=statistics.median([row.seconds, *again]))
    return row or Row(arm=arm, accuracy=accuracy, method=name, intervals=0, reached=False,
                      seconds=monitor.elapsed, payload_error=np.inf, tip_error=np.inf)


def _solve(direct: DirectProblem, problem: MotionProblem, accuracy: float,
           monitor: Monitor) -> tuple[DirectResult, float]:
    """Return what IPOPT finds, and how long it takes [s]."""
    began = time.perf_counter()
    found = direct.solve(problem.parameters, problem.start, problem.goal, problem.task.duration,
                         free=Free.PAYLOAD, price=_PRICES[accuracy], monitor=monitor)
    return found, time.perf_counter() - began


def _tip_error(problem: MotionProblem, settings: DirectSettings, found: DirectResult) -> float:
    """Return the miss at the goal under IPOPT's torque, interpolated as by its scheme."""
    mesh = Mesh.of(settings.scheme, settings.degree, settings.intervals)
    breaks = np.linspace(0, problem.task.duration, settings.intervals + 1, dtype=np.float64)
    points = mesh.points * settings.intervals
    shared = int(settings.scheme == 'hermite_simpson')
    count = (points.size - shared) // settings.intervals
    index = np.arange(settings.intervals)[:, None] * count + np.arange(count + shared)
    theta = points[index[0]]
    torque = PiecewisePolynomial.through(breaks, theta, found.torques[index])
    physical = replace(problem.parameters, payload_mass=found.payload).physical
    final = simulate(problem.model, physical, problem.start, torque, problem.task.duration,
                     rtol=1e-9)
    n_t = problem.model.arm.n_coordinates
    tips = tip_position(problem.model.arm, np.stack([final[:n_t], problem.goal[:n_t]]))
    return float(np.linalg.norm(tips[0] - tips[1]))


def durations() -> dict[str, float]:
    """Return the time of a search for the shortest duration with 1 kg, by arm [s]."""
    return {name: statistics.median(
        find_min_duration(problem.task, model=problem.model).planning_time for _ in range(3))
        for arm, name in ARMS.items() for problem in (paper_problem(_LIGHT, arm),)}


def table(rows: Sequence[Row]) -> str:
    """Return the rows as Markdown."""
    lines = ['| arm | accuracy [kg] | method | intervals | error of the payload [kg] '
             '| tip error [m] | [s] | times ours |', '|' + '---|' * 8]
    for row in rows:
        ours = next(one for one in rows if (one.arm, one.accuracy) == (row.arm, row.accuracy))
        missed = '' if row.reached else ' (not reached)'
        lines.append(f'| {ARMS[row.arm]} | {row.accuracy:g} | {row.method}{missed} '
                     f'| {row.intervals} | {row.payload_error:.0e} | {row.tip_error:.0e} '
                     f'| {row.seconds:.3g} | {row.seconds / ours.seconds:.3g} |')
    return '\n'.join(lines)


def figures(rows: Sequence[Row]) -> list[dict[str, object]]:
    """Return the rows for JSON."""
    return [asdict(row) for row in rows]
