"""
The torque that minimises the Hamiltonian within the motors' limits: eqs. (13) to (15).

Korayem et al. 2009. Each formula stands here once, for NumPy arrays as for CasADi's symbols.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.dynamics.torque_bounds import clip, line_bounds, torque_bounds
import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class TorqueLimits:
    """
    Limits of D.C. motors: a line that falls with the speed, and a cap, see `torque_bounds`.

    Parameters
    ----------
    stall : numpy.ndarray or casadi.SX, shape (n,)
        K_1, torque of the line at standstill [N m].
    slope : numpy.ndarray or casadi.SX, shape (n,)
        K_2, torque lost per speed [N m s/rad].
    cap : numpy.ndarray or casadi.SX, shape (n,)
        Largest torque in either direction [N m]; infinite for none, which is eq. (15). No symbol
        where no motor has any: what is not derived takes no time.

    """

    stall: Any
    slope: Any
    cap: Any = None

    @classmethod
    def of(cls, arm: Arm) -> TorqueLimits:
        """Return the limits of an arm's motors; a line that does not fall is a cap."""
        motors = [joint.motor for joint in arm.joints]
        falls = [motor.torque_slope > 0 for motor in motors]
        return cls(
            np.array([motor.stall_torque if line else motor.standstill_torque
                      for motor, line in zip(motors, falls, strict=True)]),
            np.array([motor.torque_slope for motor in motors]),
            np.array([motor.torque_cap if line else np.inf
                      for motor, line in zip(motors, falls, strict=True)]))

    def column(self) -> TorqueLimits:
        """Return the limits for torques and speeds (n, k), one joint in each row."""
        return TorqueLimits(self.stall[:, None], self.slope[:, None], self.cap[:, None])

    @property
    def standstill(self) -> Any:
        """Return the largest torque at standstill, shape (n,) [N m]."""
        return np.minimum(self.stall, self.cap)

    @property
    def capped(self) -> Any:
        """Return which motors have a cap besides a line, shape (n,)."""
        return np.isfinite(self.cap)

    def lines(self, speeds: Any) -> tuple[Any, Any]:
        """Return the bounds of eq. (15) at joint speeds (..., n) [N m]."""
        return line_bounds(self.stall, self.slope, speeds)

    def bounds(self, speeds: Any) -> tuple[Any, Any]:
        """Return the lower and the upper bound at joint speeds (..., n) [N m]."""
        return torque_bounds(self.stall, self.slope, self.cap, speeds)

    def bound(self, free: Any, speeds: Any) -> Any:
        """Return the torque of eq. (14): that of eq. (13), within the bounds [N m]."""
        return clip(free, *self.bounds(speeds))

    def toward(self, torque: Any, speeds: Any) -> Any:
        """Return the size of the bound in the direction of each torque (k, n) [N m]."""
        lower, upper = self.bounds(speeds)
        return np.where(torque >= 0, upper, -lower)

    def distances(self, free: Array, speeds: Array) -> tuple[Array, ...]:
        """
        Return functions of torques without bounds (k, n) whose signs say which limit holds [N m].

        First of the lines, upper and lower, (k, n) each; then of the caps of motors that have
        one. A motor reaches or leaves a limit where one of them changes its sign.

        """
        lowest, highest = self.lines(speeds)
        some = self.capped
        if not some.any():
            return free - highest, free - lowest
        within, cap = clip(free, -self.cap, self.cap), self.cap[some]
        # a cap holds only between the lines
        return (within - highest, within - lowest,
                np.minimum(np.minimum(free, highest)[:, some] - cap, cap - lowest[:, some]),
                np.maximum(np.maximum(free, lowest)[:, some] + cap, -cap - highest[:, some]))

    def margins(self, torque: Any, speeds: Any) -> list[Any]:
        """Return how far torques are from each limit, (..., n) each: lines first, then caps."""
        lowest, highest = self.lines(speeds)
        lines = [highest - torque, torque - lowest]
        return lines if self.cap is None else [*lines, self.cap - torque, torque + self.cap]

    def multiplier(self, weights: Any, free: Any, speeds: Any) -> Any:
        """
        Return what a bound that moves with the speed adds to the rate of its costate.

        -(du_bound/dq')^T dH/du, which eq. (12) of the paper leaves out: dH/du = R (u - u_free)
        vanishes unless the torque sits on its bound.

        """
        return self._active_slope(free, speeds) * weights * (self.bound(free, speeds) - free)

    def sensitivity(self, weights: Any, free: Any, speeds: Any) -> TorqueSensitivity:
        """Return how the bounded torque changes, of symbols; see `bound`."""
        import casadi as ca

        lower, upper = self.bounds(speeds)
        inside = ca.if_else(ca.logic_and(free > lower, free < upper), 1, 0)
        slope = self._active_slope(free, speeds)
        lost = (1 - inside) * slope
        return TorqueSensitivity(inside=inside, by_costate=inside / weights, by_speed=lost,
                                 of_costate=lost * slope * weights)

    def _active_slope(self, free: Any, speeds: Any) -> Any:
        """Return K_2 where the nearer bound is on the line, 0 where it is a cap."""
        if self.cap is None:
            return self.slope
        (lowest, highest), (_, upper) = self.lines(speeds), self.bounds(speeds)
        if isinstance(upper, np.ndarray):
            nearer = np.where(free > upper, self.cap, -self.cap)
            return np.where((lowest < nearer) & (nearer < highest), 0.0, self.slope)
        import casadi as ca

        cap = ca.SX(self.cap)
        bound = ca.if_else(free > upper, cap, -cap)
        return ca.if_else(ca.logic_and(lowest < bound, bound < highest), 0, self.slope)


def has_caps(arm: Arm) -> bool:
    """Return whether a motor of an arm has a cap besides its line."""
    return bool(TorqueLimits.of(arm).capped.any())


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
        -du/dq', K_2 on the line and 0 on a cap.
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
