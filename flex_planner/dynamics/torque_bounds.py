"""
The bounds of a motor's torque at a speed, for NumPy arrays as for CasADi's symbols.

A line that falls with the speed, eq. (15) of Korayem et al. 2009, and a cap in both directions.
Beyond the speed at which even braking takes more than the cap, the line holds: a motor that is
driven so fast cannot do with less.

"""

from __future__ import annotations

from typing import Any

import numpy as np


def line_bounds(stall: Any, slope: Any, speeds: Any) -> tuple[Any, Any]:
    """Return the lowest and the highest torque of eq. (15) [N m]."""
    lost = slope * speeds
    return -stall - lost, stall - lost


def torque_bounds(stall: Any, slope: Any, cap: Any, speeds: Any) -> tuple[Any, Any]:
    """Return the lower and the upper bound of line and cap [N m]; a cap of None is none."""
    lowest, highest = line_bounds(stall, slope, speeds)
    if cap is None:
        return lowest, highest
    return clip(-cap, lowest, highest), clip(cap, lowest, highest)


def clip(value: Any, lower: Any, upper: Any) -> Any:
    """Return the nearest value between two."""
    if isinstance(lower, np.ndarray):
        return np.minimum(np.maximum(value, lower), upper)
    import casadi as ca

    return ca.fmin(ca.fmax(value, lower), upper)
