"""
Steps of an arm under a controller that is sampled and held, as CasADi functions.

Each is a library of its own, for planning needs neither: with all their stages they take the
compiler longer than the equations of motion.

"""

from __future__ import annotations

from typing import Any

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.dynamics.build_chain import build_chain
from flex_planner.dynamics.dynamics_functions import (
    BatchedFunction,
    forward_dynamics,
    take_step,
)
from flex_planner.dynamics.torque_bounds import clip, torque_bounds


def build_controlled_step(arm: Arm) -> dict[str, BatchedFunction]:
    """
    Return a step of DOP853 under feedforward efforts and a PD that is sampled and held.

    Inputs: x with the n torques of the PD; angles, speeds, and efforts at both ends of the step;
    its length, and 1 where the PD is sampled at its beginning, else 0; gains, stall torques, what
    a motor loses of them by its speed, and its largest torque. Outputs: x with the PD's torques,
    two error estimates.

    """
    from scipy.integrate import DOP853

    rate, n = forward_dynamics(arm, build_chain(arm))[0], arm.n_joints
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
    after, fifth, third = take_step(limited, x, [*stages, last + held], timing[0], p)
    function = ca.Function('controlled_step', [state, reference, timing, controller, p],
                           [ca.vertcat(after, held), fifth, third])
    return {'controlled_step': (function, 3)}


def build_feedback_step(arm: Arm) -> dict[str, BatchedFunction]:
    """
    Return a step of DOP853 under efforts and a linear law, sampled and held within motor limits.

    Inputs: x, the state xi of the law with 2 n_t + n entries, and the torques that are held;
    angles that encoders should see, and efforts; the length of the step, and 1 where the law is
    sampled at its beginning, else 0; its matrices A, B, C, D, E column by column, as
    `LinearFeedback` has them; stall torques, what a motor loses of them by its speed, its largest
    torque, and the resolution of the encoders. Outputs: the same state, two error estimates.

    """
    from scipy.integrate import DOP853

    rate, n = forward_dynamics(arm, build_chain(arm))[0], arm.n_joints
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
    after, fifth, third = take_step(rate, x, [held] * (DOP853.n_stages + 1), timing[0], p)
    function = ca.Function('feedback_step', [state, reference, timing, law, motors, p],
                           [ca.vertcat(after, xi, held), fifth, third])
    return {'feedback_step': (function, 3)}
