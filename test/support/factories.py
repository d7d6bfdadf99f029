"""Types of the fixtures that build tasks and plans."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan

TaskFactory = Callable[..., Task]
PlanFactory = Callable[..., Plan]
