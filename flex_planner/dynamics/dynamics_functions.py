"""The equations of motion of an arm as CasADi functions, eqs. (3) and (5), and their steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.chain import Chain

BatchedFunction = tuple[Any, int]
"""A CasADi function, and how many of its leading inputs differ from point to point."""


def build_dynamics_functions(arm: Arm) -> dict[str, BatchedFunction]:
    """
    Derive the functions that moving an arm by given torques takes.

    Every function takes `PhysicalParameters.physical` last.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.

    Returns
    -------
    dict of str to (casadi.Function, int)
        The int counts the leading inputs that differ from point to point.

        - ``forward_dynamics`` (x, u) -> x', eq. (5)
        - ``runge_kutta_step`` (x, torques at the stages, step) -> next x and the two error
          estimates of the Dormand-Prince method of order 8
        - ``inverse_dynamics`` (x, a) -> generalized forces, eq. (3)
        - ``mass_and_energy`` x -> M, kinetic energy, potential energy
        - ``static_forces`` q -> dV/dq, d2V/dq2 with V the potential energy

    """
    chain = build_chain(arm)
    q, rates = chain.coordinates, chain.rates
    x, p = ca.vertcat(q, rates), physical_symbols(chain)
    a, rate = ca.SX.sym('a', arm.n_coordinates), forward_dynamics(arm, chain)
    return {
        'forward_dynamics': rate,
        'runge_kutta_step': _runge_kutta_step(rate[0]),
        'inverse_dynamics': batch('inverse_dynamics', [x, a], p, [chain.inverse_dynamics(a)]),
        'mass_and_energy': batch('mass_and_energy', [x], p,
                                 [chain.mass_matrix(), chain.kinetic, chain.potential]),
        'static_forces': batch('static_forces', [q], p, [
            ca.gradient(chain.potential, q), ca.hessian(chain.potential, q)[0]]),
    }


def forward_dynamics(arm: Arm, chain: Chain) -> BatchedFunction:
    """Return x' = rate(x, u, p), eq. (5)."""
    u, rates = ca.SX.sym('u', arm.n_joints), chain.rates
    forces = ca.vertcat(u, ca.SX(arm.n_passive, 1))
    acceleration = solver_of(chain.mass_matrix())(forces - chain.bias())
    return batch('forward_dynamics', [ca.vertcat(chain.coordinates, rates), u],
                 physical_symbols(chain), [ca.vertcat(rates, acceleration)])


def physical_symbols(chain: Chain) -> Any:
    """Return the free parameters of a chain in the order of `PhysicalParameters.physical`."""
    return ca.vertcat(chain.payload_mass, chain.payload_inertia, chain.rigidity,
                      chain.coulomb_friction, chain.coulomb_speed)


def batch(name: str, inputs: Sequence[Any], p: Any, results: Sequence[Any]) -> BatchedFunction:
    """Return a function of points and shared parameters p with dense results."""
    dense = ca.cse([ca.densify(result) for result in results])
    return ca.Function(name, [*inputs, p], dense), len(inputs)


def solver_of(matrix: Any) -> Callable[[Any], Any]:
    """Return the solver of a symmetric positive definite matrix, by unrolled LDL^T."""
    D, LT, order = ca.ldl(matrix, False)
    return lambda rhs: ca.ldl_solve(rhs, D, LT, order)


def _runge_kutta_step(rate: Any) -> BatchedFunction:
    """Return one step of DOP853, with SciPy's coefficients, of x' = rate(x, u, p)."""
    from scipy.integrate import DOP853

    x, u = ca.MX.sym('x', rate.size1_in(0)), ca.MX.sym('u', rate.size1_in(1), DOP853.n_stages)
    step, p = ca.MX.sym('h'), ca.MX.sym('p', rate.size1_in(2))
    stages = ca.horzsplit(u)
    results = take_step(rate, x, [*stages, stages[-1]], step, p)
    return ca.Function('runge_kutta_step', [x, ca.vec(u), step, p], results), 3


def take_step(rate: Any, x: Any, torques: Sequence[Any], step: Any, p: Any) -> list[Any]:
    """Return x after a step with torques at its stages and its end, and two error estimates."""
    from scipy.integrate import DOP853

    slopes: list[Any] = []
    for i in range(DOP853.n_stages):
        slopes.append(rate(x + step * _combine(DOP853.A[i, :i], slopes), torques[i], p))
    following = x + step * _combine(DOP853.B, slopes)
    # the last stage of the error estimate is at the end of the step, as stage 12 is
    slopes.append(rate(following, torques[-1], p))
    return [following, *(step * _combine(row, slopes) for row in (DOP853.E5, DOP853.E3))]


def _combine(weights: Any, vectors: list[Any]) -> Any:
    """Return the sum of weighted vectors; 0 for none."""
    return sum((float(w) * v for w, v in zip(weights, vectors, strict=True) if w), 0)
