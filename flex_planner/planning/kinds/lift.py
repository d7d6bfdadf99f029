"""From a kind of motion of the rigid arm to a motion of the arm itself, at the same price."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.errors import FlexPlannerError
from flex_planner.collocation import INTERRUPTED, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.clusters import KindOfMotion
from flex_planner.planning.kinds.explorer import ExploredMotion
from flex_planner.planning.strategies.extremals import Extremal, SearchStart
from flex_planner.planning.strategies.first_extremals import lift_extremal, transfer_extremal
from flex_planner.planning.strategies.free_parameters import FreeParameter
from flex_planner.planning.strategies.initial_guesses import lift
from flex_planner.planning.strategies.ipopt_continuation import transcribe_at_price

# kinds that are lifted to a flexible arm
_LIFTED = 2
# a motion is of its kind if its value is no worse than this share
KEPT = 0.01
# shares by which a value is eased where its price leaves Newton's method no way
_EASIER = (1e-3, 3e-3, 6e-3)
# rigid motions that are lifted in turn: at these shares of the price
_CHEAPER = (1 / 2, 1 / 8, 1 / 64)
# by so much the price falls from one motion of a front to the one before; so many are enough
_BACK, _MOST_BACK = 4.0, 6


def solve_best_kind(parameter: FreeParameter, problem: MotionProblem,
                    kinds: Sequence[KindOfMotion], solver: Solver) -> Extremal | None:
    """
    Return the motion, solved exactly, that the best kind leads to; None if none does.

    Parameters
    ----------
    parameter : FreeParameter
        What is free.
    problem : MotionProblem
        With the least demanding value of interest, and no weights but R.
    kinds : sequence of KindOfMotion
        Of the arm made rigid, the best first.
    solver : Solver
        If its monitor interrupts it, the extremal says so.

    """
    if not problem.model.arm.n_passive:
        solved = (_solve_rigid(parameter, problem, kind.motion, solver) for kind in kinds)
        return next((one for one in solved if one is not None), None)
    best: Extremal | None = None
    for kind in kinds[:_LIFTED]:
        found = _lift(parameter, problem, kind.motion, solver)
        if found is not None and (best is None or found.interrupted
                                  or parameter.improves(found.value, best.value)):
            best = found
        if best is not None and best.interrupted:
            break
    return best


def _solve_rigid(parameter: FreeParameter, problem: MotionProblem, motion: ExploredMotion,
                 solver: Solver) -> Extremal | None:
    """
    Return the rigid arm's motion at the price of its kind, or with a little less than its value.

    A price so high moves the value far with every error of a guess; motions of given values are
    nearer. None if the kind is left.

    """
    start = SearchStart(value=motion.value, price=motion.price, solution=motion.solution)
    found = transfer_extremal(parameter, problem, start, solver)
    if found is not None and (found.interrupted or not parameter.falls_short(
            found.value, motion.value, KEPT)):
        return found
    tried = (_solve_eased(parameter, problem, motion, share, solver) for share in _EASIER)
    return next((one for one in tried if one is not None), None)


def _solve_eased(parameter: FreeParameter, problem: MotionProblem, motion: ExploredMotion,
                 share: float, solver: Solver) -> Extremal | None:
    """Return the rigid arm's motion with a value that is eased by a share; None without one."""
    value = parameter.ease(motion.value, share)
    if not parameter.improves(value, parameter.value(problem)):
        return None
    try:
        near = parameter.with_value(problem, value)
        guess = motion.solution.stretched(near.task.duration / motion.solution.mesh[-1])
        result = solver.solve(near, guess)
        price = parameter.price(near, result.solution) if result.converged else 0.0
    except FlexPlannerError:  # too heavy to hold
        return None
    if not (result.converged or result.status in INTERRUPTED):
        return None
    return Extremal(value=value, price=price, result=result, problem=near)


def _lift(parameter: FreeParameter, problem: MotionProblem, motion: ExploredMotion,
          solver: Solver) -> Extremal | None:
    """Return the flexible arm's motion that a rigid one leads to."""
    rigid = _rigid_extremals(parameter, motion, solver)
    found = lift_extremal(parameter, problem, rigid, solver)
    if found is not None:
        return found
    return transcribe_at_price(parameter, problem, motion.price, motion.value,
                               lambda near: lift(near, motion.solution, solver), solver)


def _rigid_extremals(parameter: FreeParameter, motion: ExploredMotion,
                     solver: Solver) -> list[Extremal]:
    """Return exact motions of the rigid arm at prices up to that of the exploration."""
    found: list[Extremal] = []
    problem, guess = motion.problem, motion.solution
    for share in _CHEAPER:
        try:
            extremal = parameter.solve_at_price(problem, guess, share * motion.price, solver)
        except FlexPlannerError:  # a payload too heavy to hold
            break
        if extremal is None or extremal.interrupted:
            break
        found.insert(0, extremal)
        problem, guess = extremal.problem, extremal.result.solution
    return found


def walk_back(parameter: FreeParameter, known: Extremal, least: float,
              solver: Solver) -> list[Extremal]:
    """
    Return motions of a rigid arm at lower and lower prices, the lowest first.

    They are the front of a limit that an exploration has found at once: what a little less takes.

    Parameters
    ----------
    parameter : FreeParameter
        What is free.
    known : Extremal
        Where the front ends.
    least : float
        Value at which it may begin.
    solver : Solver
        If its monitor interrupts the walk, it ends.

    """
    front: list[Extremal] = []
    here = known
    while not known.problem.model.arm.n_passive and len(front) < _MOST_BACK:
        try:
            found = parameter.solve_at_price(here.problem, here.result.solution,
                                             here.price / _BACK, solver)
        except FlexPlannerError:  # no payload at all
            break
        if found is None or found.interrupted or not parameter.improves(found.value, least):
            break
        if not parameter.improves(here.value, found.value):
            break
        front.insert(0, found)
        here = found
    return front
