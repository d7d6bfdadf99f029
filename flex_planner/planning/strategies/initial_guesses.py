"""
Guesses that a motion is solved from at once: straight lines, the rigid arm, other solutions.

Each function is the `attempt` of a `Strategy`, see `catalogue`.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.errors import InvalidTaskError
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    INTERRUPTED,
    KnownSolution,
    Solver,
    SolverStatus,
)
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.conversion import to_solution
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.point_layout import TorqueRates
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.strategies.homotopies import lower_speed_price
from flex_planner.planning.strategies.quasi_static_lift import bend_quasi_statically
from flex_planner.planning.strategies.strategy import Attempt, Strategy
import numpy as np

WARM_START = 'warm start'
SMOOTHED = 'torques that may jump, then such that may not'

# intervals on which Newton's method takes ringing as linear, in units of those that overlook
# nothing, and the iterations of a first look on fewer
_FINE, _FIRST_LOOK = 6, 20
# of a mesh that shows no ringing
_COARSE_STAGES, _COARSE_INTERVALS = 3, (60, 40, 20)
# of the transcription
_DIRECT_INTERVALS, _DIRECT_STAGES, _DIRECT_ITERATIONS = 20, 4, 150


def cold_start(problem: MotionProblem, solver: Solver) -> Attempt:
    """Start from a straight line with zero costates."""
    return Attempt(result=solver.solve(problem, _straight(problem, solver)))


def _straight(problem: MotionProblem, solver: Solver) -> CollocationSolution:
    """Return the straight line on the first mesh."""
    intervals = max(solver.settings.intervals, problem.fewest_intervals(solver.settings.stages))
    return problem.straight_line(min(intervals, solver.settings.max_intervals),
                                 solver.settings.rule)


def lift_rigid_motion(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """
    Start from the motion of the same arm made rigid, bent as its forces bend the links.

    What rings many times is nearly linear, but not to a mesh with a few points per cycle: where
    such a mesh fails, a finer one is tried.

    """
    motion = solve_rigid(problem, solver)
    if motion is None or not motion.converged:
        return None if motion is None else Attempt(result=motion)
    fewest, settings = problem.fewest_intervals(solver.settings.stages), solver.settings
    rings = settings.intervals < fewest <= settings.max_intervals / _FINE
    first = solver.with_settings(
        max_iterations=min(_FIRST_LOOK, settings.max_iterations)) if rings else solver
    result = first.solve(problem, lift(problem, motion.solution, solver))
    if rings and result.status is SolverStatus.NEWTON_FAILED:
        mesh = np.linspace(0, problem.task.duration, _FINE * fewest + 1, dtype=np.float64)
        result = solver.solve(problem, bend_quasi_statically(problem, motion.solution, mesh,
                                                             settings.rule))
    return Attempt(result=result)


def solve_rigid(problem: MotionProblem, solver: Solver) -> CollocationResult | None:
    """
    Return the cheaper of two motions of the same arm made rigid, or the failure of the first.

    Under gravity the straight start may lead to a swing that costs several times as much as the
    motion that a price on all speeds leads to, and the other way round. None for an arm that is
    rigid itself.

    """
    if not problem.task.arm.n_passive:
        return None
    try:
        rigid = rigid_problem(problem)
    except InvalidTaskError:  # motors that hold the bent arm may be too weak for the straight one
        return None
    first = cold_start(rigid, solver).result
    if first.status in INTERRUPTED:
        return first
    solved = [each for each in (first, lower_speed_price(rigid, solver).result) if each.converged]
    return min(solved, default=first, key=lambda each: integrate_totals(rigid, each.solution).cost)


def lift(problem: MotionProblem, rigid: CollocationSolution,
         solver: Solver) -> CollocationSolution:
    """Return a motion of the rigid arm as a guess for the flexible one."""
    return bend_quasi_statically(problem, rigid, _straight(problem, solver).mesh,
                                 solver.settings.rule)


def coarse_mesh(problem: MotionProblem, solver: Solver) -> Attempt:
    """
    Start on meshes too coarse to show the ringing, then refine.

    Where several links move fast, Newton's method finds its way between few points, and what
    rings is nearly linear on top of that.

    """
    few = solver.with_settings(stages=_COARSE_STAGES, max_meshes=1, error_tolerance=1.0)
    for intervals in (min(count, solver.settings.max_intervals) for count in _COARSE_INTERVALS):
        guess = problem.straight_line(intervals, few.settings.rule)
        result = few.solve(problem, guess)
        if result.status not in (SolverStatus.CONVERGED, SolverStatus.MESH_LIMIT):
            continue
        coarse = result.solution
        finer = 2 * max(intervals, problem.fewest_intervals(solver.settings.stages))
        for count in (intervals, min(finer, solver.settings.max_intervals)):
            mesh = np.linspace(0, problem.task.duration, count + 1, dtype=np.float64)
            result = solver.solve(problem, coarse.on_mesh(mesh))
            if result.converged:
                return Attempt(result=result)
    return Attempt(result=result)


def rigid_problem(problem: MotionProblem) -> MotionProblem:
    """
    Return the task for the same arm made rigid, with the weights and ends of the joints.

    The joints begin and end where those of the flexible arm do, also where that puts the tip
    of the rigid one beside the point that was asked for: what is lifted from its motion then
    meets the boundary conditions.

    Raises
    ------
    InvalidTaskError
        If a motor is too weak to hold the rigid arm at the goal.

    """
    task, n, none = problem.task, problem.task.arm.n_joints, np.zeros(0)
    entries = ('position_weights', 'velocity_weights', 'start_velocities', 'goal_velocities',
               'goal_position_weights', 'goal_velocity_weights')
    rigid_task = replace(
        task, arm=task.arm.rigid(), start_positions=problem.start[:n],
        goal_positions=problem.goal[:n], start_point=none, goal_point=none,
        start_modal_displacements=none,
        path_constraints=tuple(one for one in task.path_constraints if not one.bends),
        **{name: getattr(task, name)[:n] for name in entries})
    return MotionProblem(ArmModel.of(rigid_task.arm), rigid_task,
                         problem.parameters.drop_modes())


def direct_collocation(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """
    Start from a coarse transcription solved by IPOPT, whose multipliers are the costates.

    Its scheme is a Gauss rule too, so that it gives a solution of the coarse equations. A flexible
    arm starts from the rigid motion that is bent by its forces, if there is one and its torques
    may jump.

    """
    if np.isfinite(problem.goal_weights).any() or problem.junctions.size:
        return None  # the transcription knows hard goals only, and no via points
    if problem.layout.torques and not (problem.task.starts_at_rest and problem.task.ends_at_rest):
        return None  # nor torques that are free at an end
    intervals = min(max(_DIRECT_INTERVALS, problem.fewest_intervals(_DIRECT_STAGES)),
                    solver.settings.max_intervals)
    direct = DirectProblem(problem.model, DirectSettings(
        scheme='gauss', degree=_DIRECT_STAGES, intervals=intervals, tolerance=1e-6,
        max_iterations=_DIRECT_ITERATIONS), rates=TorqueRates.of(problem))
    rigid = None if problem.layout.torques else solve_rigid(problem, solver)
    guess = lift(problem, rigid.solution, solver) if rigid and rigid.converged else None
    found = direct.solve(problem.parameters, problem.start, problem.goal,
                         problem.task.duration, guess=guess, monitor=solver.monitor)
    solver.monitor.check()
    return Attempt(result=solver.solve(problem, to_solution(found, problem)))


def warm_start(solution: CollocationSolution, name: str = WARM_START) -> Strategy:
    """Return a strategy that starts from a solution, stretched to the duration."""
    def attempt(problem: MotionProblem, solver: Solver) -> Attempt | None:
        if solution.nodes.shape[1] != problem.size:
            return None
        guess = solution.stretched(problem.task.duration / solution.mesh[-1])
        return Attempt(result=solver.solve(problem, guess,
                                           expected_error=solver.settings.error_tolerance))

    return Strategy(name, attempt, quick=True)


def restart(known: KnownSolution) -> Strategy:
    """Return a strategy that starts from what is known of a similar task, see `solve_near`."""
    def attempt(problem: MotionProblem, solver: Solver) -> Attempt | None:
        if known.solution.nodes.shape[1] != problem.size:
            return None
        factor = problem.task.duration / float(known.solution.mesh[-1])
        return Attempt(result=solver.solve_near(problem, known.stretched(factor)))

    return Strategy(WARM_START, attempt, quick=True)
