"""
The optimality conditions as one would first write them: SymPy, quadrature inside, lambdify.

A second derivation of the model, which the tests use too: velocities come from differentiating
positions, the integrals over a link from Gauss points, the costate equations from derivatives of
M and h.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from flex_planner import Arm
from flex_planner.base.validation import Array
from flex_planner.optimal_control.parameters import Parameters
import numpy as np
import sympy

_QUADRATURE_POINTS = 8


def _energies(arm: Arm, q: Sequence[Any], dq: Sequence[Any], payload: float) -> tuple[Any, Any]:
    """Return kinetic and potential energy of an arm with a payload but without nodes."""
    points, weights = np.polynomial.legendre.leggauss(_QUADRATURE_POINTS)
    base, angle = sympy.Matrix([0, 0]), sympy.Integer(0)
    kinetic, potential = sympy.Integer(0), sympy.Integer(0)
    gravity = sympy.Matrix(arm.gravity.tolist())

    def energy(mass: float, position: Any) -> None:
        nonlocal kinetic, potential
        velocity = position.jacobian(sympy.Matrix(q)) * sympy.Matrix(dq)
        kinetic += mass * (velocity.T * velocity)[0] / 2
        potential -= mass * (gravity.T * position)[0]

    for i, (link, part) in enumerate(zip(arm.links, arm.modal_slices, strict=True)):
        modes, bend = link.mode_shapes(), sympy.Matrix(q[part])
        angle += q[i]
        along = sympy.Matrix([sympy.cos(angle), sympy.sin(angle)])
        across = sympy.Matrix([-sympy.sin(angle), sympy.cos(angle)])

        def place(x: float, shape: Array, bend: Any = bend, along: Any = along,
                  across: Any = across, base: Any = base) -> Any:
            deflection = sum((float(s) * b for s, b in zip(shape, bend, strict=True)),
                             sympy.Integer(0))
            return base + x * along + deflection * across

        stations = (points + 1) / 2 * link.length
        for x, w, shape in zip(stations, weights, modes.shape(stations), strict=True):
            energy(float(w) * link.mass / 2, place(float(x), shape))
        if link.modes:
            stiffness = sympy.Matrix((link.flexural_rigidity * modes.stiffness).tolist())
            potential += (bend.T * stiffness * bend)[0] / 2
        base = place(link.length, modes.tip_deflection)
        angle += sum((float(s) * b for s, b in zip(modes.tip_slope, bend, strict=True)),
                     sympy.Integer(0))
    energy(payload, base)
    return kinetic, potential


def brute_force_rate(arm: Arm, payload: float = 1.0) -> Callable[[Sequence[Array]], Array]:
    """
    Return z' as a function of the columns of z, for R = 1 and no other weights.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates, no nodes, friction or damping.
    payload : float
        At the tip [kg].

    """
    n, n_t = arm.n_joints, arm.n_coordinates
    q, dq = sympy.symbols(f'q:{n_t}'), sympy.symbols(f'v:{n_t}')
    kinetic, potential = _energies(arm, q, dq, payload)
    x = [*q, *dq]
    momentum = sympy.Matrix([sympy.diff(kinetic, v) for v in dq])
    mass = momentum.jacobian(sympy.Matrix(dq))
    forces = sympy.Matrix([sympy.diff(kinetic - potential, c) for c in q])
    bias = momentum.jacobian(sympy.Matrix(q)) * sympy.Matrix(dq) - forces
    slopes = [[sympy.diff(entry, c) for entry in mass] for c in q]
    parts = [list(mass), list(bias), sum(slopes, []), list(bias.jacobian(sympy.Matrix(x)))]
    evaluate = sympy.lambdify(x, parts, 'numpy', cse=True)
    bounds = Parameters.of(arm)

    def rate(columns: Sequence[Array]) -> Array:
        z = np.stack(columns, axis=1)
        count = len(z)
        M, h, dM, dh = (np.stack([np.broadcast_to(entry, count) for entry in part], axis=1)
                        for part in evaluate(*columns[:2 * n_t]))
        M = M.reshape(count, n_t, n_t)
        dM, dh = dM.reshape(count, n_t, n_t, n_t), dh.reshape(count, n_t, 2 * n_t)
        psi_1, psi_2 = z[:, 2 * n_t:3 * n_t], z[:, 3 * n_t:]
        y = np.linalg.solve(M, psi_2[..., None])[..., 0]
        free, speeds = -y[:, :n], z[:, n_t:n_t + n]
        limit = bounds.torque_slope * speeds
        u = np.clip(free, -bounds.stall_torque - limit, bounds.stall_torque - limit)
        force = np.concatenate([u, np.zeros((count, n_t - n))], axis=1) - h
        a = np.linalg.solve(M, force[..., None])[..., 0]
        work = np.einsum('ki,kij->kj', y, dh)
        work[:, :n_t] += np.einsum('ki,kcij,kj->kc', y, dM, a)
        psi_2_rate = work[:, n_t:] - psi_1
        psi_2_rate[:, :n] += bounds.torque_slope * (u - free)
        return np.concatenate([z[:, n_t:2 * n_t], a, work[:, :n_t], psi_2_rate], axis=1)

    return rate
