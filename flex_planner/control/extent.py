"""The extent of points in the plane."""

from __future__ import annotations

from flex_planner.base.validation import Array
import numpy as np

_DIRECTIONS = 180


def peak_to_peak(points: Array) -> float:
    """
    Return the largest extent of points (k, 2) in any direction [m].

    Directions are a degree apart, which understates it by less than 1 in 25000.

    """
    angles = np.linspace(0, np.pi, _DIRECTIONS, endpoint=False, dtype=np.float64)
    directions = np.stack([np.cos(angles), np.sin(angles)])
    return float(np.ptp(points @ directions, axis=0).max())
