"""Certified plans next to a limit that the interior-point method has reached."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from flex_planner.base.errors import FlexPlannerError
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.constrained_motion import relieve_ends, slacks_of
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_within_limits import (
    plan_from,
    plan_from_barrier,
    plan_smoothly,
)
from flex_planner.planning.strategies.free_parameters import FreeParameter, PAYLOAD
from flex_planner.planning.strategies.homotopies import drop_weights
from flex_planner.planning.strategies.payload_within_limits import refine_limit
from flex_planner.planning.strategies.reached_limit import ReachedLimit
import numpy as np

# shares by which a value is eased from what was reached, until a motion is certified: the first
# as little as the accuracy allows
_EASED = (0.0005, 0.001, 0.003, 0.01, 0.03, 0.1)
# of what the motors can just hold, kept clear of rounding
_HELD = 1 - 1e-9
# costates of a payload that is nearly endless in price, as those of a least effort
_COSTATES = 1e-3
# of a motion so near the limit
_MOST_INTERVALS = 600


def certify_reached(parameter: FreeParameter, problem: MotionProblem, reached: ReachedLimit,
                    accuracy: float, solver: Solver, *,
                    ringing: bool = False) -> tuple[ReachedLimit, float, Plan] | None:
    """
    Return what was reached, and that or a value a little easier with its plan; None without.

    Parameters
    ----------
    parameter : FreeParameter
        ``PAYLOAD``, which is at least that of the problem, or ``DURATION``.
    problem : MotionProblem
        Of the task.
    reached : ReachedLimit
        Where the barrier's end is known a plan begins with its slacks and multipliers, on its
        mesh; where torques switch too often for one, the motion is as the barrier has it.
    accuracy : float
        To which the limit is wanted [kg, s].
    solver : Solver
        Its monitor may interrupt the work.
    ringing : bool
        Whether Newton's method is known to fail, because torques switch too often.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    if reached.met is None:
        found = _certify_near(parameter, problem, reached.value, reached.motion, accuracy, solver)
        return None if found is None else (reached, *found)
    finer = _refine(problem, reached, accuracy, solver)
    limit = _hold(problem, finer or reached) if parameter is PAYLOAD else finer or reached

    def plan_at(near: MotionProblem, slacks: PathSlacks) -> Plan | None:
        return plan_from_barrier(near, slacks, reached.lower_price(near), solver)

    def certify(*shares: float) -> tuple[ReachedLimit, float, Plan] | None:
        found = _certify_eased(parameter, problem, limit.value, plan_at, shares)
        return None if found is None else (limit, *found)

    sharp = None if ringing and finer else certify(accuracy / (3 * limit.value))
    if sharp is not None:
        return sharp
    smooth = None if finer is None else _certify_smooth(problem, finer, limit, solver)
    return smooth or certify(*_EASED)


def _refine(problem: MotionProblem, reached: ReachedLimit, accuracy: float,
            solver: Solver) -> ReachedLimit | None:
    """Return what was reached on a mesh on which it stands; None without one."""
    slacks = None if problem.layout.torques else slacks_of(problem)
    if slacks is None:
        return None
    return refine_limit(drop_weights(problem), relieve_ends(problem, slacks), reached, solver,
                        accuracy)


def _hold(problem: MotionProblem, reached: ReachedLimit) -> ReachedLimit:
    """Return what was reached, but no more than the motors hold at the ends of the motion."""
    most = _HELD * holding_limit(problem.model, problem.task, problem.parameters)[0]
    return reached if reached.value <= most else replace(reached, value=most, gap=0.0)


def _certify_smooth(problem: MotionProblem, finer: ReachedLimit, limit: ReachedLimit,
                    solver: Solver) -> tuple[ReachedLimit, float, Plan] | None:
    """Return payload and plan of the motion as the barrier has it on a fine mesh, or None."""
    def plan_there(limit: MotionProblem, slacks: PathSlacks) -> Plan | None:
        return plan_smoothly(limit, slacks, finer.unloaded(), solver)

    found = _certify_eased(PAYLOAD, problem, limit.value, plan_there, (0.0,))
    return None if found is None else (limit, *found)


def _certify_near(parameter: FreeParameter, problem: MotionProblem, value: float,
                  motion: CollocationSolution, accuracy: float,
                  solver: Solver) -> tuple[float, Plan] | None:
    """Return a value a little easier than what was reached, and its plan, or None."""
    quick = solver.with_settings(max_intervals=min(_MOST_INTERVALS, solver.settings.max_intervals))

    def plan_at(limit: MotionProblem, slacks: PathSlacks) -> Plan | None:
        costates = np.ones(problem.size)
        costates[problem.layout.costates] = _COSTATES
        near = CollocationSolution(motion.mesh, motion.nodes * costates,
                                   motion.stages * costates, motion.rule)
        return plan_from(limit, slacks, near.stretched(limit.task.duration / motion.mesh[-1]),
                         quick)

    return _certify_eased(parameter, problem, value, plan_at, (accuracy / (3 * value), *_EASED))


def _certify_eased(parameter: FreeParameter, problem: MotionProblem, value: float,
                   plan_at: Callable[[MotionProblem, PathSlacks], Plan | None],
                   shares: Iterable[float]) -> tuple[float, Plan] | None:
    """Return the first of some values, easier by shares of it, with a plan; None without."""
    for share in shares:
        eased = parameter.ease(value, share)
        if parameter is PAYLOAD and eased < problem.task.payload_mass:
            return None
        try:
            limit = parameter.with_value(problem, eased)
            slacks = slacks_of(limit)
            plan = None if slacks is None else plan_at(limit, relieve_ends(limit, slacks))
        except FlexPlannerError:  # too heavy to hold
            continue
        if plan is not None:
            return eased, plan
    return None
