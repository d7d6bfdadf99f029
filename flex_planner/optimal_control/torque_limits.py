"""
The torque that minimises the Hamiltonian within the motors' limits: eqs. (13) to (15).

Korayem et al. 2009. Each formula stands here once, for NumPy arrays as for CasADi's symbols.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flex_planner.arms.arm import Arm
import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class TorqueLimits:
    """
    Limits of D.C. motors that fall with the speed.

    Parameters
    ----------
    stall : numpy.ndarray or casadi.SX, shape (n,)
        K_1, torque at standstill [N m].
    slope : numpy.ndarray or casadi.SX, shape (n,)
        K_2, torque lost per speed [N m s/rad].

    """

    stall: Any
    slope: Any

    @classmethod
    def of(cls, arm: Arm) -> TorqueLimits:
        """Return the limits of an arm's motors."""
        motors = [joint.motor for joint in arm.joints]
        return cls(np.array([motor.stall_torque for motor in motors]),
                   np.array([motor.torque_slope for motor in motors]))

    def bounds(self, speeds: Any) -> tuple[Any, Any]:
        """Return the lower and the upper bound at joint speeds (..., n), eq. (15) [N m]."""
        lost = self.slope * speeds
        return -self.stall - lost, self.stall - lost

    def bound(self, free: Any, speeds: Any) -> Any:
        """Return the torque of eq. (14): that of eq. (13), within the bounds [N m]."""
        lower, upper = self.bounds(speeds)
        if isinstance(free, np.ndarray):
            return np.minimum(np.maximum(free, lower), upper)
        import casadi as ca

        return ca.fmin(ca.fmax(free, lower), upper)

    def toward(self, torque: Any, speeds: Any) -> Any:
        """Return the size of the bound in the direction of each torque (k, n) [N m]."""
        lower, upper = self.bounds(speeds)
        return np.where(torque >= 0, upper, -lower)

    def distances(self, free: Any, speeds: Any) -> tuple[Any, Any]:
        """
        Return how far torques without bounds (k, n) are above the upper and the lower bound.

        A motor reaches or leaves its limit where one of them changes its sign [N m].

        """
        lower, upper = self.bounds(speeds)
        return free - upper, free - lower

    def multiplier(self, weights: Any, free: Any, torque: Any) -> Any:
        """
        Return what a bound that moves with the speed adds to the rate of its costate.

        -(du_bound/dq')^T dH/du, which eq. (12) of the paper leaves out: dH/du = R (u - u_free)
        vanishes unless the torque sits on its bound.

        """
        return self.slope * weights * (torque - free)

    def sensitivity(self, weights: Any, free: Any, speeds: Any) -> TorqueSensitivity:
        """Return how the bounded torque changes, of symbols; see `bound`."""
        import casadi as ca

        lower, upper = self.bounds(speeds)
        inside = ca.if_else(ca.logic_and(free > lower, free < upper), 1, 0)
        lost = (1 - inside) * self.slope
        return TorqueSensitivity(inside=inside, by_costate=inside / weights, by_speed=lost,
                                 of_costate=lost * self.slope * weights)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueSensitivity:
    """
    How the torque of eq. (14) and its share in eq. (12) change, as CasADi symbols of shape (n, 1).

    Attributes
    ----------
    inside : casadi.SX
        1 for a motor between its bounds, else 0.
    by_costate : casadi.SX
        -du/dy, 1/R between the bounds.
    by_speed : casadi.SX
        -du/dq', K_2 on a bound.
    of_costate : casadi.SX
        What the multiplier of a bound falls by with the speed.

    """

    inside: Any
    by_costate: Any
    by_speed: Any
    of_costate: Any


def free_torque(weights: Any, y: Any) -> Any:
    """
    Return the torque without bounds, eq. (13): dL/du + B^T y = 0 [N m].

    Parameters
    ----------
    weights : numpy.ndarray or casadi.SX, shape (n,)
        Diagonal of R.
    y : numpy.ndarray or casadi.SX, shape (n,)
        B^T M^-1 psi_2.

    """
    return -y / weights
