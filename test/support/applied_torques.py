"""Motions whose planned torques are applied."""

from __future__ import annotations

from functools import cache

from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.planned_torque import PlannedTorque
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from plan_checks import solution_of
import pytest

Case = str | tuple[str, float, float]
CASES: list[Case] = [
    ('rigid', 1.0, 0.0), ('rigid', 5.5, 200.0), ('ei5', 1.0, 0.0), ('ei5', 5.5, 0.0),
    ('ei50', 5.5, 0.0), 'crane']
every_case = pytest.mark.parametrize('case', CASES, ids=str)


def torque_of(plan: Plan) -> PlannedTorque:
    return PlannedTorque.of(plan.problem, solution_of(plan))


@cache
def crane_plan(model: ArmModel) -> Plan:
    """Return the plan of a quick motion under gravity."""
    plan = plan_path(Task(arm=model.arm, start_positions=[-1.6, 0.2],
                          goal_positions=[-1.2, -0.2], duration=0.5, payload_mass=0.2),
                     model=model)
    assert plan.saturation.min() > 0.1
    return plan
