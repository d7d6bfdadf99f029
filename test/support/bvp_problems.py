"""
Boundary-value problems with known solutions, for the tests of the collocation.

The problems "MC n" are of the Mazzia-Cash test set (J. R. Cash and F. Mazzia, Algorithms for the
solution of two-point boundary value problems; F. Mazzia, Test set for BVP solvers, 2014).

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationSolution, GaussRule, SolverSettings
from flex_planner.collocation.newton import newton, NewtonOutcome
import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
pi = np.pi


def derivatives(f: Callable[[Any], Any], z: Array) -> Array:
    """Return the Jacobian (..., n, m) of an analytic f at z (..., m): no digit is lost."""
    steps = 1e-30j * np.eye(z.shape[-1])
    return np.stack([np.imag(f(z + step)) / 1e-30 for step in steps], axis=-1)


def stack(parts: list[Any], shape: tuple[int, ...]) -> Any:
    if not parts:
        return np.zeros((*shape, 0))
    return np.stack(np.broadcast_arrays(*parts, np.zeros(shape))[:-1], axis=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class System:
    """
    A boundary-value problem as the solver wants it, of functions of the single unknowns.

    They are differentiated by complex steps, so they have to be analytic where they are smooth.

    """

    size: int
    rate_of: Callable[[Array, Any], list[Any]]
    left_of: Callable[[Any], list[Any]]
    right_of: Callable[[Any], list[Any]]
    switches_of: Callable[[Array, Any], list[Any]] = field(default=lambda t, z: [])
    explicit: Indices = field(default_factory=lambda: np.zeros(0, int))

    @property
    def scale(self) -> Array:
        return np.ones(self.size)

    def rate(self, t: Array, z: Array) -> Array:
        rate: Array = stack(self.rate_of(t, z.T), t.shape)
        return rate

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        return self.rate(t, z), derivatives(lambda values: self.rate(t, values), z)

    def switches(self, t: Array, z: Array) -> Array:
        switches: Array = stack(self.switches_of(t, z.T), t.shape)
        return switches

    def left(self, z: Array) -> tuple[Array, Array]:
        return (stack(self.left_of(z), ()),
                derivatives(lambda values: stack(self.left_of(values), ()), z))

    def right(self, z: Array) -> tuple[Array, Array]:
        return (stack(self.right_of(z), ()),
                derivatives(lambda values: stack(self.right_of(values), ()), z))


def second_order(f: Callable[[Array, Any, Any], Any], start: float, end: float,
                 **more: Any) -> System:
    """Return y'' = f(t, y, y') with y given at both ends."""
    return System(size=2, rate_of=lambda t, z: [z[1], f(t, *z)],
                  left_of=lambda z: [z[0] - start], right_of=lambda z: [z[0] - end], **more)


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """A problem on a span with its solution z_0(t), and a guess of z_0 to start from."""

    problem: System
    exact: Callable[[Array], Array] = field(default=lambda t: np.full_like(t, np.nan))
    span: tuple[float, float] = (0.0, 1.0)
    guess: Callable[[Array], Array] = np.zeros_like
    # of the other unknowns, from z_1 on; the slope of the guess if not given
    others: tuple[float, ...] = ()

    def start(self, settings: SolverSettings) -> CollocationSolution:
        mesh = np.linspace(*self.span, settings.intervals + 1)
        nodes = np.zeros((mesh.size, self.problem.size))
        nodes[:, 0] = self.guess(mesh)
        if self.others:
            nodes[:, 1:] = self.others
        elif self.problem.size > 1:
            nodes[:, 1] = np.gradient(nodes[:, 0], mesh)
        return CollocationSolution.from_values(mesh, nodes, settings.rule)

    def error(self, solution: CollocationSolution, times: Array | None = None) -> float:
        """Return the largest relative error of z_0, at the nodes if no times are given."""
        times = solution.mesh if times is None else times
        size = max(1.0, float(np.abs(solution.nodes[:, 0]).max()))
        return float(np.abs(solution(times)[:, 0] - self.exact(times)).max()) / size


def bratu(upper: bool) -> Case:
    """Return y'' = -exp(y), y(0) = y(1) = 0, which has two solutions."""
    # the roots of theta = sqrt(2) cosh(theta / 4)
    theta = 10.938702772122 if upper else 1.5171645990508
    return Case(problem=second_order(lambda t, y, v: -np.exp(y), 0, 0),
                exact=lambda t: -2 * np.log(np.cosh((t - 0.5) * theta / 2) / np.cosh(theta / 4)),
                guess=(lambda t: 16 * t * (1 - t)) if upper else np.zeros_like)


def mc_01(eps: float) -> Case:
    """Return eps y'' = y, a layer at the left end."""
    r = np.sqrt(eps)
    return Case(problem=second_order(lambda t, y, v: y / eps, 1, 0),
                exact=lambda t: (np.exp(-t/r) - np.exp((t - 2) / r)) / (1 - np.exp(-2/r)))


def mc_02(eps: float) -> Case:
    """Return eps y'' = y', a layer at the right end."""
    return Case(problem=second_order(lambda t, y, v: v / eps, 1, 0),
                exact=lambda t: (1 - np.exp((t - 1) / eps)) / (1 - np.exp(-1/eps)))


def mc_03(eps: float) -> Case:
    """Return a problem whose coefficients and right-hand side depend on t."""
    def f(t: Array, y: Any, v: Any) -> Any:
        a = 2 + np.cos(pi*t)
        return (-a*v + y - (1 + eps*pi**2) * np.cos(pi*t) - a * pi * np.sin(pi*t)) / eps

    return Case(problem=second_order(f, -1, -1), exact=lambda t: np.cos(pi*t), span=(-1, 1))


def mc_04(eps: float) -> Case:
    """Return eps y'' + y' - (1 + eps) y = 0, a layer at the left end and no flat part."""
    a = (1 + eps) / eps
    return Case(problem=second_order(lambda t, y, v: a*y - v/eps, 1 + np.exp(-2),
                                     1 + np.exp(-2*a)),
                exact=lambda t: np.exp(t - 1) + np.exp(-a * (1 + t)), span=(-1, 1))


def mc_06(eps: float) -> Case:
    """Return a shock inside, at the turning point t = 0."""
    r = np.sqrt(2 * eps)
    return Case(problem=second_order(lambda t, y, v: -t*v/eps - pi**2 * np.cos(pi*t)
                                     - pi*t/eps * np.sin(pi*t), -2, 0),
                exact=lambda t: np.cos(pi*t) + erf(t / r) / erf(1 / r), span=(-1, 1))


def mc_07(eps: float) -> Case:
    """Return a corner at the turning point t = 0."""
    r = np.sqrt(2 * eps)

    def corner(t: Array) -> Array:
        value: Array = t * erf(t / r) + r / np.sqrt(pi) * np.exp(-(t / r)**2)
        return value

    return Case(problem=second_order(
        lambda t, y, v: (-t*v + y - (1 + eps*pi**2) * np.cos(pi*t)) / eps
        - pi*t/eps * np.sin(pi*t), -1, 1),
        exact=lambda t: np.cos(pi*t) + t + corner(t) / corner(np.ones(1)), span=(-1, 1))


def mc_08(eps: float) -> Case:
    """Return eps y'' = -y', a layer at the left end."""
    return Case(problem=second_order(lambda t, y, v: -v / eps, 1, 2),
                exact=lambda t: (2 - np.exp(-1/eps) - np.exp(-t/eps)) / (1 - np.exp(-1/eps)))


def mc_09(eps: float) -> Case:
    """Return (eps + t^2) y'' = -4 t y' - 2 y, a spike of height 1/eps."""
    return Case(problem=second_order(lambda t, y, v: -(4*t*v + 2*y) / (eps + t**2),
                                     1 / (1 + eps), 1 / (1 + eps)),
                exact=lambda t: 1 / (eps + t**2), span=(-1, 1))


def mc_14(eps: float) -> Case:
    """Return eps y'' = y - (eps pi^2 + 1) cos(pi t), with layers at both ends."""
    r = np.sqrt(eps)
    return Case(
        problem=second_order(lambda t, y, v: (y - (eps*pi**2 + 1) * np.cos(pi*t)) / eps, 0, 0),
        exact=lambda t: np.cos(pi*t) + (np.exp((t - 1) / r) + np.exp(-(t + 1) / r))
        / (1 + np.exp(-2/r)), span=(-1, 1))


def mc_18(eps: float) -> Case:
    """Return eps y'' = -y', a layer at the left end down to almost nothing."""
    return Case(problem=second_order(lambda t, y, v: -v / eps, 1, np.exp(-1/eps)),
                exact=lambda t: np.exp(-t/eps))


def mc_20(eps: float) -> Case:
    """Return eps y'' = 1 - y'^2, a corner."""
    def exact(t: Array) -> Array:
        x = (t - 0.745) / eps
        value: Array = 1 + eps * (np.logaddexp(x, -x) - np.log(2))
        return value

    start, end = exact(np.array([0.0, 1.0]))
    return Case(problem=second_order(lambda t, y, v: (1 - v**2) / eps, start, end),
                exact=exact, guess=lambda t: 1.7 - 0.5 * t)


def emden() -> Case:
    """Return y'' = -2 y' / t - y^5, the star of Lane and Emden: F is undefined at t = 0."""
    def f(t: Array, y: Any, v: Any) -> Any:
        return np.where(t > 0, -2 * v / np.where(t > 0, t, 1), np.nan) - y**5

    return Case(problem=System(size=2, rate_of=lambda t, z: [z[1], f(t, *z)],
                               left_of=lambda z: [z[1]],
                               right_of=lambda z: [z[0] - np.sqrt(0.75)]),
                exact=lambda t: 1 / np.sqrt(1 + t**2 / 3), guess=np.ones_like)


def kink() -> Case:
    """Return y'' = |y|, whose solution changes from sin t to sinh t at t = 0."""
    return Case(problem=second_order(lambda t, y, v: np.where(np.real(y) < 0, -y, y),
                                     -np.sin(1), np.sinh(1.3), switches_of=lambda t, z: [z[0]]),
                exact=lambda t: np.where(t < 0, np.sin(t), np.sinh(t)), span=(-1, 1.3),
                guess=lambda t: t)


CASES = {
    'linear': Case(problem=second_order(lambda t, y, v: y, 0, 1),
                   exact=lambda t: np.sinh(t) / np.sinh(1)),
    'bratu, lower': bratu(upper=False),
    'bratu, upper': bratu(upper=True),
    'MC 1, layer': mc_01(1e-4),
    'MC 2, layer': mc_02(1e-2),
    'MC 3, nonautonomous': mc_03(0.1),
    'MC 4, layer': mc_04(1e-2),
    'MC 6, shock': mc_06(1e-3),
    'MC 7, corner': mc_07(1e-3),
    'MC 8, layer': mc_08(1e-2),
    'MC 9, spike': mc_09(0.1),
    # growth and decay by e^200 across the span: transition matrices must not be multiplied
    'MC 14, two layers': mc_14(1e-4),
    'MC 14, thin layers': mc_14(1e-8),
    'MC 18, layer': mc_18(1e-3),
    'MC 20, corner': mc_20(0.02),
    'kink': kink(),
    # growth and decay by e^1000
    'long interval': Case(problem=second_order(lambda t, y, v: y, 1, 1), span=(0, 1000),
                          exact=lambda t: np.exp(-t) + np.exp(t - 1000)),
    # y''' = y with two conditions at the left and one at the right
    'third order': Case(
        problem=System(size=3, rate_of=lambda t, z: [z[1], z[2], z[0]],
                       left_of=lambda z: [z[0] - 1, z[1] + z[2] - 2],
                       right_of=lambda z: [z[0] - np.e]), exact=np.exp),
    # y' = -2 t y^2, y(0) = 1: all conditions at one end
    'initial values': Case(
        problem=System(size=1, rate_of=lambda t, z: [-2 * t * z[0]**2],
                       left_of=lambda z: [z[0] - 1], right_of=lambda z: []),
        exact=lambda t: 1 / (1 + t**2), span=(0, 3), guess=np.ones_like),
    # y'' = -k^2 y, k' = 0, y'(0) = k: the second eigenvalue k = 2 pi is an unknown
    'Sturm-Liouville': Case(
        problem=System(size=3, rate_of=lambda t, z: [z[1], -z[2]**2 * z[0], 0],
                       left_of=lambda z: [z[0], z[1] - z[2]], right_of=lambda z: [z[0]]),
        exact=lambda t: np.sin(2*pi*t), guess=lambda t: np.sin(2*pi*t)**3, others=(3, 6)),
}


def mc_24(eps: float) -> Case:
    """Return the flow through a nozzle of area 1 + t^2, with a shock."""
    def f(t: Array, y: Any, v: Any) -> Any:
        area, gamma = 1 + t**2, 1.4
        return (((1 + gamma) / 2 - 2 * eps * t) * y * v - v / y
                - 2*t/area * (1 - (gamma - 1) / 2 * y**2)) / (eps * area * y)

    return Case(problem=second_order(f, 0.9129, 0.375), guess=lambda t: 0.9129 - 0.5379 * t)


def mc_31(eps: float) -> Case:
    """Return a beam under its load: displacement, angle, moment and shear force."""
    def rate(t: Array, z: Any) -> list[Any]:
        y, angle, M, Q = z
        T = 1 / np.cos(angle) + eps * Q * np.tan(angle)
        return [np.sin(angle), M, -Q / eps, ((y - 1) * np.cos(angle) - M * T) / eps]

    return Case(problem=System(size=4, rate_of=rate, left_of=lambda z: [z[0], z[2]],
                               right_of=lambda z: [z[0], z[2]]), others=(0, 0, 0))


OPEN = {
    'MC 19, layer': Case(problem=second_order(
        lambda t, y, v: (pi/2 * np.sin(pi*t/2) * np.exp(2*y) - np.exp(y) * v) / 0.05, 0, 0)),
    'MC 24, shock': mc_24(0.05),
    'MC 31, beam': mc_31(0.1),
    # the flow in a channel with porous walls at a Reynolds number of 100
    'MC 32, channel': Case(problem=System(
        size=4, rate_of=lambda t, z: [*z[1:], 100 * (z[1] * z[2] - z[0] * z[3])],
        left_of=lambda z: [z[0], z[1]], right_of=lambda z: [z[0] - 1, z[1]]),
        guess=lambda t: t, others=(1, 0, 0)),
    # the flow between discs that turn against each other, eps = 0.01
    'MC 33, discs': Case(problem=System(
        size=6, rate_of=lambda t, z: [*z[1:4], -100 * (z[0] * z[3] + z[4] * z[5]), z[5],
                                      100 * (z[1] * z[4] - z[0] * z[5])],
        left_of=lambda z: [z[0], z[1], z[4] + 1], right_of=lambda z: [z[0], z[1], z[4] - 1]),
        others=(0, 0, 0, 0, 2)),
}

# the case, and some unknowns at the start
TABULATED: dict[str, tuple[Case, dict[int, float]]] = {
    # the boundary layer of Blasius; J. P. Boyd, SIAM Review 50, 2008
    'Blasius': (Case(problem=System(
        size=3, rate_of=lambda t, z: [z[1], z[2], -z[0] * z[2] / 2],
        left_of=lambda z: [z[0], z[1]], right_of=lambda z: [z[1] - 1]), span=(0, 15),
        guess=lambda t: t, others=(1, 0.1)), {2: 0.332057336215196}),
    # the flow over a turning disc of von Karman, by H, F, F', G, G'
    'von Karman': (Case(problem=System(
        size=5, rate_of=lambda t, z: [-2 * z[1], z[2], z[1]**2 - z[3]**2 + z[0] * z[2], z[4],
                                      2 * z[1] * z[3] + z[0] * z[4]],
        left_of=lambda z: [z[0], z[1], z[3] - 1], right_of=lambda z: [z[1], z[3]]),
        span=(0, 40), guess=lambda t: -0.8 + 0 * t, others=(0, 0, 0, 0)),
        {2: 0.510232618867, 4: -0.615922014399}),
    # MC 23, Troesch's plasma column with mu = 5
    'Troesch': (Case(problem=second_order(lambda t, y, v: 5 * np.sinh(5 * y), 0, 1),
                     guess=lambda t: t), {1: 4.575046140632e-2}),
}


def outcome_on(case: Case, intervals: int | Array, stages: int) -> NewtonOutcome:
    """Solve on a mesh, or a uniform one, from the closed form, as far as rounding lets."""
    mesh = (np.linspace(*case.span, intervals + 1) if isinstance(intervals, int)
            else intervals).astype(float)
    values = np.stack([case.exact(mesh), np.gradient(case.exact(mesh), mesh)], axis=1)
    guess = CollocationSolution.from_values(mesh, values, GaussRule.of(stages))
    outcome = newton(case.problem, guess, tolerance=1e-13, max_iterations=20, monitor=Monitor())
    assert outcome.converged
    return outcome


def solved_on(case: Case, intervals: int | Array, stages: int) -> CollocationSolution:
    return outcome_on(case, intervals, stages).solution


STEEP = Case(problem=second_order(lambda t, y, v: 64 * y, 0, 1),
             exact=lambda t: np.sinh(8 * t) / np.sinh(8))
