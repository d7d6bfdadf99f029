"""The motion of an arm that remains after its arrival."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_bends, tip_position
from flex_planner.base.validation import Array
from flex_planner.control.extent import peak_to_peak
import numpy as np

MIN_SETTLING, MAX_SETTLING = 1e-3, 1000.0  # [s], that an arm may be watched after its arrival


def bending_peak_to_peak(arm: Arm, coordinates: Array) -> float:
    """Return the largest change of any link's deflection over coordinates (k, n_t) [m]."""
    return max((peak_to_peak(np.moveaxis(link_bends(arm, i, coordinates[:, part].T), -1, 0))
                for i, part in enumerate(arm.modal_slices) if arm.links[i].modes), default=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualVibration:
    """
    The motion that remains after an arrival.

    Attributes
    ----------
    tip : float
        Peak-to-peak motion of the tip [m].
    bending : float
        Peak-to-peak deflection of the links where it is largest [m].

    """

    tip: float
    bending: float

    @classmethod
    def of(cls, arm: Arm, coordinates: Array) -> ResidualVibration:
        """Return it for coordinates (k, n_t) over a time after the arrival."""
        return cls(tip=peak_to_peak(tip_position(arm, coordinates)),
                   bending=bending_peak_to_peak(arm, coordinates))


class ArrivalWatch:
    """
    Collects the states of an arm for a time after it should have arrived.

    Parameters
    ----------
    arm : Arm
        n_t coordinates.
    window : float
        > 0 [s].

    """

    def __init__(self, arm: Arm, window: float) -> None:
        self._arm, self._window, self._arrival = arm, window, np.inf
        self._seen: list[Array] = []

    def expect(self, arrival: float) -> None:
        """Begin anew: the arm is to arrive at a time [s]."""
        self._arrival, self._seen = arrival, []

    def see(self, time: float, state: Array) -> None:
        """Take note of a state (2 n_t,), if it is one that matters."""
        if self._arrival <= time + 1e-9 <= self._arrival + self._window + 2e-9:
            self._seen.append(state[:self._arm.n_coordinates])

    def result(self, time: float) -> ResidualVibration | None:
        """Return the residual vibration, once per arrival, when the window is over."""
        if time < self._arrival + self._window or not self._seen:
            return None
        residual = ResidualVibration.of(self._arm, np.stack(self._seen))
        self.expect(np.inf)
        return residual
