"""What tests of objectives ask of plans, by samples of the motion."""

from __future__ import annotations

from typing import Any

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.objectives import Objectives, ObjectiveSearch
from flex_planner.planning.plan import Peaks, peaks, Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np

# of a peak, by the points between which it is: 1.2e-6 and 2.4e-4 where links ring
SEEN, RINGING = 5e-6, 5e-4


def within(model: ArmModel, task: Task, monitor: Monitor | None = None, **limits: Any) -> Plan:
    """Plan within limits; the weights are what matters, not the kind of motion."""
    return plan_path(task, model=model, objectives=Objectives(**limits), monitor=monitor,
                     search='fast')


def search_of(plan: Plan) -> ObjectiveSearch:
    assert plan.objectives is not None, plan.message
    return plan.objectives


def seen(plan: Plan) -> Peaks:
    return peaks(plan, plan.uniform_samples(4001))


def modal_peaks(plan: Plan) -> Array:
    rates: Array = np.abs(plan.uniform_samples(4001).rates[:, plan.arm.n_joints:]).max(axis=0)
    return rates
