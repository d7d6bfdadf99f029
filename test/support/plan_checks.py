"""What several test files ask of plans, by means that the planner does not use."""

from __future__ import annotations

import math

from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.dynamics.integration import simulate
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.planned_torque import PlannedTorque
from flex_planner.optimal_control.task import Task
from flex_planner.planning.certificate import Certificate
from flex_planner.planning.plan import Plan, PlanStatus
import numpy as np

# of J, relative, between two solutions whose unknowns have errors of 1e-6; four times what was
# found: J is stationary, but for the mesh errors at the switches
SAME_COST = 2e-8


def problem_of(model: ArmModel, task: Task) -> MotionProblem:
    return MotionProblem(model, task, task_parameters(task))


def solution_of(plan: Plan) -> CollocationSolution:
    assert plan.solution is not None, plan.message
    return plan.solution


def says_nothing(plan: Plan) -> bool:
    """Return whether a plan has no number that could pass for that of a motion."""
    return (plan.cost == plan.effort == plan.energy == math.inf
            and plan.certificate == Certificate())


def stopped_in(phase: str, status: PlanStatus, iterations: int = 0) -> Monitor:
    """Return a monitor that stops work so many iterations after a phase has begun."""
    monitor, begun = Monitor(), [0]

    def due() -> bool:
        begun[0] = begun[0] if monitor.phase == phase else monitor.iteration
        late = monitor.phase == phase and monitor.iteration >= begun[0] + iterations
        if late and status is PlanStatus.TIMEOUT:
            monitor.time_limit = -1.0
        return late and status is PlanStatus.CANCELED

    monitor.canceled = due
    return monitor


def share_of(problem: MotionProblem, solution: CollocationSolution) -> float:
    """Integrate dH/dm_p over a motion."""
    z = solution.stage_values().reshape(-1, problem.size)
    weights = (solution.steps[:, None] * solution.rule.weights).ravel()
    return float(weights @ problem.model.controls(z, problem.p).payload_share)


def end_state(plan: Plan, rtol: float = 1e-9) -> Array:
    """Return where the planned torques lead SciPy's integrator."""
    torque = PlannedTorque.of(plan.problem, solution_of(plan))
    return simulate(plan.model, plan.problem.parameters.physical, plan.problem.start, torque,
                    plan.task.duration,
                    rtol=rtol, atol=rtol / 100)


def tip_miss(plan: Plan, rtol: float = 1e-9) -> float:
    """Return the distance of the tip from the end that was planned, as SciPy has it [m]."""
    n_t = plan.arm.n_coordinates
    goal = plan.problem.target_state(solution_of(plan).nodes[-1, :2 * n_t])
    tips = tip_position(plan.arm, np.stack([end_state(plan, rtol)[:n_t], goal[:n_t]]))
    return float(np.linalg.norm(tips[0] - tips[1]))


def costates(plan: Plan, time: float) -> Array:
    """Return psi = (psi_1, psi_2) at a time, shape (2 n_t,)."""
    psi: Array = solution_of(plan)(np.array([time]))[0, plan.problem.size // 2:]
    return psi
