"""
Natural frequencies and mode shapes of a clamped Euler-Bernoulli beam with a load at its tip.

Lengths are in units of the beam's, so x runs from 0 to 1. An eigenvalue lambda belongs to the
angular frequency ``lambda^2 sqrt(EI / (rho L^4))``.

"""

from __future__ import annotations

from dataclasses import dataclass
import math

from flex_planner.base.validation import Array, number
import numpy as np

# below it, 1 - cos cosh and its companions lose digits and are summed as power series
_SERIES_BELOW = 1.0
_SERIES_TERMS = 9
_BRACKET = 1e-7
_EPSILON = 4 * np.finfo(float).eps
MAX_LOAD_RATIO = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class TipLoad:
    """
    A rigid body at the tip of a beam of length L and linear density rho.

    Parameters
    ----------
    mass_ratio : float
        M / (rho L), 0 to 2e9.
    inertia_ratio : float
        J / (rho L^3), 0 to 2e9.

    """

    mass_ratio: float = 0.0
    inertia_ratio: float = 0.0

    def __post_init__(self) -> None:
        number('mass_ratio', self.mass_ratio, at_least=0, at_most=2 * MAX_LOAD_RATIO)
        number('inertia_ratio', self.inertia_ratio, at_least=0, at_most=2 * MAX_LOAD_RATIO)


@dataclass(frozen=True, slots=True, kw_only=True)
class ClampedMode:
    """
    A mode ``cosh bx - cos bx - s (sinh bx - sin bx)`` of a clamped beam, b its eigenvalue.

    Written with decaying exponentials: the hyperbolic functions of a high mode would cancel to
    nothing.

    Parameters
    ----------
    eigenvalue : float
        b.
    growing : float
        ``(1 - s) e^b``, which stays moderate where 1 - s is tiny.

    """

    eigenvalue: float
    growing: float

    @classmethod
    def of(cls, order: int, load: TipLoad) -> ClampedMode:
        """Return the mode of an order, from 1, of a beam with a tip load."""
        b = clamped_eigenvalue(order, load)
        decay, s, c = math.exp(-b), math.sin(b), math.cos(b)
        weight = load.mass_ratio * b
        # s from the shear force at the tip: its denominator is never 0
        numerator = decay + c + s + weight * (c - s - decay)
        denominator = ((1 + decay**2) / 2 + c * decay
                       + weight * ((1 - decay**2) / 2 - s * decay))
        return cls(eigenvalue=b, growing=numerator / denominator)

    def __call__(self, x: Array, derivative: int = 0) -> Array:
        """Return a derivative of the shape at stations x from 0 to 1."""
        b = self.eigenvalue
        ratio = 1 - self.growing * math.exp(-b)  # s
        outer = self.growing / 2 * np.exp(-b * (1 - x))
        inner = (1 + ratio) / 2 * np.exp(-b * x) * (-1) ** derivative
        phase = b * x + derivative * math.pi / 2
        value: Array = b**derivative * (outer + inner - np.cos(phase) + ratio * np.sin(phase))
        return value


def clamped_eigenvalue(order: int, load: TipLoad) -> float:
    """
    Return the eigenvalue of a mode, from order 1, of a clamped beam with a tip load.

    Bisects the number of eigenvalues below a trial value, so that none can be missed or counted
    twice, however close together or extreme they are; then polishes it with the frequency
    equation, which is better conditioned.

    """
    low, high = 0.0, (order + 1) * math.pi
    while high - low > _BRACKET * high:
        middle = (low + high) / 2
        if eigenvalues_below(middle, load) >= order:
            high = middle
        else:
            low = middle
    low, high = low * (1 - _BRACKET), high * (1 + _BRACKET)
    from scipy.optimize import brentq  # half a start's time, and not every arm needs it

    if frequency_equation(low, load) * frequency_equation(high, load) < 0:
        return float(brentq(frequency_equation, low, high, (load,), xtol=1e-300, rtol=_EPSILON))
    return (low + high) / 2


def frequency_equation(value: float, load: TipLoad) -> float:
    """Return the frequency function of a clamped beam with a tip load, 0 at its eigenvalues."""
    gap, deflection, _, slope = _tip_functions(value)
    free = 2 - gap if value < _SERIES_BELOW else 1 / math.cosh(value) + math.cos(value)
    mass, inertia = load.mass_ratio * value, load.inertia_ratio * value**3
    return free - mass * slope - inertia * deflection + mass * inertia * gap


def eigenvalues_below(value: float, load: TipLoad) -> int:
    """
    Return the number of eigenvalues of a clamped beam with a tip load below a value > 0.

    Wittrick and Williams 1971: the eigenvalues of the beam clamped at both ends, and one for
    each negative eigenvalue of the dynamic stiffness of its tip.

    """
    gap, deflection, coupling, slope = _tip_functions(value)
    stiffness = np.array([
        [deflection / gap - load.mass_ratio * value, -coupling / gap],
        [-coupling / gap, slope / gap - load.inertia_ratio * value**3]])
    cycles = math.floor(value / math.pi)
    clamped = cycles - (0 if (gap > 0) == (cycles % 2 == 0) else 1)
    return clamped + int((np.linalg.eigvalsh(stiffness) < 0).sum())


def _tip_functions(b: float) -> tuple[float, float, float, float]:
    """
    Return 1 - cos cosh, cos sinh + sin cosh, sin sinh, sin cosh - cos sinh of b.

    All over cosh b where that is large; only their ratios are used.

    """
    if b < _SERIES_BELOW:
        # real and imaginary parts of cosh and sinh of (1 + i) b hold the four products
        terms = [((1 + 1j) * b) ** n / math.factorial(n) for n in range(1, 4 * _SERIES_TERMS)]
        sinh = sum(terms[0::2])
        gap = -sum(term.real for term in terms[3::4])
        sin_sinh = sum(term.imag for term in terms[1::2])
        return gap, sinh.real + sinh.imag, sin_sinh, sinh.imag - sinh.real
    c, s, tanh, sech = math.cos(b), math.sin(b), math.tanh(b), 1 / math.cosh(b)
    return sech - c, c * tanh + s, s * tanh, s - c * tanh
