"""
How a change of the planned torque moves the states in which differing arms arrive.

An arm gets the planned torque and a PD that compares its joints with the planned ones, so a change
of the torque moves it twice: directly, and by what it makes of the plan. Both are linearised along
the motions, in steps in which the change is held.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import Gains
from flex_planner.control.linearisation import hold_inputs, linearise_dynamics
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.statics import natural_modes
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.arrivals import Arrival
import numpy as np

# steps: the fewest and the most, and for each cycle of the fastest vibration
_FEWEST, _MOST, _PER_CYCLE = 200, 1000, 2.5
# dynamics are linearised once in so many steps
_STRIDE = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Responses:
    """
    Responses to torques held over steps, of S arms.

    Attributes
    ----------
    times : numpy.ndarray, shape (g,)
        Middles of the steps [s].
    step : float
        Their length [s].
    free : numpy.ndarray, shape (g, n)
        1 where a motor of the plan is between its limits, 0 where it is on one.
    nominal : numpy.ndarray, shape (g, 2 n_t, n)
        Of the state at the end of the plan.
    differing : numpy.ndarray, shape (g, S 2 n_t, n)
        Of the states on arrival, times a root of the energy: their squares add up to twice the
        energy under the controller [sqrt(J)].
    misses : numpy.ndarray, shape (S 2 n_t,)
        Those states less the rest that the controller leads to, in the same units.
    roots : numpy.ndarray, shape (S, 2 n_t, 2 n_t)
        Those roots.

    """

    times: Array
    step: float
    free: Array
    nominal: Array
    differing: Array
    misses: Array
    roots: Array

    @classmethod
    def of(cls, plan: Plan, arrivals: Sequence[Arrival]) -> Responses:
        """Return the responses of arms (S,) that carry a plan out, none of which runs away."""
        count = _count_steps(plan)
        step = plan.task.duration / count
        times: Array = (np.arange(count, dtype=np.float64) + 0.5) * step
        states, torques, free = _sample(plan, times)
        paths = [_Path.nominal(plan, times, states, torques),
                 *(_Path.of(arrival, times, states, torques) for arrival in arrivals)]
        roots = np.stack([_energy_root(arrival) for arrival in arrivals])
        misses = [root @ arrival.away
                  for root, arrival in zip(roots, arrivals, strict=True)]
        nominal, differing = _respond(paths, roots, step)
        return cls(times=times, step=step, free=free, nominal=nominal, differing=differing,
                   misses=np.concatenate(misses), roots=roots)

    def states_of(self, misses: Array) -> Array:
        """Return how far arms are from their rest that miss so much (S 2 n_t,), (S, 2 n_t)."""
        away: Array = (np.linalg.pinv(self.roots)
                       @ misses.reshape(*self.roots.shape[:2], 1))[..., 0]
        return away


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Path:
    """
    The motion of an arm, linearised: x' = A x + B u + C x_plan at g points.

    A and B are those under the PD, B and C without motors that are on their limits.

    """

    A: Array
    B: Array
    C: Array

    @classmethod
    def nominal(cls, plan: Plan, times: Array, states: Array, torques: Array) -> _Path:
        """Return the plan itself."""
        A, B = _linearise(plan.model, plan.problem.parameters.physical, times, states, torques)
        return cls(A=A, B=B, C=np.zeros_like(A))

    @classmethod
    def of(cls, arrival: Arrival, times: Array, planned: Array, torques: Array) -> _Path:
        """Return an arm that carries the plan out."""
        execution, n = arrival.execution, torques.shape[1]
        arm, n_t = execution.dynamics.arm, planned.shape[1] // 2
        states = np.stack([np.interp(times, arrival.times, column)
                           for column in arrival.states.T], axis=1)
        feedback = _feedback(execution.controller.gains, n_t)
        asked = torques + (planned - states) @ feedback.T
        lower, upper = TorqueLimits.of(arm).bounds(states[:, n_t:n_t + n])
        inside = (lower < asked) & (asked < upper)
        A, B = _linearise(execution.dynamics, execution.parameters.physical, times, states,
                          np.clip(asked, lower, upper))
        B = B * inside[:, None, :]
        C = B @ feedback
        return cls(A=A - C, B=B, C=C)


def _sample(plan: Plan, times: Array) -> tuple[Array, Array, Array]:
    """Return states (g, 2 n_t), torques (g, n), and which of these are between their limits."""
    samples = plan.sample(times)
    assert plan.solution is not None
    wanted = plan.problem.controls(times, plan.solution(times)).free_torque
    free = (samples.lower_bounds < wanted) & (wanted < samples.upper_bounds)
    return (np.hstack([samples.coordinates, samples.rates]), samples.torques,
            free.astype(np.float64))


def _count_steps(plan: Plan) -> int:
    """Return in how many steps a motion is cut."""
    frequencies, _ = natural_modes(plan.model, plan.problem.start[:plan.arm.n_coordinates],
                                   plan.problem.parameters, locked=False)
    cycles = float(np.nan_to_num(frequencies).max()) * plan.task.duration / (2 * np.pi)
    return int(np.clip(np.ceil(_PER_CYCLE * cycles), _FEWEST, _MOST))


def _feedback(gains: Gains, n_t: int) -> Array:
    """Return what makes torques of the PD from deviations of a state, shape (n, 2 n_t)."""
    n = gains.stiffness.size
    feedback = np.zeros((n, 2 * n_t))
    feedback[:, :n], feedback[:, n_t:n_t + n] = np.diag(gains.stiffness), np.diag(gains.damping)
    return feedback


def _linearise(dynamics: ArmDynamics, physical: Array, times: Array, states: Array,
               torques: Array) -> tuple[Array, Array]:
    """Return A and B at points, interpolated between some of them."""
    count = len(times)
    some = np.append(np.arange(0, count - 1, _STRIDE), count - 1)
    place = np.interp(np.arange(count), some, np.arange(some.size))
    first = np.minimum(place.astype(np.intp), some.size - 2)
    share = (place - first)[:, None, None]
    A, B = (part[first] * (1 - share) + part[first + 1] * share
            for part in linearise_dynamics(dynamics, states[some], torques[some], physical))
    return A, B


def _energy_root(arrival: Arrival) -> Array:
    """Return a root of twice the energy under the controller at rest, shape (2 n_t, 2 n_t)."""
    execution = arrival.execution
    dynamics, physical = execution.dynamics, execution.parameters.physical
    n, n_t = dynamics.arm.n_joints, dynamics.arm.n_coordinates
    rest = arrival.ringing.rest[:n_t]
    stiffness = dynamics.static_forces(rest[None], physical)[1][0].copy()
    stiffness[:n, :n] += np.diag(execution.controller.gains.stiffness)
    mass = dynamics.mass_and_energy(np.concatenate([rest, np.zeros(n_t)])[None], physical)[0][0]
    root = np.zeros((2 * n_t, 2 * n_t))
    for part, matrix in ((slice(0, n_t), stiffness), (slice(n_t, None), mass)):
        values, vectors = np.linalg.eigh(matrix)  # gravity may outweigh a weak controller
        root[part, part] = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return root


def _respond(paths: Sequence[_Path], roots: Array, step: float) -> tuple[Array, Array]:
    """Return the responses of the plan (g, m, n) and of the others (g, S m, n), m = 2 n_t."""
    A, B, C = (np.stack([getattr(path, name) for path in paths]) for name in 'ABC')
    half, pushed = hold_inputs(A, B, step / 2)
    whole, held = half @ half, half @ pushed + pushed
    # what a state of the plan at the beginning of a step, and a torque in it, do to an arm by
    # the controller: Simpson's rule over the step
    by_plan = step / 6 * (whole[1:] @ C[1:] + 4 * half[1:] @ C[1:] @ half[0]
                          + C[1:] @ whole[0])
    by_torque = step / 6 * (4 * half[1:] @ C[1:] @ pushed[0] + C[1:] @ held[0])
    count, size = A.shape[1:3]
    inputs = B.shape[-1]
    nominal, differing = (np.empty((count, rows, inputs)) for rows in (size, len(roots) * size))
    end, own, through = np.eye(size), roots, np.zeros_like(roots)
    for k in range(count - 1, -1, -1):
        nominal[k] = end @ held[0, k]
        differing[k] = (own @ (held[1:, k] + by_torque[:, k])
                        + through @ held[0, k]).reshape(-1, inputs)
        through = through @ whole[0, k] + own @ by_plan[:, k]
        own, end = own @ whole[1:, k], end @ whole[0, k]
    return nominal, differing
