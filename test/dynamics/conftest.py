"""Plans whose torques are applied."""

from __future__ import annotations

from collections.abc import Callable

from applied_torques import Case, crane_plan
from factories import PlanFactory
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.plan import Plan
import pytest


@pytest.fixture(scope='session')
def any_plan(plan_of: PlanFactory, crane_model: ArmModel) -> Callable[[Case], Plan]:
    """Return plans of the paper's arms, and one under gravity; motors saturate in most."""
    return lambda case: crane_plan(crane_model) if isinstance(case, str) else plan_of(*case)
