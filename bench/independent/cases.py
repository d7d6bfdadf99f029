"""Plans of random tasks, published as a node would, and carried out by the independent arm."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

from bench.independent.controller import Controller, Trajectory
from bench.independent.equations import Equations
from bench.independent.execution import carry_out, Figures, vibration
from bench.independent.random_arms import (
    between_points,
    random_arm,
    random_controller,
    random_motion,
)
from bench.independent.shapes import Array
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import judge_execution, sample_plan, SamplingSettings
from flex_planner.ros.messages.plans import add_reference, joint_trajectory, report_from_plan
import numpy as np

# how well figures agree: links are looked at in 41 places there and in 201 here, which may miss
# some thousandths of a wave; integrators are exact to 1e-8 of the state, times what an unstable
# motion makes of it [m]
MARGIN, FLOOR = 0.01, 1e-7
_TIME_LIMIT = 20.0
# of the tasks: between points, and with the largest payload
_POINTS, _LARGEST = 0.3, 0.15


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Published:
    """
    What leaves the planner.

    Attributes
    ----------
    task : Task
        What was asked for, with the payload that was found if the largest was.
    trajectory : trajectory_msgs.msg.JointTrajectory
        For the controller.
    report : flex_planner_interfaces.msg.PlanReport
        With the figures that are certified.
    words : str
        What kind of case it is.

    """

    task: Task
    trajectory: Any
    report: Any
    words: str


def published(seed: int) -> Published | None:
    """Return the plan of a seed; None if the planner does not publish one."""
    draw = np.random.default_rng([seed, 15, 2026])
    arm = random_arm(draw)
    motion, settings = random_motion(draw, arm), random_controller(draw, arm)
    points, largest = draw.random() < _POINTS, draw.random() < _LARGEST
    try:
        task = between_points(draw, arm, motion) if points else Task(arm=arm, **motion)
        plan = _planned(task, largest)
        return None if plan is None else _publish(task, plan, settings)
    except FlexPlannerError:  # a point out of reach, a posture that no motor holds
        return None


def _planned(task: Task, largest: bool) -> Plan | None:
    """Return a plan, with the largest payload if that is wanted."""
    monitor = Monitor(time_limit=_TIME_LIMIT)
    if largest:
        return find_max_payload(task, monitor=monitor, search='fast').plan
    return plan_path(task, monitor=monitor, search='fast')


def _publish(task: Task, plan: Plan, settings: SamplingSettings) -> Published | None:
    """Return what a node would make of a plan."""
    if not plan.solved:
        return None
    sampled = sample_plan(plan, settings)
    if not judge_execution(plan, sampled).solved:
        return None
    report = report_from_plan(plan)
    add_reference(report, plan, sampled)
    names = [f'joint_{k}' for k in range(task.arm.n_joints)]
    return Published(task=replace(task, payload_mass=plan.task.payload_mass), report=report,
                     trajectory=joint_trajectory(sampled, names),
                     words=_describe(task, plan, report))


def _describe(task: Task, plan: Plan, report: Any) -> str:
    """Return a line about a case."""
    arm = task.arm
    modes = ''.join(str(link.modes) for link in arm.links)
    words = [f'{arm.n_joints} links', f'{arm.links[0].mode_family} {modes}' if arm.n_modes
             else 'rigid', *(['gravity'] if arm.gravity.any() else []),
             *(['points'] if task.goal_point.size else []),
             f'{plan.task.payload_mass:.3g} kg' + (
                 ' (largest)' if plan.task.payload_mass != task.payload_mass else ''),
             f'{report.controller_rate:.0f} Hz {report.effort_hold}',
             *(['not shifted'] if not report.controller_period else [])]
    return ', '.join(words)


def carried_out(case: Published) -> Figures:
    """Return what the independent arm makes of a published trajectory."""
    task, report, arm = case.task, case.report, case.task.arm
    equations = Equations.of(arm, task.payload_mass, task.payload_inertia)
    trajectory = Trajectory.of(case.trajectory)
    controller = Controller(
        rate=report.controller_rate, hold=report.effort_hold,
        stiffness=np.array(report.controller_stiffness),
        damping=np.array(report.controller_damping))
    start = task.start_positions
    if task.start_point.size:
        start = trajectory.positions[0]
    goal = task.goal_point
    if not goal.size:
        goal = equations.tip(equations.rest(task.goal_positions))
    states = carry_out(equations, trajectory, controller, equations.rest(start), task.duration)
    size = arm.n_coordinates
    tips = [float(np.linalg.norm(equations.tip(state[:size]) - goal)) for state in states]
    left = [vibration(arm, equations, state) for state in states]
    return Figures(tip_error=tips[0], vibration=left[0], open_tip_error=tips[1],
                   open_vibration=left[1])


def certified(report: Any) -> Figures:
    """Return the figures of a report."""
    return Figures(
        tip_error=report.executed_tip_error, vibration=report.executed_residual_vibration,
        open_tip_error=report.open_loop_tip_error,
        open_vibration=report.open_loop_residual_vibration)


def start_error(case: Published) -> float:
    """Return how far the tip rests from the point where the motion should begin [m]."""
    task = case.task
    if not task.start_point.size:
        return 0.0
    equations = Equations.of(task.arm, task.payload_mass, task.payload_inertia)
    first: Array = np.array(case.trajectory.points[0].positions)
    return float(np.linalg.norm(equations.tip(equations.rest(first)) - task.start_point))


def ratios(case: Published) -> dict[str, float]:
    """Return what the independent arm does by what is certified, figure by figure [-]."""
    own, theirs = carried_out(case), certified(case.report)
    return {entry.name: (getattr(own, entry.name) + FLOOR) / (getattr(theirs, entry.name) + FLOOR)
            for entry in fields(Figures)}
