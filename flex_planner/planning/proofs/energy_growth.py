"""How fast energy can enter an arm or leave it, and how far the arm comes meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
import numpy as np

# below it, the arc tangent of its root loses digits to the root itself
_SMALL = 1e-4
# where energies are looked for, and into which parts the ratio of two of them is divided
_DECADES: Array = np.geomspace(1e-30, 1e30, 61, dtype=np.float64)
_STEPS: Array = np.linspace(0.0, 1.0, 129, dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class EnergyGrowth:
    """
    A bound of the rate at which an energy grows, piecewise linear.

    ``E' <= slope E + offset`` on each piece, so that time and way are integrals in closed form.

    Parameters
    ----------
    edges : numpy.ndarray, shape (k + 1,)
        Energies between which a piece holds, from 0 to infinity [J].
    slopes, offsets : numpy.ndarray, shape (k,)
        >= 0 [1/s], > 0 [W]; without pieces there is no bound, and no time is needed.

    """

    edges: Array
    slopes: Array
    offsets: Array

    @classmethod
    def below(cls, slopes: Array, offsets: Array) -> EnergyGrowth:
        """Return what lies below all lines with these slopes and offsets, some infinite."""
        given = np.flatnonzero(np.isfinite(offsets))
        # least slopes last; of parallel lines, the lower one first
        order = given[np.lexsort((offsets[given], -slopes[given]))]
        kept: list[int] = []
        starts: list[float] = []
        for line in order:
            start = 0.0
            while kept:
                fall = slopes[kept[-1]] - slopes[line]
                rise = offsets[line] - offsets[kept[-1]]
                start = np.inf if fall <= 0 else max(rise / fall, 0.0)
                if start > starts[-1]:
                    break
                kept.pop()
                starts.pop()
                start = 0.0
            if start < np.inf:
                kept.append(int(line))
                starts.append(start)
        return cls(np.array([*starts, np.inf]), slopes[kept], offsets[kept])

    def until(self, energy: float, beyond: EnergyGrowth) -> EnergyGrowth:
        """Return this bound below an energy [J], and another one beyond it."""
        pieces = int(np.searchsorted(self.edges[:-1], energy))
        after = max(int(np.searchsorted(beyond.edges, energy, side='right')) - 1, 0)
        return EnergyGrowth(
            np.concatenate([self.edges[:pieces], [energy], beyond.edges[after + 1:]]),
            np.concatenate([self.slopes[:pieces], beyond.slopes[after:]]),
            np.concatenate([self.offsets[:pieces], beyond.offsets[after:]]))

    def time(self, energies: Array, begin: float) -> Array:
        """Return the time that growth from `begin` to energies (m,) takes at least [s]."""
        low, high = self._spans(energies, begin)
        entered = self.slopes * low + self.offsets
        steep = np.where(self.slopes > 0, self.slopes, 1.0)
        grown = np.where(self.slopes > 0, np.log1p(steep * (high - low) / entered) / steep,
                         (high - low) / entered)
        total: Array = grown.sum(-1)
        return total

    def travel(self, energies: Array, begin: float) -> Array:
        """Return the integral of sqrt(E) over that time, shape (m,) [J^(1/2) s]."""
        count = self.slopes.size
        if not count:
            return np.zeros(energies.size)
        begins = np.maximum(self.edges[:-1], begin)
        ends = np.maximum(self.edges[1:-1], begins[:-1])  # the last piece has none
        reached = np.searchsorted(self.edges[1:-1], energies, side='right')
        pieces = np.arange(count)
        integrals = self._primitive(
            np.concatenate([begins, ends, np.maximum(energies, begins[reached])]),
            np.concatenate([pieces, pieces[:-1], reached]))
        before, whole, within = np.split(integrals, [count, 2 * count - 1])
        passed = np.concatenate([[0.0], np.cumsum(whole - before[:-1])])
        total: Array = passed[reached] + within - before[reached]
        return total

    def _spans(self, energies: Array, begin: float) -> tuple[Array, Array]:
        """Return the part of each piece that is passed, shapes (m, k)."""
        low = np.maximum(self.edges[:-1], begin)
        high = np.clip(energies[:, None], low, np.maximum(self.edges[1:], low))
        return np.broadcast_to(low, high.shape), high

    def _primitive(self, energies: Array, pieces: Array) -> Array:
        """Return the integrals of sqrt(E) / (slope E + offset) from 0, each on its piece."""
        offsets = self.offsets[pieces]
        ratio = self.slopes[pieces] * energies / offsets
        safe = np.where(ratio > _SMALL, ratio, 1.0)
        root = np.sqrt(safe)
        factor = np.where(ratio > _SMALL, 3 * (root - np.arctan(root)) / (safe * root),
                          1 - 3 * ratio / 5 + 3 * ratio**2 / 7)
        integral: Array = 2 / 3 * energies * np.sqrt(energies) / offsets * factor
        return integral


@dataclass(frozen=True, slots=True, eq=False)
class EnergyLimits:
    """
    The energy of motions between two ends: what can have come in, and can still go out.

    Parameters
    ----------
    driving, braking : EnergyGrowth
        From the start on, and from the goal backwards.
    start, goal : float
        Energy that it has there at most [J].

    """

    driving: EnergyGrowth
    braking: EnergyGrowth
    start: float
    goal: float

    def least_time(self, travel: float) -> float:
        """Return the least time in which the integral of sqrt(E) can reach a value [s]."""
        low, high = self._enclose(travel)
        for _ in range(3):
            peaks: Array = low * (high / low)**_STEPS
            within = self._travel(peaks) <= travel
            last = int(within.argmin()) - 1 if not within.all() else within.size - 1
            low, high = peaks[max(last, 0)], peaks[min(last + 1, within.size - 1)]
        return float(self._time(np.array([low]))[0]) if last >= 0 else 0.0

    def change_time(self, higher: float) -> float:
        """Return the least time between the lower end and an energy of the higher end [s]."""
        return float(self._time(np.array([higher]))[0])

    def _enclose(self, travel: float) -> tuple[float, float]:
        """Return energies of which the first is too small for that, and the second too large."""
        peaks = _DECADES * max(self.start, self.goal, 1.0)
        short = self._travel(peaks) <= travel
        count = int(np.count_nonzero(short))  # it grows with the peak
        return float(peaks[max(count - 1, 0)]), float(peaks[min(count, peaks.size - 1)])

    def _time(self, peaks: Array) -> Array:
        """Return the duration of the motion whose energy rises to a peak and falls, (m,)."""
        return self.driving.time(peaks, self.start) + self.braking.time(peaks, self.goal)

    def _travel(self, peaks: Array) -> Array:
        """Return the integral of sqrt(E) over that motion, (m,)."""
        return self.driving.travel(peaks, self.start) + self.braking.travel(peaks, self.goal)
