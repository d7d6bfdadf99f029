"""The equations of motion of an arm as CasADi functions, eqs. (3) and (5), and their steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.chain import Chain
from flex_planner.dynamics.torque_bounds import clip, torque_bounds

BatchedFunction = tuple[Any, int]
"""A CasADi function, and how many of its leading inputs differ from point to point."""


def build_dynamics_functions(arm: Arm) -> dict[str, BatchedFunction]:
    """
    Derive the functions that simulating an arm takes.

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
        - ``controlled_step`` ((x, feedback), reference, (step, sampled), controller) -> the same
          of a step under a joint controller, see `_controlled_step`
        - ``feedback_step`` ((x, xi, u), reference, (step, sampled), law, motors) -> the same of a
          step under a linear law that has a state of its own, see `_feedback_step`
        - ``inverse_dynamics`` (x, a) -> generalized forces, eq. (3)
        - ``mass_and_energy`` x -> M, kinetic energy, potential energy
        - ``static_forces`` q -> dV/dq, d2V/dq2 with V the potential energy

    """
    chain = build_chain(arm)
    q, rates = chain.coordinates, chain.rates
    x, p = ca.vertcat(q, rates), physical_symbols(chain)
    u, a = ca.SX.sym('u', arm.n_joints), ca.SX.sym('a', arm.n_coordinates)
    M = chain.mass_matrix()
    forces = ca.vertcat(u, ca.SX(arm.n_passive, 1))
    acceleration = solver_of(M)(forces - chain.bias())
    rate = batch('forward_dynamics', [x, u], p, [ca.vertcat(rates, acceleration)])
    return {
        'forward_dynamics': rate,
        'runge_kutta_step': _runge_kutta_step(rate[0]),
        'controlled_step': _controlled_step(rate[0], arm.n_joints),
        'feedback_step': _feedback_step(rate[0], arm.n_joints),
        'inverse_dynamics': batch('inverse_dynamics', [x, a], p, [chain.inverse_dynamics(a)]),
        'mass_and_energy': batch('mass_and_energy', [x], p,
                                 [M, chain.kinetic, chain.potential]),
        'static_forces': batch('static_forces', [q], p, [
            ca.gradient(chain.potential, q), ca.hessian(chain.potential, q)[0]]),
    }


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
    results = _advance(rate, x, [*stages, stages[-1]], step, p)
    return ca.Function('runge_kutta_step', [x, ca.vec(u), step, p], results), 3


def _controlled_step(rate: Any, n: int) -> BatchedFunction:
    """
    Return a step of DOP853 under feedforward efforts and a PD that is sampled and held.

    Inputs: x with the n torques of the PD; angles, speeds, and efforts at both ends of the step;
    its length, and 1 where the PD is sampled at its beginning, else 0; gains, stall torques, what
    a motor loses of them by its speed, and its largest torque. Outputs: x with the PD's torques,
    two error estimates.

    """
    from scipy.integrate import DOP853

    size = rate.size1_in(0)
    state, p = ca.MX.sym('s', size + n), ca.MX.sym('p', rate.size1_in(2))
    reference, timing, controller = (ca.MX.sym(name, count) for name, count in (
        ('r', 4 * n), ('t', 2), ('c', 5 * n)))
    x, held = state[:size], state[size:]
    angles, speeds, first, last = ca.vertsplit(reference, n)
    stiffness, damping, stall, loss, cap = ca.vertsplit(controller, n)
    sampled = stiffness * (angles - x[:n]) + damping * (speeds - x[size // 2:size // 2 + n])
    held += timing[1] * (sampled - held)

    def limited(at: Any, torque: Any, physical: Any) -> Any:
        speeds = at[size // 2:size // 2 + n]
        return rate(at, clip(torque, *torque_bounds(stall, loss, cap, speeds)), physical)

    stages = [first + float(share) * (last - first) + held
              for share in DOP853.C[:DOP853.n_stages]]
    after, fifth, third = _advance(limited, x, [*stages, last + held], timing[0], p)
    return ca.Function('controlled_step', [state, reference, timing, controller, p], [
        ca.vertcat(after, held), fifth, third]), 3


def _feedback_step(rate: Any, n: int) -> BatchedFunction:
    """
    Return a step of DOP853 under efforts and a linear law, sampled and held within motor limits.

    Inputs: x, the state xi of the law with 2 n_t + n entries, and the torques that are held;
    angles that encoders should see, and efforts; the length of the step, and 1 where the law is
    sampled at its beginning, else 0; its matrices A, B, C, D, E column by column, as
    `LinearFeedback` has them; stall torques, what a motor loses of them by its speed, its largest
    torque, and the resolution of the encoders. Outputs: the same state, two error estimates.

    """
    from scipy.integrate import DOP853

    size = rate.size1_in(0)
    order = size + n
    state, p = ca.MX.sym('s', size + order + n), ca.MX.sym('p', rate.size1_in(2))
    reference, timing = ca.MX.sym('r', 2 * n), ca.MX.sym('t', 2)
    shapes = ((order, order), (order, n), (n, order), (n, n), (order, n))
    law, motors = ca.MX.sym('l', sum(a * b for a, b in shapes)), ca.MX.sym('m', 3 * n + 1)
    x, xi, held = ca.vertsplit(state, [0, size, size + order, size + order + n])
    borders = [0]
    for rows, columns in shapes:
        borders.append(borders[-1] + rows * columns)
    A, B, C, D, E = (ca.reshape(entries, *shape) for entries, shape in zip(
        ca.vertsplit(law, borders), shapes, strict=True))
    stall, loss, cap, resolution = ca.vertsplit(motors, [0, n, 2 * n, 3 * n, 3 * n + 1])
    angles, efforts = ca.vertsplit(reference, n)
    rounded = ca.floor(x[:n] / resolution + 0.5) * resolution
    error = ca.if_else(resolution > 0, rounded, x[:n]) - angles
    speeds = x[size // 2:size // 2 + n]
    torques = clip(efforts + C @ xi + D @ error, *torque_bounds(stall, loss, cap, speeds))
    following = A @ xi + B @ error + E @ (torques - efforts)
    held += timing[1] * (torques - held)
    xi += timing[1] * (following - xi)
    after, fifth, third = _advance(rate, x, [held] * (DOP853.n_stages + 1), timing[0], p)
    return ca.Function('feedback_step', [state, reference, timing, law, motors, p], [
        ca.vertcat(after, xi, held), fifth, third]), 3


def _advance(rate: Any, x: Any, torques: Sequence[Any], step: Any, p: Any) -> list[Any]:
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
