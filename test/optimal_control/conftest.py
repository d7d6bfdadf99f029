"""Plans of saturated motions that several test files share."""

from __future__ import annotations

from collections.abc import Callable

from factories import PlanFactory
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import pytest


@pytest.fixture(scope='session')
def crane_task(crane_model: ArmModel) -> Task:
    """Return a motion under gravity with all weights, on whose way motors saturate."""
    return Task(arm=crane_model.arm, start_positions=[-1.6, 0.2], goal_positions=[-1.2, -0.2],
                duration=0.5, payload_mass=0.2, payload_inertia=0.01, effort_weights=[0.5, 2.0],
                position_weights=[1, 2, 3, 4, 5], velocity_weights=[5, 4, 3, 2, 1])


@pytest.fixture(scope='session')
def saturated(crane_model: ArmModel, plan_of: PlanFactory,
              crane_task: Task) -> Callable[[str], Plan]:
    """Return plans of saturated motions."""
    crane = plan_path(crane_task, model=crane_model)
    assert crane.solved, crane.message
    return lambda name: crane if name == 'crane' else plan_of(name, 5.5)
