"""Errors of the model that a motion must forgive, in messages."""

from __future__ import annotations

from flex_planner.base.errors import InvalidValueError
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.ros.messages.classes import MotionTask
from flex_planner.ros.messages.plans import objectives_from_message
from flex_planner.ros.messages.robustness import enter_robustness, robustness_from_message
import pytest


def test_request_says_what_to_forgive_under_the_nodes_controller() -> None:
    controller = JointController(gains=Gains.of(2, 40.0, 4.0))
    message = MotionTask(stiffness_error=0.1, payload_error=0.05, max_residual=0.001)
    objectives = objectives_from_message(message, controller)
    assert objectives is not None and objectives.robustness is not None
    found = objectives.robustness
    assert (found.stiffness_error, found.payload_error, found.max_residual) == (0.1, 0.05, 0.001)
    assert found.controller is controller
    again = MotionTask()
    enter_robustness(again, found)
    assert again.max_residual == 0.001 and again.payload_error == 0.05


def test_empty_request_asks_for_nothing() -> None:
    assert robustness_from_message(MotionTask()) is None
    assert objectives_from_message(MotionTask()) is None


@pytest.mark.parametrize('fields, message', [
    ({'stiffness_error': 0.1}, 'max_residual is 0.* > 0 where'),
    ({'max_residual': 0.001}, 'stiffness_error .* where payload_error is 0'),
    ({'max_residual': -1.0, 'stiffness_error': 0.1}, 'max_residual is -1'),
    ({'max_residual': float('nan')}, 'max_residual'),
])
def test_bad_field_is_named(fields: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        robustness_from_message(MotionTask(**fields))
