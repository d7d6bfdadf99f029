"""
Optimal paths for a given payload: Korayem et al. 2009, section 4.1.

`plan_path` is the library's main entry: a task goes in, a certified plan comes out.

"""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_problem import plan_problem
from flex_planner.planning.strategies.catalogue import CATALOGUE
from flex_planner.planning.strategies.initial_guesses import warm_start
from flex_planner.planning.strategies.strategy import Strategy
from flex_planner.planning.weight_search import adapt_weights


def plan_path(task: Task, *, model: ArmModel | None = None, solver: Solver | None = None,
              monitor: Monitor | None = None,
              start_from: Plan | CollocationSolution | None = None,
              objectives: Objectives | None = None,
              strategies: Sequence[Strategy] = CATALOGUE) -> Plan:
    """
    Plan the motion of a task that minimises eq. (6) within the motor limits of eq. (15).

    Parameters
    ----------
    task : Task
        The motion.
    model : ArmModel, optional
        Of the task's arm; compiled or read from disk if not given.
    solver : Solver, optional
        Of boundary-value problems: its settings, its monitor and its method.
    monitor : Monitor, optional
        Receives progress, and may cancel or limit the time; that of the solver if not given.
    start_from : Plan or CollocationSolution, optional
        A solved plan of a similar task, or its solution, tried first; any mesh, any duration, the
        same number of coordinates.
    objectives : Objectives, optional
        What the motion must keep besides: weights of the task are raised until it does, fig. 1
        of the paper. `Plan.objectives` tells how.
    strategies : sequence of Strategy, optional
        Ways to a solution in the order in which they are tried, at least one.

    Returns
    -------
    Plan
        Check `Plan.solved`: a failure is a status, not an exception.

    Raises
    ------
    InvalidTaskError
        If a motor is too weak to hold the arm at the goal, or an objective or the model does
        not go with the task.
    UnreachableError, SingularError
        If the arm, bent by gravity, cannot rest at a point of the task.
    ValueError
        If there are no strategies.

    """
    if not strategies:
        raise ValueError('strategies must name at least one way to a solution')
    model = ArmModel.for_arm(task.arm, model)  # before a clock starts
    solver = (solver or Solver()).watched_by(monitor)
    problem = MotionProblem(model, task, task_parameters(task))
    start = start_from.solution if isinstance(start_from, Plan) else start_from
    if start is not None:
        strategies = (warm_start(start), *strategies)
    if objectives is not None:
        objectives.check(task)
    plan = plan_problem(problem, solver, strategies)
    if objectives is None or not plan.solved:
        return plan
    return adapt_weights(plan, objectives, solver)
