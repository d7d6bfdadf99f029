"""Where a continuation starts: near its end, if the same arm made rigid leads there."""

from __future__ import annotations

from collections.abc import Iterator

from flex_planner.base.errors import InvalidTaskError
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    INTERRUPTED,
    Solver,
)
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.extremals import (
    Extremal,
    no_target,
    SearchStart,
    TargetGap,
)
from flex_planner.planning.strategies.free_parameters import FreeParameter, PAYLOAD
from flex_planner.planning.strategies.homotopies import raise_weights
from flex_planner.planning.strategies.initial_guesses import (
    cold_start,
    lift,
    lift_rigid_motion,
    rigid_problem,
)
from flex_planner.planning.strategies.ipopt_continuation import continue_by_ipopt
from flex_planner.planning.strategies.limit_barrier import is_cheap, reach_limit
from flex_planner.planning.strategies.price_continuation import continue_in_price

# largest mesh of a first motion, in units of the coarsest that overlooks nothing
_FIRST_MESHES, _FIRST_INTERVALS, _FIRST_ITERATIONS = 4, 200, 15
# a rigid motion is lifted when its payload is so near to its limit, and few before are tried
_LIFT, _LIFTS, _MOST_RIGID = 0.03, 3, 15


def approach_limit(parameter: FreeParameter, problem: MotionProblem, solver: Solver, *,
                   first: Extremal | None = None,
                   target_gap: TargetGap = no_target) -> Iterator[Extremal]:
    """
    Yield motions nearer and nearer to a limit, from the value of the problem on.

    A flexible arm starts from the far end of the same arm made rigid: where the payload is free
    at a price its motion is near, while with a given payload the phase of what rings is not.
    Where that fails it starts from the value of the problem. A first motion that is known, see
    `transfer_extremal`, spares all that.

    """
    barrier = first is None and target_gap is not no_target
    if barrier and is_cheap(parameter, problem):
        first = reach_limit(parameter, problem, solver, target_gap)
    if first is None and problem.model.arm.n_passive:
        rigid = _rigid_extremals(parameter, problem, solver)
        first = lift_extremal(parameter, problem, rigid, solver)
        if first is None and barrier and not is_cheap(parameter, problem):
            first = reach_limit(parameter, problem, solver, target_gap)
        if first is None and rigid and parameter is PAYLOAD:
            price, found = rigid[-1].price, False
            for extremal in continue_by_ipopt(problem, price, solver, target_gap):
                found = True
                yield extremal
            if found:
                return
    if first is None:
        first = Extremal(value=parameter.value(problem), price=0.0, problem=problem,
                         result=solve_first(problem, solver))
    yield first
    if first.result.converged:
        yield from continue_in_price(parameter, first.problem, first.result, solver, target_gap)


def _rigid_extremals(parameter: FreeParameter, problem: MotionProblem,
                     solver: Solver) -> list[Extremal]:
    """Return the motions of the same arm made rigid up to one that is near its limit."""
    extremals: list[Extremal] = []
    try:
        rigid = rigid_problem(problem)
    except InvalidTaskError:  # motors that hold the bent arm may be too weak for the straight one
        return extremals
    first = cold_start(rigid, solver).result
    if not first.converged:
        return extremals
    for extremal in continue_in_price(parameter, rigid, first, solver,
                                      lambda value: _LIFT * value):
        extremals.append(extremal)
        if (extremal.interrupted or extremal.gap < _LIFT * extremal.value
                or len(extremals) == _MOST_RIGID):
            break
    return extremals


def lift_extremal(parameter: FreeParameter, problem: MotionProblem, rigid: list[Extremal],
                  solver: Solver) -> Extremal | None:
    """Return the flexible motion at the price of a rigid one that is near its limit, or None."""
    for extremal in reversed(rigid[-_LIFTS:]):
        if extremal.interrupted:
            return extremal
        found = transfer_extremal(parameter, problem, SearchStart.of(extremal), solver)
        if found is not None:
            return found
    return None


def transfer_extremal(parameter: FreeParameter, problem: MotionProblem, start: SearchStart,
                      solver: Solver) -> Extremal | None:
    """
    Return the motion at the price of another arm's or task's; None if there is none beyond.

    Parameters
    ----------
    parameter : FreeParameter
        What is free.
    problem : MotionProblem
        With the least demanding value that is of interest.
    start : SearchStart
        Of the other arm or task.
    solver : Solver
        Of the extremal.

    """
    solution = start.solution
    if solution.nodes.shape[1] not in (problem.size, 4 * problem.model.arm.n_joints):
        return None  # of an arm with other modes
    return parameter.solve_beyond(problem, start.value,
                                  lambda near: _fit(near, solution, solver), start.price, solver)


def _fit(problem: MotionProblem, solution: CollocationSolution,
         solver: Solver) -> CollocationSolution:
    """Return a motion of the same or of a rigid arm as a guess, stretched to the duration."""
    guess = solution.stretched(problem.task.duration / solution.mesh[-1])
    return guess if guess.nodes.shape[1] == problem.size else lift(problem, guess, solver)


def solve_first(problem: MotionProblem, solver: Solver) -> CollocationResult:
    """Return the first solution that strategies find, or the last failure: soon."""
    settings = solver.settings
    most = max(_FIRST_MESHES * problem.fewest_intervals(settings.stages), _FIRST_INTERVALS)
    quick = solver.patient(_FIRST_ITERATIONS).with_settings(
        max_intervals=min(most, settings.max_intervals), intervals=min(most, settings.intervals))
    result = cold_start(problem, quick).result
    for attempt in (lift_rigid_motion, raise_weights):
        if result.converged or result.status in INTERRUPTED:
            break
        tried = attempt(problem, quick)
        result = result if tried is None else tried.result
    return result
