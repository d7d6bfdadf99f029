"""Ways to a first solution, tried in order; each has a name that the plan reports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    GaussRule,
    Settings,
    solve,
    Status,
)
from flex_planner.model import ArmModel
from flex_planner.motion import MotionProblem
from flex_planner.progress import Monitor
from flex_planner.task import Task
from flex_planner.validation import Array
import numpy as np

Strategy = Callable[[MotionProblem, Settings, Monitor], CollocationResult]

_WALK_FIRST = 10.0
_WALK_FACTOR = 10.0


def cold_start(problem: MotionProblem, settings: Settings, monitor: Monitor) -> CollocationResult:
    """Start from a straight line with zero costates."""
    guess = problem.straight_line(settings.intervals, GaussRule.of(settings.stages))
    return solve(problem, guess, settings, monitor)


def lifted_rigid_motion(problem: MotionProblem, settings: Settings,
                        monitor: Monitor) -> CollocationResult:
    """Start from the motion of the same arm made rigid, with zero bending."""
    arm = problem.task.arm
    rigid = solve_rigid(problem, settings, monitor)
    if not rigid.converged:
        return rigid
    mesh = problem.straight_line(settings.intervals, rigid.solution.rule).mesh
    coarse = rigid.solution.on_mesh(mesh)
    n, n_t = arm.n_joints, arm.n_coordinates
    joints = (np.arange(4)[:, None] * n_t + np.arange(n)).ravel()

    def lifted(values: Array) -> Array:
        full = np.zeros((*values.shape[:-1], 4 * n_t))
        full[..., joints] = values
        return full

    guess = CollocationSolution(mesh, lifted(coarse.nodes), lifted(coarse.stages), coarse.rule)
    return solve(problem, guess, settings, monitor)


def solve_rigid(problem: MotionProblem, settings: Settings,
                monitor: Monitor) -> CollocationResult:
    """Solve the task for the same arm made rigid, with the weights of the joints."""
    task, n = problem.task, problem.task.arm.n_joints
    rigid_task = Task(arm=task.arm.rigid(), start_positions=task.start_positions,
                      goal_positions=task.goal_positions, duration=task.duration,
                      payload_mass=task.payload_mass, payload_inertia=task.payload_inertia,
                      effort_weights=task.effort_weights,
                      position_weights=task.position_weights[:n],
                      velocity_weights=task.velocity_weights[:n])
    parameters = replace(problem.parameters, rigidity=np.zeros(n),
                         position_weights=rigid_task.position_weights,
                         velocity_weights=rigid_task.velocity_weights)
    rigid = MotionProblem(ArmModel(rigid_task.arm), rigid_task, parameters)
    return cold_start(rigid, settings, monitor)


def walked_weights(problem: MotionProblem, settings: Settings,
                   monitor: Monitor) -> CollocationResult:
    """Start without position and velocity weights and raise them tenfold at a time."""
    parameters = problem.parameters
    weights = np.concatenate([parameters.position_weights, parameters.velocity_weights])
    largest = float(weights.max(initial=0.0))
    factor = min(1.0, _WALK_FIRST / largest) if largest else 1.0
    coarse = replace(settings, defect_tolerance=1.0)
    guess = problem.straight_line(settings.intervals, GaussRule.of(settings.stages))
    for share in (0.0, *_walk(factor)):
        step = MotionProblem(problem.model, problem.task, replace(
            parameters, position_weights=share * parameters.position_weights,
            velocity_weights=share * parameters.velocity_weights))
        result = solve(step, guess, settings if share == 1.0 else coarse, monitor)
        # a mesh that is too coarse for the step before is still a good start
        if not result.converged and result.status is not Status.MESH_LIMIT:
            return result
        guess = result.solution
    return result


def _walk(factor: float) -> list[float]:
    """Return shares from a first one to 1, growing tenfold."""
    shares = []
    while factor < 1:
        shares.append(factor)
        factor *= _WALK_FACTOR
    return [*shares, 1.0]


LADDER: tuple[tuple[str, Strategy], ...] = (
    ('cold start', cold_start),
    ('rigid motion lifted', lifted_rigid_motion),
    ('weights walked up', walked_weights),
)
