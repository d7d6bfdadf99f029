"""Where the mesh needs its nodes: defects, switches of F, and meshes that level the error."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from flex_planner.base.validation import Array
from flex_planner.collocation.equations import magnitudes
from flex_planner.collocation.problem import BoundaryValueProblem
from flex_planner.collocation.solution import CollocationSolution
import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

# density of nodes: at least this share of the largest, so that nothing is overlooked
_LEAST_DENSITY = 0.1
_SETTLED = 1e-13
_ROOT_STEPS, _POLISHING_STEPS = 12, 4
# nodes closer than this share of the span are one
_CLOSEST = 1e-9


@cache
def _probes(stages: int) -> Array:
    """
    Return where the defect is largest: both ends and inner extrema of the Legendre polynomial.

    The defect of a resolved interval is a multiple of the polynomial whose zeros are the Gauss
    points.

    """
    extrema = (legendre.legroots(legendre.legder([0] * stages + [1])) + 1) / 2
    inner = [extrema[0], extrema[(stages - 1) // 2], extrema[-1]]
    probes: Array = np.unique(np.concatenate([[0.0], inner, [1.0]]))
    return probes


def defects(problem: BoundaryValueProblem, solution: CollocationSolution) -> Array:
    """
    Return how far each interval's polynomial is from solving z' = F, shape (N,).

    Per interval: step times largest ``z' - F(t, z)``, of the worst unknown, in units of the
    unknown's magnitude. Falls with the power s + 1 of the step, so it overestimates the error at
    the nodes, which falls with 2 s.

    """
    theta = _probes(solution.rule.stages)
    values = solution.values_at(theta)
    rate = problem.rate(solution.times_at(theta).ravel(), values.reshape(-1, problem.size))
    defect = np.abs(solution.rates_at(theta) - rate.reshape(values.shape)).max(axis=1)
    sizes = defect * solution.steps[:, None]
    worst: Array = (sizes / magnitudes(problem, solution)).max(axis=1)
    # F may be undefined between the points
    finite: Array = np.where(np.isfinite(worst), worst, np.inf)
    return finite


def switching_times(problem: BoundaryValueProblem, solution: CollocationSolution) -> Array:
    """Return the times inside the mesh at which a switching function changes sign."""
    theta = np.concatenate([[0.0], solution.rule.nodes, [1.0]])
    times, unknowns = solution.times_at(theta), solution.values_at(theta)
    # the next node itself: a change of sign between it and the polynomial's end would be lost
    times[:, -1], unknowns[:, -1] = solution.mesh[1:], solution.nodes[1:]
    values = problem.switches(times.ravel(), unknowns.reshape(-1, problem.size))
    sign = (values >= 0).reshape(*times.shape, -1)
    changes = sign[:, 1:] != sign[:, :-1]
    changes[solution.steps == 0] = False
    k, i, e = np.nonzero(changes)
    if not k.size:
        return np.zeros(0)
    values = values.reshape(*times.shape, -1)
    low, high = (times[k, i], values[k, i, e]), (times[k, i + 1], values[k, i + 1, e])
    roots = _polish(problem, solution, e, _Interpolant.of(times, theta, values, (k, e)), low, high)
    if roots is None:  # the function is no polynomial there
        roots = _roots(problem, solution, e, low, high)
    return _distinct(np.sort(roots), solution.mesh[0], solution.mesh[-1])


def are_on_nodes(mesh: Array, switches: Array, tolerance: float) -> bool:
    """Return whether each switch is near enough to a node to cost less than a tolerance."""
    return cost_of_gaps(mesh, switches) <= tolerance


def cost_of_gaps(mesh: Array, switches: Array) -> float:
    """
    Return the largest error, relative to what a step adds, by a switch beside its node.

    A switch a distance d before the end of a step h is missed by every rule, and costs
    (d / h)^2 of what the step adds.

    """
    right = np.clip(np.searchsorted(mesh, switches), 1, mesh.size - 1)
    gaps = np.minimum(switches - mesh[right - 1], mesh[right] - switches)
    counts = gaps > _CLOSEST * (mesh[-1] - mesh[0])
    shares: Array = gaps[counts] / np.diff(mesh)[right - 1][counts]
    return float((shares**2).max(initial=0.0))


@dataclass(frozen=True, slots=True, eq=False)
class _Interpolant:
    """
    Polynomials through values of switching functions in intervals, r of them.

    `starts` and `steps` (r,) are those of the intervals, `powers` (d + 1, r) the coefficients of
    the powers of theta, the constant first.

    """

    starts: Array
    steps: Array
    powers: Array

    @classmethod
    def of(cls, times: Array, theta: Array, values: Array,
           which: tuple[NDArray[np.intp], NDArray[np.intp]]) -> _Interpolant:
        """Interpolate values (N, d + 1, e) at positions theta of the given intervals."""
        k, e = which
        powers = np.linalg.solve(np.vander(theta, increasing=True), values[k, :, e].T)
        return cls(times[k, 0], times[k, -1] - times[k, 0], powers)

    def __call__(self, at: Array) -> tuple[Array, Array]:
        """Return values and rates at times (r,)."""
        theta = (at - self.starts) / self.steps
        value, slope = self.powers[-1], np.zeros_like(theta)
        for coefficient in self.powers[-2::-1]:
            value, slope = coefficient + theta * value, value + theta * slope
        return value, slope / self.steps


def _polish(problem: BoundaryValueProblem, solution: CollocationSolution,
            which: NDArray[np.intp], interpolant: _Interpolant, low: tuple[Array, Array],
            high: tuple[Array, Array]) -> Array | None:
    """
    Return the zeros of bracketed functions by Newton's method, None if it does not settle.

    First those of polynomials through known values, at no price; then with their slopes those of
    the functions themselves, of which two or three values do.

    """
    (a, f_a), (b, f_b) = low, high
    c: Array = a - f_a * (b - a) / (f_b - f_a)
    settled = _SETTLED * (solution.mesh[-1] - solution.mesh[0])
    with np.errstate(divide='ignore', invalid='ignore'):
        for _ in range(_ROOT_STEPS):
            value, slope = interpolant(c)
            step = value / slope
            c = np.clip(c - step, a, b)
            if not np.abs(step).max() > settled:
                break
        for _ in range(_POLISHING_STEPS):
            value = problem.switches(c, solution(c))[np.arange(c.size), which]
            step = value / interpolant(c)[1]
            c = np.clip(c - step, a, b)
            # a step that was cut off at an end of the bracket is none that is small
            if np.abs(step).max() <= settled:
                return c
    return None


def _roots(problem: BoundaryValueProblem, solution: CollocationSolution,
           which: NDArray[np.intp], low: tuple[Array, Array],
           high: tuple[Array, Array]) -> Array:
    """Return the zeros of bracketed functions: false position with Illinois' correction."""
    (a, f_a), (b, f_b) = low, high
    kept: Array = np.zeros(a.size)  # 1 where b was kept by the step before, -1 where a was
    before, span = a, solution.mesh[-1] - solution.mesh[0]
    for _ in range(_ROOT_STEPS):
        gap = np.where(f_a == f_b, 1.0, f_b - f_a)
        c = np.clip(np.where(f_a == f_b, a, b - f_b * (b - a) / gap), a, b)
        if np.abs(c - before).max() <= _SETTLED * span:
            break
        before = c
        f_c = problem.switches(c, solution(c))[np.arange(c.size), which]
        left = (f_c >= 0) == (f_a >= 0)
        # an end kept twice in a row counts half, else it would stay for ever
        f_a, f_b = np.where(kept == -1, f_a / 2, f_a), np.where(kept == 1, f_b / 2, f_b)
        a, f_a = np.where(left, c, a), np.where(left, f_c, f_a)
        b, f_b = np.where(left, b, c), np.where(left, f_b, f_c)
        kept = np.where(left, 1.0, -1.0)
    return c


def _distinct(times: Array, start: float, end: float) -> Array:
    """Return sorted times without those that coincide with one another or an end."""
    least = _CLOSEST * (end - start)
    inside = times[(times > start + least) & (times < end - least)]
    apart: Array = inside[np.diff(inside, prepend=start) > least]
    return apart


def level_mesh(solution: CollocationSolution, defect: Array, growth: float, switches: Array, *,
               fewest: int, most: int) -> Array:
    """
    Return a mesh with nodes on the switches that spreads the error evenly between them.

    Nodes that come twice do so in the new mesh, too.

    Parameters
    ----------
    solution : CollocationSolution
        On the present mesh.
    defect : numpy.ndarray, shape (N,)
        From :func:`defects`.
    growth : float
        How many times smaller than the worst of now, in step, every interval should be.
    switches : numpy.ndarray
        From :func:`switching_times`.
    fewest, most : int
        Bounds of the number of intervals, which is at least one more than the switches.

    """
    density, twice = _density(solution, defect, switches), solution.junctions
    fewest, most = max(fewest - twice.size, 1), most - twice.size
    # intervals wanted up to each node; the worst interval of now is cut into `growth`
    wanted = np.concatenate([[0.0], np.cumsum(density)]) * growth
    total = float(np.clip(wanted[-1], fewest, most))
    wanted *= total / wanted[-1]
    breaks = np.concatenate([solution.mesh[:1], _between(solution, switches),
                             solution.mesh[-1:]])
    at_breaks = np.interp(breaks, solution.mesh, wanted)
    counts = np.maximum(1, np.rint(np.diff(at_breaks))).astype(int)
    while counts.sum() > most and counts.max() > 1:  # rounding made too many
        counts[counts.argmax()] -= 1
    pieces = [np.interp(np.linspace(a, b, count + 1), wanted, solution.mesh)
              for a, b, count in zip(at_breaks, at_breaks[1:], counts, strict=False)]
    for piece, first, last in zip(pieces, breaks, breaks[1:], strict=False):
        piece[0], piece[-1] = first, last
    mesh = np.concatenate([pieces[0][:1], *(piece[1:] for piece in pieces)])
    return np.sort(np.concatenate([mesh, twice])) if twice.size else mesh


def _between(solution: CollocationSolution, switches: Array) -> Array:
    """Return switches and nodes that come twice, in order; a switch at such a node is none."""
    twice, span = solution.junctions, solution.mesh[-1] - solution.mesh[0]
    if not twice.size:
        return switches
    apart = np.abs(switches[:, None] - twice).min(axis=1) > _CLOSEST * span
    merged: Array = np.sort(np.concatenate([switches[apart], twice]))
    return merged


def _density(solution: CollocationSolution, defect: Array, switches: Array) -> Array:
    """Return the share of new intervals that each interval deserves, the worst one 1."""
    finite = np.where(np.isfinite(defect), defect, 1.0)
    density = np.maximum(finite, 1e-300) ** (1 / (solution.rule.stages + 1))
    # a switch inside an interval spoils its defect, but not once there is a node
    cut = np.unique(np.searchsorted(solution.mesh, switches, side='right') - 1)
    smooth = np.setdiff1d(np.arange(density.size), cut)
    if cut.size and smooth.size:
        on_node = np.isclose(solution.mesh[cut], switches[:, None], atol=_CLOSEST, rtol=0)
        spoilt = cut[~on_node.any(axis=0)]
        density[spoilt] = np.interp(spoilt, smooth, density[smooth])
    density = np.maximum(density / density.max(), _LEAST_DENSITY)
    padded = np.pad(density, 1, mode='edge')
    graded: Array = np.maximum(density, (padded[:-2] + padded[2:]) / 2)
    graded[solution.steps == 0] = 0
    return graded


def coarsen(problem: BoundaryValueProblem, solution: CollocationSolution, defect: float,
            fewest: int) -> CollocationSolution:
    """
    Return a solution on as few intervals as leave a certain defect, expected to be coarse.

    For the next of a family of problems: meshes that only ever grew would end it.

    """
    found = defects(problem, solution)
    growth = float((found.max() / defect) ** (1 / (solution.rule.stages + 1)))
    mesh = level_mesh(solution, found, growth, switching_times(problem, solution),
                      fewest=fewest, most=solution.intervals)
    return solution.on_mesh(mesh)
