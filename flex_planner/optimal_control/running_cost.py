"""The running cost L of eq. (7), written once; its derivatives follow by differentiation."""

from __future__ import annotations

from typing import Any

import casadi as ca
from flex_planner.optimal_control.parameters import ParameterSymbols


def running_cost(parameters: ParameterSymbols, q: Any, rates: Any, torque: Any) -> Any:
    """
    Return L of eq. (7): weighted squares of positions, velocities and torques.

    Parameters
    ----------
    parameters : ParameterSymbols
        W_1, W_2 and R.
    q, rates : casadi.SX, shape (n_t, 1)
        Coordinates and their rates.
    torque : casadi.SX, shape (n, 1)
        u [N m].

    """
    W_1, W_2 = parameters['position_weights'], parameters['velocity_weights']
    R = parameters['effort_weights']
    return (ca.dot(W_1, q**2) + ca.dot(W_2, rates**2) + ca.dot(R, torque**2)) / 2
