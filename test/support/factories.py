"""Types of the fixtures that build tasks, plans and searches."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.capacity.results import MaxPayload
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
import pytest

TaskFactory = Callable[..., Task]
PlanFactory = Callable[..., Plan]
SearchFactory = Callable[[str], MaxPayload]


def model_of(request: pytest.FixtureRequest, name: str) -> ArmModel:
    """Return the model of an arm by the name of its fixture."""
    model: ArmModel = request.getfixturevalue(f'{name}_model')
    return model
