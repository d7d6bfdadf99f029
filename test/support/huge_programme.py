"""A programme whose derivation takes seconds, and each iteration of IPOPT about one."""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.progress import Monitor
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.result import DirectResult
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from plan_checks import problem_of


def huge_problem() -> MotionProblem:
    """Return the motion of three links with three modes each."""
    link = Link(length=0.5, linear_density=3.0, modes=3, flexural_rigidity=50.0)
    joint = Joint(motor=Motor(stall_torque=8.0, no_load_speed=3.5))
    arm = Arm(name='huge', links=(link,) * 3, joints=(joint,) * 3)
    task = Task(arm=arm, start_positions=[0.2, 0.8, 0.1], goal_positions=[0.6, 0.4, 0.1],
                duration=1.0)
    return problem_of(ArmModel.of(arm), task)


def solve_huge(problem: MotionProblem, monitor: Monitor) -> DirectResult:
    """Run IPOPT on a mesh much finer than need be."""
    direct = DirectProblem(problem.model, DirectSettings(intervals=300, degree=5))
    return direct.solve(problem.parameters, problem.start, problem.goal, 1.0, monitor=monitor)
