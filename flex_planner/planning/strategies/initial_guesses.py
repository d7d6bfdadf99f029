"""
Ways to a first solution, tried in order; each has a name that the plan reports.

A strategy returns None where it has nothing to add: a walk in the weights of a task without any.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    GaussRule,
    solve,
    SolverSettings,
    SolverStatus,
)
from flex_planner.collocation.homotopy import loose, walk
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """
    What a strategy found.

    Attributes
    ----------
    result : CollocationResult
        A solution, or how far it came.
    evidence : str
        Why the motion is impossible; empty where nothing shows it.

    """

    result: CollocationResult
    evidence: str = ''


Strategy = Callable[[MotionProblem, SolverSettings, Monitor], Attempt | None]

# the smallest weight that a walk starts with, and what a walk in stiffness starts with
_FIRST_WEIGHT, _STIFFER = 1.0, 10.0
# first price of the kinetic energy of bending [1/s], and how far it falls before it is dropped
_CALM, _DECADES = 1.0, 5.0
# of the first mesh of a walk
_WALK_INTERVALS = 60
# of a mesh that shows no ringing
_COARSE_STAGES, _COARSE_INTERVALS = 3, (60, 40, 20)
# of the transcription
_DIRECT_INTERVALS, _DIRECT_STAGES, _DIRECT_ITERATIONS = 20, 4, 150


def cold_start(problem: MotionProblem, settings: SolverSettings, monitor: Monitor) -> Attempt:
    """Start from a straight line with zero costates."""
    return Attempt(result=solve(problem, _straight(problem, settings), settings, monitor))


def _straight(problem: MotionProblem, settings: SolverSettings) -> CollocationSolution:
    """Return the straight line on the first mesh."""
    intervals = max(settings.intervals, problem.fewest_intervals(settings.stages))
    return problem.straight_line(min(intervals, settings.max_intervals), settings.rule)


def lifted_rigid_motion(problem: MotionProblem, settings: SolverSettings,
                        monitor: Monitor) -> Attempt | None:
    """Start from the motion of the same arm made rigid, bent as gravity bends the ends."""
    if not problem.task.arm.n_modes:
        return None
    rigid = cold_start(rigid_problem(problem), settings, monitor).result
    if not rigid.converged:
        return Attempt(result=rigid)
    guess = lifted(problem, rigid.solution, settings)
    return Attempt(result=solve(problem, guess, settings, monitor))


def lifted(problem: MotionProblem, rigid: CollocationSolution,
           settings: SolverSettings) -> CollocationSolution:
    """Return a motion of the rigid arm as a guess for the flexible one."""
    arm = problem.task.arm
    mesh = _straight(problem, settings).mesh
    coarse = rigid.on_mesh(mesh, settings.rule)
    n, n_t = arm.n_joints, arm.n_coordinates
    joints = (np.arange(4)[:, None] * n_t + np.arange(n)).ravel()

    def widened(values: Array) -> Array:
        full = np.zeros((*values.shape[:-1], 4 * n_t))
        full[..., joints] = values
        return full

    nodes, stages = widened(coarse.nodes), widened(coarse.stages)
    bends = problem.start[n:n_t], problem.goal[n:n_t]  # as gravity bends the arm
    way = (mesh / mesh[-1])[:, None]
    nodes[:, n:n_t] = bends[0] + way * (bends[1] - bends[0])
    stages[..., n:n_t] = (bends[1] - bends[0]) / mesh[-1]
    return CollocationSolution(mesh, nodes, stages, coarse.rule)


def coarse_mesh(problem: MotionProblem, settings: SolverSettings, monitor: Monitor) -> Attempt:
    """
    Start on meshes too coarse to show the ringing, then refine.

    Where several links move fast, Newton's method finds its way between few points, and what
    rings is nearly linear on top of that.

    """
    few = replace(settings, stages=_COARSE_STAGES, max_meshes=1, error_tolerance=1.0)
    for intervals in (min(count, settings.max_intervals) for count in _COARSE_INTERVALS):
        guess = problem.straight_line(intervals, few.rule)
        result = solve(problem, guess, few, monitor)
        if result.status not in (SolverStatus.CONVERGED, SolverStatus.MESH_LIMIT):
            continue
        coarse = result.solution
        finer = 2 * max(intervals, problem.fewest_intervals(settings.stages))
        for count in (intervals, min(finer, settings.max_intervals)):
            mesh = np.linspace(0, problem.task.duration, count + 1, dtype=np.float64)
            result = solve(problem, coarse.on_mesh(mesh), settings, monitor)
            if result.converged:
                return Attempt(result=result)
    return Attempt(result=result)


def rigid_problem(problem: MotionProblem) -> MotionProblem:
    """Return the task for the same arm made rigid, with the weights of the joints."""
    task, n = problem.task, problem.task.arm.n_joints
    entries = ('position_weights', 'velocity_weights', 'start_velocities', 'goal_velocities',
               'goal_position_weights', 'goal_velocity_weights')
    rigid_task = replace(task, arm=task.arm.rigid(), **{
        name: getattr(task, name)[:n] for name in entries})
    parameters = replace(problem.parameters, rigidity=np.zeros(n),
                         position_weights=problem.parameters.position_weights[:n],
                         velocity_weights=problem.parameters.velocity_weights[:n])
    return MotionProblem(ArmModel(rigid_task.arm), rigid_task, parameters)


def walked_weights(problem: MotionProblem, settings: SolverSettings,
                   monitor: Monitor) -> Attempt | None:
    """Start without position and velocity weights and raise them tenfold at a time."""
    if not has_weights(problem):
        return None
    at, first_step = _weighted(problem)
    return _walked(at, settings, monitor, first_step)


def weights_raised(problem: MotionProblem, solution: CollocationSolution, settings: SolverSettings,
                   monitor: Monitor) -> CollocationResult:
    """Start from the motion of the same task without position and velocity weights."""
    if not has_weights(problem):
        return solve(problem, solution, settings, monitor)
    at, first_step = _weighted(problem)
    return walk(at, solution, settings, monitor, first_step)


def has_weights(problem: MotionProblem) -> bool:
    """Return whether anything but effort counts on the way."""
    parameters = problem.parameters
    return bool(parameters.position_weights.any() or parameters.velocity_weights.any())


def without_weights(problem: MotionProblem) -> MotionProblem:
    """Return the problem with nothing but effort to count on the way."""
    return _weighted(problem)[0](0.0)


def _weighted(problem: MotionProblem) -> tuple[Callable[[float], MotionProblem], float]:
    """Return the problem with its weights raised a share of the way, and the first share."""
    parameters = problem.parameters
    weights = np.concatenate([parameters.position_weights, parameters.velocity_weights])
    decades = np.log10(max(float(weights.max()) / _FIRST_WEIGHT, 1.0))

    def at(way: float) -> MotionProblem:
        share = 10.0 ** (decades * (way - 1)) if way else 0.0
        return _with(problem, position_weights=share * parameters.position_weights,
                     velocity_weights=share * parameters.velocity_weights)

    return at, 1 / (1 + decades)


def walked_vibration(problem: MotionProblem, settings: SolverSettings,
                     monitor: Monitor) -> Attempt | None:
    """
    Start with a price on the bending rates, which keeps the links from ringing, and lower it.

    Links that bend at their ends are driven by the hub torques so directly that a motion of
    least effort lets them ring. Many motions that ring are stationary, or nearly so; the one
    without is alone.

    """
    if not problem.model.arm.n_modes:
        return None
    return _walked(_calmed(problem), settings, monitor, first_step=1 / _DECADES)


def walked_stiffness(problem: MotionProblem, settings: SolverSettings,
                     monitor: Monitor) -> Attempt | None:
    """Start with stiffer links and a price on the bending rates; soften, then lower the price."""
    if not problem.model.arm.n_modes:
        return None
    calmed = _calmed(problem)(0.0)

    def softened(way: float) -> MotionProblem:
        stiffer = _STIFFER ** (1 - way)
        return _with(calmed, rigidity=stiffer * problem.parameters.rigidity)

    soft = _walked(softened, loose(settings), monitor, first_step=0.25)
    if not soft.result.converged:
        return soft
    return Attempt(result=walk(_calmed(problem), soft.result.solution, settings, monitor,
                               first_step=1 / _DECADES))


def _calmed(problem: MotionProblem) -> Callable[[float], MotionProblem]:
    """Return the problem with a price on the kinetic energy of bending, falling to none."""
    n = problem.model.arm.n_joints
    mass = np.diag(problem.model.mass_and_energy(
        problem.start[None], problem.parameters.physical)[0][0])
    added = np.concatenate([np.zeros(n), mass[n:]])

    def at(way: float) -> MotionProblem:
        price = _CALM * 10.0 ** (-_DECADES * way) if way < 1 else 0.0
        weights = problem.parameters.velocity_weights + price * added
        return _with(problem, velocity_weights=weights)

    return at


def _with(problem: MotionProblem, **changes: Any) -> MotionProblem:
    """Return a problem with other parameters."""
    return MotionProblem(problem.model, problem.task, replace(problem.parameters, **changes))


def _walked(problem_at: Callable[[float], MotionProblem], settings: SolverSettings,
            monitor: Monitor,
            first_step: float) -> Attempt:
    """Solve the first problem from a straight line and walk from there."""
    first = problem_at(0.0)
    guess = first.straight_line(min(_WALK_INTERVALS, settings.max_intervals), settings.rule)
    result = solve(first, guess, loose(settings), monitor)
    if result.converged:
        result = walk(problem_at, result.solution, settings, monitor, first_step)
    return Attempt(result=result)


def direct_collocation(problem: MotionProblem, settings: SolverSettings,
                       monitor: Monitor) -> Attempt | None:
    """
    Start from a coarse transcription solved by IPOPT, whose multipliers are the costates.

    Its scheme is a Gauss rule too, so that it gives a solution of the coarse equations.

    """
    if np.isfinite(problem.goal_weights).any():
        return None  # the transcription knows hard goals only
    intervals = min(max(_DIRECT_INTERVALS, problem.fewest_intervals(_DIRECT_STAGES)),
                    settings.max_intervals)
    direct = DirectProblem(problem.model, DirectSettings(
        scheme='gauss', degree=_DIRECT_STAGES, intervals=intervals, tolerance=1e-6,
        max_iterations=_DIRECT_ITERATIONS))
    found = direct.solve(problem.parameters, problem.start, problem.goal,
                         problem.task.duration, monitor=monitor)
    monitor.check()
    mesh = np.linspace(0, problem.task.duration, intervals + 1, dtype=np.float64)
    points = np.hstack([found.point_states, found.point_costates])
    rates = problem.rate(found.point_times, points).reshape(intervals, _DIRECT_STAGES, -1)
    guess = CollocationSolution(mesh, np.hstack([found.states, found.costates]), rates,
                                GaussRule.of(_DIRECT_STAGES))
    return Attempt(result=solve(problem, guess, settings, monitor))


def warm_start(solution: CollocationSolution) -> Strategy:
    """Return a strategy that starts from a solution, stretched to the duration."""
    def strategy(problem: MotionProblem, settings: SolverSettings,
                 monitor: Monitor) -> Attempt | None:
        if solution.nodes.shape[1] != problem.size:
            return None
        guess = solution.stretched(problem.task.duration / solution.mesh[-1])
        return Attempt(result=solve(problem, guess, settings, monitor,
                                    expected_error=settings.error_tolerance))

    return strategy


DIRECTLY: tuple[tuple[str, Strategy], ...] = (
    ('cold start', cold_start),
    ('rigid motion lifted', lifted_rigid_motion),
    ('weights walked up', walked_weights),
)
QUICK = (*DIRECTLY, ('coarse mesh first', coarse_mesh))
THOROUGH: tuple[tuple[str, Strategy], ...] = (
    ('vibration weights walked down', walked_vibration),
    ('stiffness walked down', walked_stiffness),
    ('direct collocation', direct_collocation),
)
