"""What less residual vibration costs."""

from __future__ import annotations

from flex_planner.base.errors import InvalidValueError
from flex_planner.control.joint_controller import JointController
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.effort_front import trace_effort_front
from flex_planner.planning.robust.objective import Robustness
import numpy as np
import pytest


def test_front_falls_as_effort_grows(clamped_plan: Plan, controller: JointController) -> None:
    robustness = Robustness(max_residual=1e-3, controller=controller)
    front = trace_effort_front(clamped_plan, robustness, [0.3, 1.0, 3.0])
    assert front.weights.tolist() == [0, 0.3, 1, 3]
    assert front.costs[0] == clamped_plan.cost and front.growth[0] == 0
    assert (np.diff(front.costs) > 0).all() and (np.diff(front.residuals) < 0).all()
    assert front.growth[-1] < 0.01 and front.residuals[-1] < 0.5 * front.residuals[0]
    assert (front.nominal < 0.01 * front.residuals).all()


def test_weights_must_rise(clamped_plan: Plan) -> None:
    robustness = Robustness(max_residual=1e-3)
    with pytest.raises(InvalidValueError, match='weights .* ascending'):
        trace_effort_front(clamped_plan, robustness, [1.0, 0.5])
    with pytest.raises(InvalidValueError, match='weights'):
        trace_effort_front(clamped_plan, robustness, [0.0])
