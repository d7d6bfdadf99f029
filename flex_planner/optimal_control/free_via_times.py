"""
Motions that pass via points at the times that are best for them.

The time of a via point is the best where H does not jump there: dJ/dt_k = H(t_k-) - H(t_k+).

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationResult, CollocationSolution
from flex_planner.collocation.problem import CompiledRate
from flex_planner.optimal_control.free_problem import append_zeros
from flex_planner.optimal_control.motion_problem import Indices, MotionProblem
import numpy as np

# smallest magnitude of a duration that counts, of that of the motion
_SHORTEST = 1e-3
# of H in units of the smallest that matters
_TYPICAL = 100.0


class FreeViaTimesProblem:
    """
    The optimality conditions of a task whose via points have free times.

    The unknowns are (z, t, d) over the number of via points passed, from 0 to K + 1: t is the
    time, d the duration of the phase between two via points, whose rate is zero. At each via point
    d jumps so that t is the time given, or that H does not jump where the time is free.

    Parameters
    ----------
    motion : MotionProblem
        Of the task, with times near the best.
    jumps : numpy.ndarray, shape (K,), optional
        Of H at the via points; none by default, others lead to that from times that are given.

    """

    def __init__(self, motion: MotionProblem, jumps: Array | None = None) -> None:
        self.motion = motion
        self._jumps = np.zeros(motion.via.times.size) if jumps is None else jumps
        self.size = motion.size + 2
        self.scale = np.concatenate([motion.scale, [motion.task.duration,
                                                    _SHORTEST * motion.task.duration]])
        self.explicit: Indices = np.append(motion.explicit, motion.size)
        self.junctions = np.arange(1.0, motion.via.times.size + 1)

    def rate(self, t: Array, z: Array) -> Array:
        """Return (d z', d, 0)."""
        phase = z[:, -1:]
        return np.hstack([phase * self.motion.rate(t, z[:, :-2]), phase, np.zeros_like(phase)])

    def rate_jacobian(self, t: Array, z: Array) -> tuple[Array, Array]:
        """Return (d z', d, 0) and its Jacobian."""
        phase, jacobian = z[:, -1:], np.zeros((len(z), self.size, self.size))
        rate, inner = self.motion.rate_jacobian(t, z[:, :-2])
        jacobian[:, :-2, :-2] = phase[..., None] * inner
        jacobian[:, :-2, -1], jacobian[:, -2, -1] = rate, 1
        return np.hstack([phase * rate, phase, np.zeros_like(phase)]), jacobian

    def compiled_rate(self) -> CompiledRate | None:
        """Return both as machine code; None without a compiler or with limits of states."""
        if self.motion.layout.torques or self.motion.compiled_rate() is None:
            return None
        return self.motion.model.compiled_rate('free_times', self.motion.p)

    def switches(self, t: Array, z: Array) -> Array:
        """Return the motion's."""
        return self.motion.switches(t, z[:, :-2])

    def left(self, z: Array) -> tuple[Array, Array]:
        """Return the motion's rows, and that the time is 0."""
        residual, rows = self.motion.left(z[:-2])
        return np.append(residual, z[-2]), self._with_time(rows)

    def right(self, z: Array) -> tuple[Array, Array]:
        """Return the motion's rows, and that its duration is over."""
        residual, rows = self.motion.right(z[:-2])
        return np.append(residual, z[-2] - self.motion.task.duration), self._with_time(rows)

    def _with_time(self, rows: Array) -> Array:
        """Return rows of z with one of t."""
        wider = np.zeros((len(rows) + 1, self.size))
        wider[:-1, :-2], wider[-1, -2] = rows, 1
        return wider

    def join(self, junction: int, before: Array, after: Array) -> tuple[Array, Array]:
        """Return what holds at a via point, that time goes on, and what is true of its time."""
        inner, size = self.motion.size, self.size
        residual, rows = after - before, np.zeros((size, 2 * size))
        residual[:inner], found = self.motion.join(junction, before[:inner], after[:inner])
        rows[:inner, :inner], rows[:inner, size:size + inner] = np.hsplit(found, 2)
        rows[-2, size - 2], rows[-2, -2] = -1, 1
        given = self.motion.task.via_points[junction].time
        if given is not None:
            residual[-1] = before[-2] - given
            rows[-1, size - 2] = 1
            return residual, rows
        points = np.stack([before[:inner], after[:inner]])
        controls = self.motion.controls(np.zeros(2), points)
        slopes = self.motion.layout.turn(self.motion.rate(np.zeros(2), points))
        unit = self._unit
        fall = float(controls.hamiltonian[0] - controls.hamiltonian[1])
        residual[-1] = unit * (fall - self._jumps[junction])
        rows[-1, :inner], rows[-1, size:size + inner] = unit * slopes[0], -unit * slopes[1]
        return residual, rows

    @property
    def _unit(self) -> float:
        """Return what turns H into a duration, by which its row is scaled."""
        scale = self.motion.scale[:4 * self.motion.layout.coordinates]
        _, rates, costates, _ = scale.reshape(4, -1)
        return float(self.scale[-1]) / (_TYPICAL * float(rates @ costates))

    def with_jumps(self, jumps: Array) -> FreeViaTimesProblem:
        """Return the problem whose H falls by given amounts at the via points."""
        return FreeViaTimesProblem(self.motion, jumps)

    def jumps(self, solution: CollocationSolution) -> Array:
        """Return by how much H falls at each via point, shape (K,)."""
        twice = np.flatnonzero(solution.steps == 0)
        before, after = (self.motion.controls(
            solution.mesh[at], solution.nodes[at, :self.motion.size]).hamiltonian
            for at in (twice, twice + 1))
        fall: Array = before - after
        return fall

    def extend(self, solution: CollocationSolution) -> CollocationSolution:
        """Return a motion that passes its via points at given times as a guess."""
        ends = np.concatenate([[0.0], self.motion.via.times, [self.motion.task.duration]])
        phases, steps = np.diff(ends), np.diff(solution.mesh)
        middles = (solution.mesh[:-1] + solution.mesh[1:]) / 2
        passed = np.cumsum(steps == 0)  # up to and with each interval
        here = np.where(steps == 0, passed - 1, passed)
        assert (ends[here] <= middles).all(), 'the mesh has the double nodes of the motion'
        at_nodes = np.append(here, here[-1])
        at_nodes[1:][steps == 0] = here[steps == 0] + 1
        mesh = at_nodes + (solution.mesh - ends[at_nodes]) / phases[at_nodes]
        mesh[:-1][steps == 0] = mesh[1:][steps == 0]
        nodes = np.column_stack([solution.nodes, solution.mesh, phases[at_nodes]])
        stages = append_zeros(solution.stages, 2) * phases[here, None, None]
        stages[..., -2] = phases[here, None]
        return CollocationSolution(mesh, nodes, stages, solution.rule)

    def restrict(self, solution: CollocationSolution) -> tuple[Array, CollocationSolution]:
        """Return the times of the via points, and the motion over its own time."""
        phases = solution.nodes[:-1, -1]
        mesh = solution.nodes[:, -2].copy()
        mesh[0], mesh[-1] = 0.0, self.motion.task.duration
        twice = np.flatnonzero(solution.steps == 0)
        mesh[twice + 1] = mesh[twice]
        return mesh[twice], CollocationSolution(
            mesh, solution.nodes[:, :-2], solution.stages[..., :-2] / phases[:, None, None],
            solution.rule)

    def restrict_result(self, result: CollocationResult) -> CollocationResult:
        """Return the result of the motion with the times found."""
        _, solution = self.restrict(result.solution)
        switches = result.solution(result.switches)[:, -2] if result.switches.size else (
            result.switches)
        return replace(result, solution=solution, errors=result.errors[:-2], switches=switches)

    def goes_forwards(self, solution: CollocationSolution) -> bool:
        """Return whether every phase of a solution takes some time."""
        return bool((solution.nodes[:, -1] > 0).all())
