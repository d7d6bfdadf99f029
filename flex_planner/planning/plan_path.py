"""
Optimal paths for a given payload: Korayem et al. 2009, section 4.1.

`plan_path` is the library's main entry: a task goes in, a certified plan comes out.

"""

from __future__ import annotations

from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationSolution, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_problem import LADDER, planned
from flex_planner.planning.strategies.initial_guesses import warm_start
from flex_planner.planning.weight_search import adapted

WARM_START = 'warm start'


def plan_path(task: Task, *, model: ArmModel | None = None, settings: SolverSettings | None = None,
              monitor: Monitor | None = None,
              start_from: Plan | CollocationSolution | None = None,
              objectives: Objectives | None = None) -> Plan:
    """
    Plan the motion of a task that minimises eq. (6) within the motor limits of eq. (15).

    Parameters
    ----------
    task : Task
        The motion.
    model : ArmModel, optional
        Of the task's arm; compiled or read from disk if not given.
    settings : SolverSettings, optional
        Of the boundary-value solver.
    monitor : Monitor, optional
        Receives progress, and may cancel or limit the time.
    start_from : Plan or CollocationSolution, optional
        A solved plan of a similar task, or its solution, tried first; any mesh, any duration, the
        same number of coordinates.
    objectives : Objectives, optional
        What the motion must keep besides: weights of the task are raised until it does, fig. 1
        of the paper. `Plan.objectives` tells how.

    Returns
    -------
    Plan
        Check `Plan.solved`: a failure is a status, not an exception.

    Raises
    ------
    InvalidTaskError
        If a motor is too weak to hold the arm at the goal, or an objective does not go with the
        task.

    """
    settings, monitor = settings or SolverSettings(), monitor or Monitor()
    model = model or ArmModel(task.arm)
    problem = MotionProblem(model, task, task_parameters(task))
    start = start_from.solution if isinstance(start_from, Plan) else start_from
    rungs = LADDER if start is None else ((WARM_START, warm_start(start)), *LADDER)
    if objectives is not None:
        objectives.check(task)
    plan = planned(problem, rungs, settings, monitor)
    if objectives is None or not plan.solved:
        return plan
    return adapted(plan, objectives, settings, monitor)
