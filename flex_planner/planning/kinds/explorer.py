"""
Motions of a rigid arm from many starts, by direct collocation and IPOPT.

IPOPT needs no costates and finds motions on their limits from bad guesses, so that its starts
differ in the path alone. Coarse meshes lie: a value counts only once it is confirmed on a mesh
twice as fine.

"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import partial

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.direct.conversion import to_solution
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.result import DirectResult
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.paths import AnyPath
import numpy as np

# points of an interval; intervals of the first mesh, where torques are on their limits and where
# they need not be
_STAGES, _LIMIT_INTERVALS, _INTERVALS = 4, 24, 16
# relative change on a mesh twice as fine up to which a value stands, and the finest mesh
_STANDS, MOST_INTERVALS = 0.01, 192
_ITERATIONS, _TOLERANCE, _FINE_TOLERANCE = 100, 1e-4, 1e-6
# of a least effort on a finer mesh: motions that stand take five to thirty, seldom fifty
_FINE_ITERATIONS = 60
# the price of what is free, in units of the largest possible cost by the mass of the links, or by
# the duration; it goes with R, so that the motion does not depend on it
_PRICE = 20.0
# of the largest payload of use: IPOPT passes its bounds by a little
_BELOW = 1 - 1e-6
# of a free payload: where it starts, by the mass of the links
_FIRST_PAYLOAD = 0.3
# of a free duration, by that of the task
_FIRST_DURATION = 1.5
_SHARES = np.linspace(0, 1, 17, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExploredMotion:
    """
    A motion that an exploration met.

    Attributes
    ----------
    value : float
        J, or the payload [kg] or duration [s] that is free.
    price : float
        Of what is free; 0 if nothing is.
    angles : numpy.ndarray, shape (17, n)
        Joint angles at equal times [rad].
    problem : MotionProblem
        With the payload and duration of the motion.
    solution : CollocationSolution
        States and costates, a guess for Newton's method.

    """

    value: float
    price: float
    angles: Array
    problem: MotionProblem
    solution: CollocationSolution


class Explorer:
    """
    Explores the motions of a rigid arm.

    Parameters
    ----------
    problem : MotionProblem
        Of a rigid arm, with hard goals.
    free : Free
        What is searched besides the motion.
    monitor : Monitor
        Receives iterations, and may stop the work.
    most_payload : float
        The largest payload that is of use, for example what can be held at the goal [kg].
    most_intervals : int
        Of a mesh, at least 2.

    """

    def __init__(self, problem: MotionProblem, free: Free, monitor: Monitor,
                 most_payload: float = np.inf, most_intervals: int = MOST_INTERVALS) -> None:
        self._problem, self._free, self._monitor = problem, free, monitor
        self._most = min(_BELOW * most_payload, _heaviest(problem))
        self._finest = min(most_intervals, MOST_INTERVALS)
        self._price = _price(problem, free)
        self._directs: dict[int, DirectProblem] = {}

    def explore(self, paths: Sequence[AnyPath],
                ) -> Generator[ExploredMotion | None, None, None]:
        """
        Yield the motion that each path leads to, None if IPOPT does not converge, in their order.

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        problem, intervals = self._first(), min(self._finest, (
            _INTERVALS if self._free is Free.NOTHING else _LIMIT_INTERVALS))
        duration = problem.task.duration
        found = self._direct(intervals).solve_from_paths(
            [partial(_in_time, path, duration) for path in paths], problem.parameters,
            problem.start, problem.goal, duration, free=self._free, price=self._price,
            most_payload=self._most, monitor=self._monitor)
        for one in found:
            self._monitor.check()
            yield self._motion(one)

    def adapt(self, motion: ExploredMotion) -> Generator[ExploredMotion, None, None]:
        """
        Yield the motions that one of the same arm with another payload leads to, confirmed.

        Meshes differ in where IPOPT ends from so far.

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        problem = self._first()
        for intervals in (_INTERVALS, _LIMIT_INTERVALS):
            found = self._direct(min(self._finest, intervals)).solve(
                problem.parameters, problem.start, problem.goal, problem.task.duration,
                free=self._free, guess=motion.solution, price=self._price,
                most_payload=self._most, monitor=self._monitor)
            self._monitor.check()
            coarse = self._motion(found)
            confirmed = None if coarse is None else self.confirm(coarse)
            if confirmed is not None:
                yield confirmed

    def confirm(self, motion: ExploredMotion) -> ExploredMotion | None:
        """
        Return a motion on a mesh so fine that its value stands; None if there is none.

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        here, intervals = motion, 2 * motion.solution.intervals
        while intervals <= self._finest:
            task = here.problem.task
            found = self._direct(intervals).solve(
                here.problem.parameters, here.problem.start, here.problem.goal, task.duration,
                free=self._free, guess=here.solution, price=self._price,
                most_payload=self._most, monitor=self._monitor)
            self._monitor.check()
            finer = self._motion(found)
            if finer is None:
                return None
            if abs(finer.value - here.value) <= _STANDS * abs(here.value):
                return finer
            here, intervals = finer, 2 * intervals
        return None

    def _first(self) -> MotionProblem:
        """Return the problem with first values of what is free."""
        problem = self._problem
        if self._free is Free.PAYLOAD:
            first = _FIRST_PAYLOAD * problem.model.arm.link_mass
            return problem.with_changes(payload_mass=min(first, 0.9 * self._most))
        if self._free is Free.DURATION:
            return problem.with_changes(duration=_FIRST_DURATION * problem.task.duration)
        return problem

    def _direct(self, intervals: int) -> DirectProblem:
        """Return the programme on a mesh; the first one is for many starts, the others exact."""
        if intervals not in self._directs:
            fine = bool(self._directs)
            few = fine and self._free is Free.NOTHING
            self._directs[intervals] = DirectProblem(self._problem.model, DirectSettings(
                scheme='gauss', degree=_STAGES, intervals=intervals, exploring=True,
                max_iterations=_FINE_ITERATIONS if few else _ITERATIONS,
                tolerance=_FINE_TOLERANCE if fine else _TOLERANCE))
        return self._directs[intervals]

    def _motion(self, found: DirectResult) -> ExploredMotion | None:
        """Return a result of IPOPT as a motion, None if it is none."""
        if not found.converged:
            return None
        try:
            problem = self._problem.with_changes(payload_mass=max(found.payload, 0.0),
                                                 duration=found.duration)
        except FlexPlannerError:  # a payload too heavy to hold
            return None
        value = {Free.NOTHING: found.cost, Free.PAYLOAD: found.payload,
                 Free.DURATION: found.duration}[self._free]
        return ExploredMotion(value=value, price=self._price, problem=problem,
                              solution=to_solution(found, problem), angles=sample_angles(
                                  found.times, found.states, problem.model.arm.n_joints))


def _in_time(path: AnyPath, duration: float, times: Array) -> tuple[Array, Array, Array]:
    """Return angles, speeds and accelerations on a path, (k, n) each, at times (k,)."""
    return path(times / duration, duration)


def sample_angles(times: Array, states: Array, n: int) -> Array:
    """Return the joint angles (17, n) at equal times from states at the nodes of a mesh."""
    at = _SHARES * times[-1]
    return np.stack([np.interp(at, times, angle) for angle in states[:, :n].T], axis=1)


def _heaviest(problem: MotionProblem) -> float:
    """Return a payload beyond which nothing is explored [kg]."""
    return 1e4 * problem.model.arm.link_mass


def _price(problem: MotionProblem, free: Free) -> float:
    """Return the price of what is free."""
    if free is Free.NOTHING:
        return 0.0
    parameters = problem.parameters
    most = parameters.torque_limits.standstill
    limited = np.where(np.isfinite(most), most, 0.0)
    largest = _PRICE * float(parameters.effort_weights @ limited**2) / 2
    if free is Free.DURATION:
        return largest
    return largest * problem.task.duration / problem.model.arm.link_mass
