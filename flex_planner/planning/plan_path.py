"""
Optimal paths for a given payload: Korayem et al. 2009, section 4.1.

`plan_path` is the library's main entry: a task goes in, a certified plan comes out.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from flex_planner.base.errors import HoldingError, InvalidTaskError
from flex_planner.base.processes import helper_processes
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, integer
from flex_planner.collocation import CollocationSolution, KnownSolution, Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds.clusters import KindOfMotion, MOST_KINDS
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.kinds.kinds_strategy import as_guess
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import plan_problem
from flex_planner.planning.plan_within_limits import check_ends, keep_limits, plan_again_within
from flex_planner.planning.proofs import (
    check_duration,
    find_doubt,
    find_proof,
    Proof,
    prove_not_held,
)
from flex_planner.planning.robust.make_robust import make_robust
from flex_planner.planning.smooth_torques import (
    plan_without_jumps,
    STIFF_LINKS,
    without_torque_rates,
)
from flex_planner.planning.stiff_links import find_stiff_links
from flex_planner.planning.strategies.catalogue import CATALOGUE
from flex_planner.planning.strategies.initial_guesses import restart, warm_start
from flex_planner.planning.strategies.strategy import Strategy
from flex_planner.planning.via_limits import check_via_points
from flex_planner.planning.warnings import find_arm_warnings, warn_of_price
from flex_planner.planning.weight_search import adapt_weights, check_objectives
from flex_planner.planning.within_model import keep_model
import numpy as np


def plan_path(task: Task, *, model: ArmModel | None = None, solver: Solver | None = None,
              monitor: Monitor | None = None,
              start_from: Plan | KindOfMotion | CollocationSolution | None = None,
              objectives: Objectives | None = None,
              strategies: Sequence[Strategy] = CATALOGUE,
              search: SearchEffort | str = SearchEffort.NORMAL) -> Plan:
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
    start_from : Plan, KindOfMotion or CollocationSolution, optional
        A solved plan of a similar task, or its solution, tried first; any mesh, any duration, the
        same number of coordinates. A plan lends its mesh and its errors, too, and errors of a
        hundred times the solver's tolerance will do, see `collocation.restart`. Or a kind of
        motion that a plan or a search has met.
    objectives : Objectives, optional
        What the motion must keep besides: weights of the task are raised until it does, fig. 1
        of the paper. `Plan.objectives` tells how.
    strategies : sequence of Strategy, optional
        Ways to a solution in the order in which they are tried, at least one.
    search : SearchEffort or str
        ``'fast'`` keeps to the kind of motion that the first strategy finds; ``'normal'`` looks
        for a cheaper one from up to 12 starts, ``'thorough'`` from 48, unless the plan starts
        from a given motion.

    Returns
    -------
    Plan
        Check `Plan.solved`: a failure is a status, not an exception.

    Raises
    ------
    InvalidTaskError
        If an objective or the model does not go with the task, the links buckle at rest, or the
        duration is absurdly short.
    UnreachableError, SingularError
        If the arm, bent by gravity, cannot rest at a point of the task.
    ValueError
        If there are no strategies.

    """
    if not strategies:
        raise ValueError('strategies must name at least one way to a solution')
    effort = SearchEffort.of(search)
    helper_processes()  # what the environment says is refused before anything is solved
    model = ArmModel.for_arm(task.arm, model)  # before a clock starts
    solver = (solver or Solver()).watched_by(monitor)
    parameters = task_parameters(task)
    try:
        problem = MotionProblem(model, task, parameters,
                                via_times=_known_times(task, start_from))
    except HoldingError as error:
        refused = MotionProblem(model, task, parameters, holds=False)
        return _impossible(refused, prove_not_held(error, task.payload_mass))
    if objectives is not None:
        objectives.check(task)
    proof = find_proof(problem)
    if proof is not None:
        return _impossible(problem, proof)
    check_duration(problem)
    doubt = find_doubt(problem)
    if doubt is not None:
        return _not_found(problem, doubt)
    broken = check_ends(problem) or check_via_points(problem)
    if broken:
        return _not_possible(problem, broken)
    if task.has_torque_rates:
        return _plan_smoothly(problem, solver, start_from, objectives, strategies, effort)
    plan = (_plan_as_rigid(problem, solver, start_from, objectives, strategies, effort)
            or _plan_again(problem, solver, start_from, objectives))
    if plan is not None:
        return _forgive(plan, objectives, solver)
    plan = plan_problem(problem, solver, (*_given(start_from, problem, solver), *strategies),
                        effort, substitutes=True)
    if plan.status in (PlanStatus.NOT_FOUND, PlanStatus.NOT_CONVERGED):
        proof = find_proof(problem, thorough=True)
        return plan if proof is None else replace(
            plan, status=PlanStatus.INFEASIBLE, message=str(proof))
    kept = _forgive(_keep(plan, solver, objectives, effort), objectives, solver)
    return _tell_price(kept, task.velocity_weights, plan.task.velocity_weights)


def _tell_price(plan: Plan, asked: Array, weights: Array) -> Plan:
    """Return a plan, with a warning if it was made with other velocity_weights than asked for."""
    if np.array_equal(asked, weights):
        return plan
    return replace(plan, warnings=(*plan.warnings, warn_of_price(weights)))


def _known_times(task: Task,
                 start: Plan | KindOfMotion | CollocationSolution | None) -> Array | None:
    """Return the times at which a given plan passes the via points of a task, if it does."""
    if not (isinstance(start, Plan) and start.via_times.size == len(task.via_points) > 0):
        return None
    times = start.via_times * (task.duration / start.task.duration)
    given = [via.time for via in task.via_points]
    known = np.array([time if wanted is None else wanted
                      for time, wanted in zip(times.tolist(), given, strict=True)])
    return known if (np.diff([0.0, *known, task.duration]) > 0).all() else None


def _forgive(plan: Plan, objectives: Objectives | None, solver: Solver) -> Plan:
    """Return the plan that forgives errors of the model, if that is asked and it can be made."""
    if objectives is None or objectives.robustness is None or not plan.certified:
        return plan
    if isinstance(plan.problem, ConstrainedMotion):
        return replace(plan, status=PlanStatus.OBJECTIVE_NOT_MET, message=(
            f'{PlanStatus.OBJECTIVE_NOT_MET.value}; max_residual is given, but limits on the way '
            'bend the motion, and such a motion cannot be made to forgive errors of the model'))
    return make_robust(plan, objectives, solver)


def plan_kind(task: Task, number: int, **options: Any) -> Plan:
    """
    Plan a motion of another kind than the best.

    Parameters
    ----------
    task : Task
        The motion.
    number : int
        0 or 1 for the best kind, 2 to 4 for another one of `Plan.kinds`.
    options
        Of `plan_path`.

    Raises
    ------
    InvalidTaskError
        If there are not so many kinds, or one of `plan_path`.
    InvalidValueError
        If the number breaks its bound.

    """
    integer('kind', number, at_least=0, at_most=MOST_KINDS)
    best = plan_path(task, **options)
    if number <= 1 or not best.solved:
        return best
    if number > len(best.kinds):
        raise InvalidTaskError(f'kind is {number}, but must be at most {len(best.kinds)}: so many '
                               f'kinds of motion were found from {best.starts} starts')
    chosen = best.kinds[number - 1]
    plan = plan_path(task, **{**options, 'start_from': chosen})
    others = tuple(kind for kind in best.kinds if kind is not chosen)
    return replace(plan, kinds=(*plan.kinds[:1], *others), starts=best.starts)


def _keep(plan: Plan, solver: Solver, objectives: Objectives | None,
          effort: SearchEffort) -> Plan:
    """Return a plan that meets its objectives and keeps its limits on the way."""
    # weights that meet an objective may well bring a motion back within its limits
    if objectives is not None and plan.certified:
        plan = adapt_weights(plan, objectives, solver)
    within = keep_model(keep_limits(plan, solver, effort), solver, effort)
    if within is plan or objectives is None:
        return within
    return check_objectives(within, plan.objectives, objectives)


def _plan_again(problem: MotionProblem, solver: Solver,
                start: Plan | KindOfMotion | CollocationSolution | None,
                objectives: Objectives | None) -> Plan | None:
    """Return the plan from a motion that limits on the way have bent; None from another one."""
    if isinstance(start, KindOfMotion):
        start_problem, solution = start.motion.problem, start.motion.solution
    elif isinstance(start, Plan) and start.solution is not None:
        start_problem, solution = start.problem, start.solution
    else:
        return None
    if objectives is not None or not isinstance(start_problem, ConstrainedMotion):
        return None
    return plan_again_within(problem, solution, solver)


def _plan_smoothly(problem: MotionProblem, solver: Solver,
                   start: Plan | KindOfMotion | CollocationSolution | None,
                   objectives: Objectives | None, strategies: Sequence[Strategy],
                   effort: SearchEffort) -> Plan:
    """Return the plan whose torques have no jumps, from one like it or from the one with jumps."""
    again = _plan_again(problem, solver, start, objectives)
    if again is not None:
        return again
    if isinstance(start, Plan) and start.solution is not None and start.problem.layout.torques:
        plan = plan_problem(problem, solver, tuple(_given(start, problem, solver)))
        if plan.certified:
            return _keep(plan, solver, objectives, effort)
    task = without_torque_rates(problem.task)
    stiff = find_stiff_links(MotionProblem(problem.model, task, problem.parameters), solver)
    if stiff is not None:
        return _not_found(problem, STIFF_LINKS)
    plain = plan_path(task, model=problem.model, solver=solver, start_from=start,
                      strategies=strategies, search=effort)
    if plain.status is PlanStatus.INFEASIBLE:  # nor is a motion whose torques are less free
        return replace(plain, task=problem.task, problem=problem)
    return _keep(plan_without_jumps(problem, plain, solver), solver, objectives, effort)


def _not_possible(problem: MotionProblem, why: str) -> Plan:
    """Return the plan of a task whose ends break a limit on the way."""
    return Plan(task=problem.task, status=PlanStatus.INFEASIBLE, message=why, strategy='',
                problem=problem, solution=None, warnings=find_arm_warnings(problem.model.arm))


def _impossible(problem: MotionProblem, proof: Proof) -> Plan:
    """Return the plan of a task that no motion does."""
    return Plan(task=problem.task, status=PlanStatus.INFEASIBLE, message=str(proof), strategy='',
                problem=problem, solution=None, warnings=find_arm_warnings(problem.model.arm))


def _plan_as_rigid(problem: MotionProblem, solver: Solver,
                   start: Plan | KindOfMotion | CollocationSolution | None,
                   objectives: Objectives | None, strategies: Sequence[Strategy],
                   effort: SearchEffort) -> Plan | None:
    """Return the plan of an arm whose stiff links are taken as rigid; None without any."""
    stiff = find_stiff_links(problem, solver)
    if stiff is None or (objectives is not None and objectives.max_modal_rates.size):
        return None
    solution = start.solution if isinstance(start, Plan) else start
    if isinstance(solution, CollocationSolution):
        solution = stiff.restrict(solution)
    if objectives is not None:  # rigid links leave nothing to forgive
        objectives = replace(objectives, robustness=None)
    plan = plan_path(stiff.task(), solver=solver, start_from=solution, objectives=objectives,
                     strategies=strategies, search=effort)
    return stiff.lift(plan, solver)


def _not_found(problem: MotionProblem, reason: str) -> Plan:
    """Return the plan of a task for which no motion was found."""
    return Plan(task=problem.task, status=PlanStatus.NOT_FOUND, message=reason, strategy='',
                problem=problem, solution=None, warnings=find_arm_warnings(problem.model.arm))


def _given(start: Plan | KindOfMotion | CollocationSolution | None, problem: MotionProblem,
           solver: Solver) -> Iterator[Strategy]:
    """Yield the strategy that starts from what was given."""
    if isinstance(start, KindOfMotion):
        yield warm_start(as_guess(problem, start, solver))
    if isinstance(start, Plan) and start.solution is not None:
        yield restart(_what_is_known(start, start.solution))
    if isinstance(start, CollocationSolution):
        yield warm_start(start)


def _what_is_known(plan: Plan, solution: CollocationSolution) -> KnownSolution:
    """Return a solved plan as what a similar one starts from."""
    certificate = plan.certificate
    errors = np.full(solution.nodes.shape[1], certificate.costate_error)
    errors[plan.problem.layout.states] = certificate.state_error
    return KnownSolution(
        solution=solution, residual=certificate.collocation_residual, errors=errors,
        switches=plan.switching_times)
