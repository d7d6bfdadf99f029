"""The paper's motion with an arm whose links are clamped, and with soft pinned ones."""

from __future__ import annotations

from flex_planner.arms.arm_files import load_arm
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import pytest


@pytest.fixture(scope='session')
def clamped_task() -> Task:
    return Task.between_points(load_arm('clamped_motors'), (0.5, 0.0), (0.5, 0.5), elbow=-1,
                               duration=1.0, payload_mass=1.0, effort_weights=[1 / 8, 1 / 8])


@pytest.fixture(scope='session')
def clamped_plan(clamped_task: Task) -> Plan:
    return plan_path(clamped_task, search='fast')


@pytest.fixture(scope='session')
def controller() -> JointController:
    return JointController(gains=Gains.of(2, 40.0, 4.0))
