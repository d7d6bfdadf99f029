"""
Plans whose torques have no jumps: their rates have a price, or bounds.

They are found from the motion whose torque may jump, which is near where the price is small; where
there is none, from a straight line: a price that is not small makes a motion easier to find.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution, follow_homotopy, Solver
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.torque_conditions import TorqueState
from flex_planner.optimal_control.via_points import free_times
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_problem import plan_problem, STOP_STATUS
from flex_planner.planning.strategies.initial_guesses import (
    cold_start,
    direct_collocation,
    SMOOTHED,
)
from flex_planner.planning.strategies.strategy import Attempt, Strategy
import numpy as np

# of the duration, over which torques turn at first in the homotopy, and its first step
_GENTLE, _FIRST_STEP = 1 / 20, 0.25
STIFF_LINKS = ('links or joints are so stiff that they are planned as rigid, which torques '
               'without jumps cannot be: make them rigid in the arm file, or leave '
               'torque_rate_weight and max_torque_rate out')


def refuse_torque_rates(task: Task, where: str) -> None:
    """
    Refuse a task that asks for rates of torques where nothing is known of them.

    Raises
    ------
    InvalidTaskError
        If it does.

    """
    for name in ('torque_rate_weight', 'max_torque_rate'):
        if getattr(task, name).size:
            raise InvalidTaskError(f'{name} is given, but must be left out of {where}')


def without_torque_rates(task: Task) -> Task:
    """Return the task whose torques may jump."""
    none = np.zeros(0)
    return replace(task, torque_rate_weight=none, max_torque_rate=none)


def plan_without_jumps(problem: MotionProblem, plain: Plan, solver: Solver) -> Plan:
    """
    Return the certified plan of a problem whose torques are states.

    The limits of the motors are not kept yet, see `keep_limits`.

    Parameters
    ----------
    problem : MotionProblem
        The motion.
    plain : Plan
        Of the task whose torques may jump, with a solution or without.
    solver : Solver
        Its monitor may interrupt the work.

    """
    if plain.status in STOP_STATUS.values():
        return replace(plain, task=problem.task, problem=problem, solution=None)
    strategies = [Strategy('cold start', cold_start, quick=True),
                  Strategy('homotopy in rates of torques', lower_rates),
                  Strategy('direct collocation', direct_collocation, cost=5.0)]
    if plain.solution is not None:
        strategies.insert(0, _smooth(plain))
    plan = plan_problem(_at_times_of(problem, plain), solver, strategies)
    return replace(plan, tried=(*plain.tried, *plan.tried))


def _at_times_of(problem: MotionProblem, plain: Plan) -> MotionProblem:
    """Return a problem whose free times are those of the motion whose torques may jump."""
    if plain.solution is None:
        return problem
    if problem.task.time_weight:
        return problem.with_changes(duration=plain.task.duration)
    free = free_times(problem.task.via_points)
    return problem.with_via_times(plain.via_times) if free else problem


def _smooth(plain: Plan) -> Strategy:
    """Return the strategy that starts from a motion whose torques may jump."""
    def attempt(problem: MotionProblem, solver: Solver) -> Attempt | None:
        assert plain.solution is not None
        guess = add_torques(problem, plain.problem, plain.solution)
        return Attempt(result=solver.solve(problem, guess))

    return Strategy(SMOOTHED, attempt, quick=True)


def lower_rates(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """Start with a higher price on rates without bounds; lower the price, and the bounds."""
    bounds, prices = problem.task.torque_rate_bounds, problem.task.torque_rate_prices
    gentle = np.maximum(prices, problem.task.effort_weights * (
        _GENTLE * problem.task.duration)**2)
    easy = _with_rates(problem, gentle, np.full(bounds.size, np.inf))
    result = cold_start(easy, solver).result
    if not result.converged:
        return Attempt(result=result)
    conditions = easy.conditions
    assert isinstance(conditions, TorqueState)
    rates = np.abs(conditions.torque_rates(result.solution.nodes)).max(axis=0)
    limited = np.isfinite(bounds)
    loose = np.where(limited, np.maximum(rates, bounds), 1.0)
    tight = np.where(limited, bounds, 1.0)

    def between(share: float) -> MotionProblem:
        some = np.where(limited, loose * (tight / loose)**share, np.inf)
        return _with_rates(problem, gentle * (prices / gentle)**share, some)

    return Attempt(result=follow_homotopy(between, result.solution, solver, _FIRST_STEP))


def _with_rates(problem: MotionProblem, prices: Array, bounds: Array) -> MotionProblem:
    """Return the problem with another price and other bounds of rates."""
    task = replace(problem.task, torque_rate_weight=prices, max_torque_rate=bounds)
    return MotionProblem(problem.model, task, problem.parameters,
                         via_times=problem.junctions if problem.junctions.size else None)


def add_torques(problem: MotionProblem, plain: MotionProblem,
                solution: CollocationSolution) -> CollocationSolution:
    """Return a motion with its torques among the unknowns, and costates of them that are zero."""
    torques = plain.controls(solution.mesh, solution.nodes).torque
    added = CollocationSolution.from_values(
        solution.mesh, np.hstack([torques, np.zeros_like(torques)]), solution.rule)
    return CollocationSolution(
        solution.mesh, np.hstack([solution.nodes, added.nodes]),
        np.concatenate([solution.stages, added.stages], axis=-1), solution.rule)
