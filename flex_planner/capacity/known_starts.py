"""Plans from motions that a search for a limit has met."""

from __future__ import annotations

from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_problem import plan_problem
from flex_planner.planning.strategies.catalogue import QUICK
from flex_planner.planning.strategies.extremals import Extremal
from flex_planner.planning.strategies.homotopies import has_weights, raise_weights_from
from flex_planner.planning.strategies.strategy import Attempt, Strategy

# time to certify what a search has when its own is over [s]
GRACE = 1.0
_CONTINUED = 'continuation to the limit'


def continue_strategy(start: CollocationSolution) -> Strategy:
    """Return the strategy that starts from a motion with the weights of the task."""
    return Strategy(_CONTINUED, lambda problem, solver: Attempt(
        result=solver.solve(problem, start)), quick=True)


def in_grace(solver: Solver, seconds: float = GRACE) -> Solver:
    """Return a solver whose time is just enough to certify what a stopped search has."""
    return solver.watched_by(Monitor(time_limit=seconds, canceled=solver.monitor.canceled))


def start_strategy(start: CollocationSolution, extremal: Extremal | None = None) -> Strategy:
    """Return the strategy that starts from a motion without weights, perhaps the solution."""
    def attempt(problem: MotionProblem, solver: Solver) -> Attempt:
        if extremal is not None and _is_solution(extremal, problem, solver):
            return Attempt(result=extremal.result)
        return Attempt(result=raise_weights_from(problem, start, solver))

    return Strategy(_CONTINUED, attempt, quick=True)


def plan_near(problem: MotionProblem, start: CollocationSolution, solver: Solver) -> Plan:
    """Return the plan of a problem from a motion nearly its own."""
    return plan_problem(problem, solver, (start_strategy(start), *QUICK))


def _is_solution(extremal: Extremal, problem: MotionProblem, solver: Solver) -> bool:
    """Return whether an extremal solves a problem, as exactly as it has to be."""
    one, other = extremal.problem.task, problem.task
    return (not has_weights(problem) and one.payload_mass == other.payload_mass
            and one.duration == other.duration and extremal.result.converged
            and float(extremal.result.errors.max()) <= solver.settings.error_tolerance)
