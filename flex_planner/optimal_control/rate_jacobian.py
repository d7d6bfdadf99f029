"""
The Jacobian of Pontryagin's conditions by its structure, as CasADi expressions.

``z' = J grad H*`` is Hamiltonian, so three of the blocks of dz'/dz are enough. They follow from
second derivatives of ``S = L + psi_1^T q' - W`` at fixed a, y and u, and from the inverse of the
mass matrix: with u between its bounds ``du = -R^-1 dy``, on a bound it falls by K_2 dq'. Rows and
columns belong to (q, q', psi_1, psi_2).

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
from flex_planner.dynamics.chain import Chain
from flex_planner.optimal_control.torque_limits import TorqueSensitivity


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RateJacobian:
    """
    What dz'/dz is made of: expressions of z and the parameters, (n_t, n_t) each.

    Attributes
    ----------
    qq, vq, vv : casadi.SX
        Second derivatives of S by q and q'.
    force_q, force_v : casadi.SX
        Derivatives of ``M a + h`` by q and q'.
    momentum_q : casadi.SX
        Derivative of ``M y`` by q.
    inverse : casadi.SX
        M^-1.
    torque : TorqueSensitivity
        Of the motors.

    """

    qq: Any
    vq: Any
    vv: Any
    force_q: Any
    force_v: Any
    momentum_q: Any
    inverse: Any
    torque: TorqueSensitivity

    @classmethod
    def of(cls, chain: Chain, gradient: Any, at_point: Callable[..., list[Any]],
           solve: Callable[[Any], Any], torque: TorqueSensitivity) -> RateJacobian:
        """
        Derive it.

        Parameters
        ----------
        chain : Chain
            Of the arm.
        gradient : casadi.SX, shape (2 n_t, 1)
            Of S by (q, q').
        at_point : callable
            Puts u, a and y into expressions.
        solve : callable
            Solves the mass matrix.
        torque : TorqueSensitivity
            Of the motors.

        """
        q, rates, n_t = chain.coordinates, chain.rates, chain.coordinates.numel()
        force = ca.gradient(chain.power, chain.virtual_rates)
        momentum = ca.gradient(chain.power, chain.accelerations)
        qq, vq, vv, force_q, force_v, momentum_q = at_point(
            ca.jacobian(gradient[:n_t], q), ca.jacobian(gradient[n_t:], q),
            ca.jacobian(gradient[n_t:], rates), ca.jacobian(force, q),
            ca.jacobian(force, rates), ca.jacobian(momentum, q))
        return cls(qq=_symmetric(qq), vq=vq, vv=_symmetric(vv), force_q=force_q,
                   force_v=force_v, momentum_q=momentum_q,
                   inverse=_symmetric(solve(ca.SX.eye(n_t))), torque=torque)

    @property
    def motors(self) -> Any:
        """Return M^-1 B, how torques accelerate the arm, shape (n_t, n)."""
        return self.inverse[:, :self.torque.inside.numel()]

    @property
    def virtual_by_position(self) -> Any:
        """Return the derivative of y by q at fixed psi_2, shape (n_t, n_t)."""
        return -self.inverse @ self.momentum_q

    def assemble(self) -> Any:
        """Return dz'/dz, shape (4 n_t, 4 n_t)."""
        n_t, torque, motors = self.inverse.size1(), self.torque, self.motors
        a_q, y_q = -self.inverse @ self.force_q, self.virtual_by_position
        turned = self.momentum_q.T @ a_q
        pushed = y_q[:torque.inside.numel(), :]  # of the joints
        free = ca.diag(torque.by_costate)
        a_psi = -_symmetric(motors @ free @ motors.T)
        psi_1_q = -self.qq + _symmetric(turned + turned.T + pushed.T @ free @ pushed)
        psi_2_q = -self.vq + self.force_v.T @ y_q + self._of_motors(
            ca.diag(torque.by_speed) @ pushed)
        psi_2_v = -self.vv - self._of_motors(self._of_motors(ca.diag(torque.of_costate)).T)
        a_q -= motors @ free @ pushed
        a_v = -self.inverse @ self.force_v - self._of_motors(
            (motors @ ca.diag(torque.by_speed)).T).T
        one, none = ca.SX.eye(n_t), ca.SX(n_t, n_t)
        return ca.blockcat([[none, one, none, none],
                            [a_q, a_v, none, a_psi],
                            [psi_1_q, psi_2_q.T, none, -a_q.T],
                            [psi_2_q, psi_2_v, -one, -a_v.T]])

    def _of_motors(self, rows: Any) -> Any:
        """Return rows of the joints with empty ones for the modes."""
        empty = self.inverse.size1() - rows.size1()
        return ca.vertcat(rows, ca.SX(empty, rows.size2()))


def _symmetric(matrix: Any) -> Any:
    """Return a matrix that is known to be symmetric, from its upper half."""
    return ca.triu2symm(ca.triu(matrix))
