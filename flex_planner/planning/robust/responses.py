"""
How a change of the planned torque moves the states in which differing arms arrive.

An arm gets the planned torque and a PD that compares its joints with the planned ones, so a change
of the torque moves it twice: directly, and by what it makes of the plan. Both are linearised along
the motions, in steps in which the change is held.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flex_planner.arms.arm import Arm
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
# dynamics are linearised once in so many steps, and on both sides of where a motor meets a limit
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
    stacked : numpy.ndarray, shape (g, (S + 1) 2 n_t, n)
        `differing` over `nominal`.
    misses : numpy.ndarray, shape (S 2 n_t,)
        By how much the states on arrival are off the rest that the controller leads to, in the
        units of `differing`.
    roots : numpy.ndarray, shape (S, 2 n_t, 2 n_t)
        The roots of the energy in `differing`.

    """

    times: Array
    step: float
    free: Array
    stacked: Array
    misses: Array
    roots: Array

    @classmethod
    def of(cls, plan: Plan, arrivals: Sequence[Arrival]) -> Responses:
        """Return the responses of arms (S,) that carry a plan out, none of which runs away."""
        count = _count_steps(plan)
        step = plan.task.duration / count
        times: Array = (np.arange(count, dtype=np.float64) + 0.5) * step
        planned, free = _Drive.nominal(plan, times)
        drives = [*(_Drive.of(arrival, times, planned) for arrival in arrivals), planned]
        roots = np.stack([_energy_root(arrival) for arrival in arrivals])
        misses = [root @ arrival.away
                  for root, arrival in zip(roots, arrivals, strict=True)]
        return cls(times=times, step=step, free=free, stacked=_respond(drives, roots, step),
                   misses=np.concatenate(misses), roots=roots)

    @property
    def differing(self) -> Array:
        """
        Return those of the states on arrival, times a root of the energy, (g, S 2 n_t, n).

        Their squares add up to twice the energy under the controller [sqrt(J)].

        """
        return self.stacked[:, :self.misses.size]

    @property
    def nominal(self) -> Array:
        """Return those of the state at the end of the plan, shape (g, 2 n_t, n)."""
        return self.stacked[:, self.misses.size:]

    def states_of(self, misses: Array) -> Array:
        """Return how far arms are from their rest that miss so much (S 2 n_t,), (S, 2 n_t)."""
        away: Array = (np.linalg.pinv(self.roots)
                       @ misses.reshape(*self.roots.shape[:2], 1))[..., 0]
        return away


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Drive:
    """
    The motion of an arm at g points, and what its torques are made of.

    Attributes
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    physical : numpy.ndarray
        `PhysicalParameters.physical`.
    states, torques : numpy.ndarray, shape (g, 2 n_t) and (g, n)
        On the way.
    inside : numpy.ndarray, shape (g, n)
        Whether the torque follows what is asked for, within the limits. Of the plan always: what
        its limits keep of an offset decides how long they hold, and is left out afterwards.
    by_speed : numpy.ndarray, shape (g, n)
        How a limit that holds moves with the speed, 0 where none does [N m s/rad]; of the plan 0,
        whose costates have it from the conditions of optimality.
    feedback : numpy.ndarray, shape (n, 2 n_t)
        Makes torques of deviations from the plan.

    """

    dynamics: ArmDynamics
    physical: Array
    states: Array
    torques: Array
    inside: Array
    by_speed: Array
    feedback: Array

    @classmethod
    def nominal(cls, plan: Plan, times: Array) -> tuple[_Drive, Array]:
        """Return the plan itself, and where its motors are free, 1 or 0, shape (g, n)."""
        samples, n = plan.sample(times), plan.arm.n_joints
        assert plan.solution is not None
        wanted = plan.problem.controls(times, plan.solution(times)).free_torque
        free = limits_in_force(plan.arm, wanted, samples.rates[:, :n])[0].astype(np.float64)
        states = np.hstack([samples.coordinates, samples.rates])
        return cls(dynamics=plan.model, physical=plan.problem.parameters.physical, states=states,
                   torques=samples.torques, inside=np.ones_like(free),
                   by_speed=np.zeros_like(free), feedback=np.zeros((n, states.shape[1]))), free

    @classmethod
    def of(cls, arrival: Arrival, times: Array, planned: _Drive) -> _Drive:
        """Return an arm that carries the plan out."""
        execution, (_, n) = arrival.execution, planned.torques.shape
        n_t = planned.states.shape[1] // 2
        states = np.stack([np.interp(times, arrival.times, column)
                           for column in arrival.states.T], axis=1)
        feedback = _feedback(execution.controller.gains, n_t)
        asked = planned.torques + (planned.states - states) @ feedback.T
        arm, speeds = execution.dynamics.arm, states[:, n_t:n_t + n]
        inside, by_speed = limits_in_force(arm, asked, speeds)
        return cls(dynamics=execution.dynamics, physical=execution.parameters.physical,
                   states=states, torques=TorqueLimits.of(arm).bound(asked, speeds),
                   inside=inside, by_speed=by_speed, feedback=feedback)

    def linearise(self, some: Array) -> tuple[Array, Array, Array]:
        """
        Return A, B and C of x' = A x + B u + C x_plan at some of the points.

        A is that under the PD and the limits, B and C are without motors on their limits.

        """
        A, B = linearise_dynamics(self.dynamics, self.states[some], self.torques[some],
                                  self.physical)
        n, n_t = B.shape[-1], B.shape[-2] // 2
        A[..., n_t:n_t + n] += B * self.by_speed[some, None, :]
        B = B * self.inside[some, None, :]
        C = B @ self.feedback
        return A - C, B, C


def limits_in_force(arm: Arm, asked: Array, speeds: Array) -> tuple[Array, Array]:
    """Return which torques (g, n) are within the limits, and how the limits move with speeds."""
    limits = TorqueLimits.of(arm)
    (lower, upper), (lowest, highest) = limits.bounds(speeds), limits.lines(speeds)
    on_line = ((asked <= lower) & (lower == lowest)) | ((asked >= upper) & (upper == highest))
    return (lower < asked) & (asked < upper), np.where(on_line, -limits.slope, 0.0)


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


def _respond(drives: Sequence[_Drive], roots: Array, step: float) -> Array:
    """
    Return the responses of arms and of the plan, which comes last, shape (g, (S + 1) m, n).

    From the end on backwards: of each arm m = 2 n_t rows by its own state and by that of the
    plan, a root of its energy by the former first; of the plan 1 by its own.

    """
    (count, inputs), size = drives[0].torques.shape, roots.shape[-1]
    some = _choose_points(np.stack([part for drive in drives
                                    for part in (drive.inside, drive.by_speed)]))
    A, B, C = (np.stack(parts) for parts in zip(
        *(drive.linearise(some) for drive in drives), strict=True))
    carried, pushed = _cross_steps(A, B, C, step)
    place = np.interp(np.arange(count), some, np.arange(some.size))
    first = np.minimum(place.astype(np.intp), some.size - 2)
    shares = place - first
    rows: Array = np.zeros((len(drives), size, 2 * size))
    rows[:-1, :, :size], rows[-1, :, size:] = roots, np.eye(size)
    responses = np.empty((count, len(drives), size, inputs))
    for k in range(count - 1, -1, -1):
        j, share = first[k], shares[k]
        responses[k] = rows @ _between(pushed, j, share)
        rows = rows @ _between(carried, j, share)
    return responses.reshape(count, -1, inputs)


def _choose_points(limits: Array) -> Array:
    """Return the steps to linearise at, of values (.., g, n) that jump where limits begin."""
    count = limits.shape[-2]
    changes = np.flatnonzero((limits[:, 1:] != limits[:, :-1]).any(axis=(0, 2)))
    points: Array = np.unique(np.concatenate([np.arange(0, count, _STRIDE), changes, changes + 1,
                                              [count - 1]]))
    return points


def _between(matrices: Array, index: int, share: float) -> Array:
    """Return matrices (k, ...) a share of the way from one to the next."""
    found: Array = matrices[index]
    if share:
        found = found + share * (matrices[index + 1] - found)
    return found


def _cross_steps(A: Array, B: Array, C: Array, step: float) -> tuple[Array, Array]:
    """
    Return what steps make of states, of arms over those of the plan, and of torques.

    Parameters
    ----------
    A, B, C : numpy.ndarray, shape (S + 1, k, m, m), (S + 1, k, m, n) and (S + 1, k, m, m)
        Of x' = A x + B u + C x_plan at k points; those of the plan come last.
    step : float
        [s].

    Returns
    -------
    carried, pushed : numpy.ndarray, shape (k, S + 1, 2 m, 2 m) and (k, S + 1, 2 m, n)

    """
    half, forced = hold_inputs(A, B, step / 2)
    whole, held = half @ half, half @ forced + forced
    # what a state of the plan at the beginning of a step, and a torque in it, do to an arm by
    # the controller: Simpson's rule over the step
    over = half @ C
    by_plan = step / 6 * (whole @ C + 4 * over @ half[-1] + C @ whole[-1])
    by_torque = step / 6 * (4 * over @ forced[-1] + C @ held[-1])
    size = A.shape[-1]
    carried = np.zeros((*A.shape[:2], 2 * size, 2 * size))
    carried[..., :size, :size], carried[..., :size, size:] = whole, by_plan
    carried[..., size:, size:] = whole[-1]
    pushed = np.concatenate([held + by_torque, np.broadcast_to(held[-1], held.shape)], axis=-2)
    return (np.ascontiguousarray(carried.swapaxes(0, 1)),
            np.ascontiguousarray(pushed.swapaxes(0, 1)))
