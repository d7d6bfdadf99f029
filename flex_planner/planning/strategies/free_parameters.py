"""
What can be pushed to its limit: the payload, which grows, and the duration, which falls.

Each is followed at a rising price. With a payload at a price sigma per kilogram, the motion of
least J - sigma m_p is one of least J for its payload, and dJ/dm_p is sigma there; as sigma grows
without bound the payload comes to the most that the arm carries. So with the duration.

"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator

from flex_planner.base.errors import FlexPlannerError
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    INTERRUPTED,
    Solver,
    SolverStatus,
)
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.free_duration import FreeDurationProblem
from flex_planner.optimal_control.free_payload import FreePayloadProblem, payload_price
from flex_planner.optimal_control.free_problem import FreeProblem
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import MAX_DURATION, MAX_PAYLOAD
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.initial_guesses import coarse_mesh, cold_start, warm_start
import numpy as np

# steps in the value itself, where no step in price succeeds
SHORTER = 0.85
_HEAVIER, _LEAST_MORE = 0.25, 0.1
# durations tried to start from, in units of the one of the task
_LONGER = (1.0, 3.0, 12.0)
# of a price: as a share of what the motion costs per unit, and at all
_LEAST_SHARE, _LEAST_PRICE = 1e-3, 1e-12


class FreeParameter(ABC):
    """
    A quantity of a motion that has a limit and a price.

    Attributes
    ----------
    name, unit : str
        Shown to people.
    unknown : Free
        What it is to a transcription.

    """

    name: str
    unit: str
    unknown: Free

    @abstractmethod
    def value(self, problem: MotionProblem) -> float:
        """Return the value of a problem's task."""

    @abstractmethod
    def with_value(self, problem: MotionProblem, value: float) -> MotionProblem:
        """
        Return the same motion with another value.

        Raises
        ------
        FlexPlannerError
            If the value is absurd, or its payload too heavy to hold at the goal.

        """

    @abstractmethod
    def price(self, problem: MotionProblem, solution: CollocationSolution) -> float:
        """Return the derivative of J by the value, towards the limit: something positive."""

    @abstractmethod
    def free(self, problem: MotionProblem, price: float) -> FreeProblem:
        """Return the motion whose value is free at a price."""

    @abstractmethod
    def improves(self, value: float, other: float) -> bool:
        """Return whether a value is nearer to the limit than another."""

    def ease(self, value: float, share: float) -> float:
        """Return a value that is further from the limit by a share."""
        return value * (1 - share if self.improves(1.0, 0.0) else 1 + share)

    def falls_short(self, value: float, wanted: float, share: float) -> bool:
        """Return whether a value is further from the limit than another by more than a share."""
        return self.improves(self.ease(wanted, share), value)

    @abstractmethod
    def is_possible(self, value: float) -> bool:
        """Return whether there can be a motion with a value."""

    @abstractmethod
    def next_value(self, value: float) -> float:
        """Return a value that is nearer to the limit by a step."""

    @abstractmethod
    def solve_next(self, problem: MotionProblem, solution: CollocationSolution,
                   solver: Solver) -> CollocationResult:
        """Solve a motion, starting from one of another value."""

    @abstractmethod
    def is_far(self, here: Extremal, value: float) -> bool:
        """Return whether the limit is so far from a value that its price may fall for a while."""

    @abstractmethod
    def easiest(self, problem: MotionProblem) -> MotionProblem:
        """Return the motion with the least demanding value that is of interest."""

    @abstractmethod
    def starts(self, problem: MotionProblem) -> Iterator[MotionProblem]:
        """Yield the motions that a search may start with, the preferred one first."""

    def solve_at_price(self, problem: MotionProblem, guess: CollocationSolution, price: float,
                       solver: Solver) -> Extremal | None:
        """
        Return the motion whose value is worth a price; None without a solution.

        If the monitor interrupted it, the extremal says so.

        """
        ahead = self.free(problem, price)
        found = solver.solve(ahead, ahead.extend(guess))
        value, _ = ahead.restrict(found.solution)
        if found.status in INTERRUPTED:
            return Extremal(value=value, price=price, result=found, problem=problem)
        if not found.converged or not self.is_possible(value):
            return None
        return Extremal(value=value, price=price, result=ahead.restrict_result(found),
                        problem=ahead.fix(value))

    def solve_beyond(self, problem: MotionProblem, value: float,
                     make_guess: Callable[[MotionProblem], CollocationSolution], price: float,
                     solver: Solver) -> Extremal | None:
        """
        Return the motion at a price that is nearer to the limit than a problem; None without one.

        Parameters
        ----------
        problem : MotionProblem
            With the least demanding value that is of interest.
        value : float
            Near the one that is sought.
        make_guess : callable
            From the motion with that value to a guess.
        price : float
            Of the value.
        solver : Solver
            If its monitor interrupts it, the extremal says so.

        """
        try:
            near = self.with_value(problem, value)
            found = self.solve_at_price(near, make_guess(near), price, solver)
        except FlexPlannerError:  # too heavy to hold, or no duration
            return None
        if found is None or found.interrupted:
            return found
        return found if self.improves(found.value, self.value(problem)) else None


class _Payload(FreeParameter):
    """The payload m_p: the limit is the most that the arm carries."""

    name, unit, unknown = 'payload', 'kg', Free.PAYLOAD

    def value(self, problem: MotionProblem) -> float:
        return problem.task.payload_mass

    def with_value(self, problem: MotionProblem, value: float) -> MotionProblem:
        return problem.with_changes(payload_mass=value)

    def price(self, problem: MotionProblem, solution: CollocationSolution) -> float:
        """Return dJ/dm_p, at least something positive: gravity may help."""
        cost = integrate_totals(problem, solution).cost
        share = cost / (problem.task.payload_mass + _LEAST_MORE)
        return max(payload_price(problem, solution), _LEAST_SHARE * share, _LEAST_PRICE)

    def free(self, problem: MotionProblem, price: float) -> FreeProblem:
        return FreePayloadProblem(problem, price)

    def improves(self, value: float, other: float) -> bool:
        return value > other

    def is_possible(self, value: float) -> bool:
        return 0 <= value <= MAX_PAYLOAD

    def next_value(self, value: float) -> float:
        return value + max(_HEAVIER * value, _LEAST_MORE)

    def solve_next(self, problem: MotionProblem, solution: CollocationSolution,
                   solver: Solver) -> CollocationResult:
        return solver.solve(problem, solution)

    def is_far(self, here: Extremal, value: float) -> bool:
        # J of light payloads need not be convex
        return here.gap > value

    def easiest(self, problem: MotionProblem) -> MotionProblem:
        return problem

    def starts(self, problem: MotionProblem) -> Iterator[MotionProblem]:
        yield problem


class _Duration(FreeParameter):
    """The duration t_f: the limit is the shortest in which the arm can make the motion."""

    name, unit, unknown = 'duration', 's', Free.DURATION

    def value(self, problem: MotionProblem) -> float:
        return problem.task.duration

    def with_value(self, problem: MotionProblem, value: float) -> MotionProblem:
        return problem.with_changes(duration=value)

    def price(self, problem: MotionProblem, solution: CollocationSolution) -> float:
        """Return -dJ/dt_f = -H, at least something positive."""
        hamiltonian = problem.controls(solution.mesh, solution.nodes).hamiltonian
        hamiltonian = hamiltonian + problem.barrier_rate(solution.nodes)
        share = integrate_totals(problem, solution).cost / problem.task.duration
        return max(-float(np.mean(hamiltonian)), _LEAST_SHARE * share, _LEAST_PRICE)

    def free(self, problem: MotionProblem, price: float) -> FreeProblem:
        return FreeDurationProblem(problem, price)

    def improves(self, value: float, other: float) -> bool:
        return value < other

    def is_possible(self, value: float) -> bool:
        return 0 < value <= MAX_DURATION

    def next_value(self, value: float) -> float:
        return value * SHORTER

    def solve_next(self, problem: MotionProblem, solution: CollocationSolution,
                   solver: Solver) -> CollocationResult:
        return solve_stretched(problem, solution, solver)

    def is_far(self, here: Extremal, value: float) -> bool:
        return False

    def easiest(self, problem: MotionProblem) -> MotionProblem:
        return problem.with_changes(duration=MAX_DURATION)

    def starts(self, problem: MotionProblem) -> Iterator[MotionProblem]:
        longer = [min(factor * problem.task.duration, MAX_DURATION) for factor in _LONGER]
        for duration in dict.fromkeys(longer):
            yield problem.with_changes(duration=duration)


PAYLOAD: FreeParameter = _Payload()
DURATION: FreeParameter = _Duration()


def solve_stretched(problem: MotionProblem, solution: CollocationSolution,
                    solver: Solver) -> CollocationResult:
    """Solve a motion, starting from one of another duration, or else from nothing."""
    for attempt in (warm_start(solution).attempt, cold_start, coarse_mesh):
        tried = attempt(problem, solver)
        if tried is not None and tried.result.status is not SolverStatus.NEWTON_FAILED:
            break
    assert tried is not None
    return tried.result
