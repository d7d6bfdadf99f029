"""What is asked of a plan that must forgive."""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import InvalidTaskError, InvalidValueError
from flex_planner.optimal_control.task import Task
from flex_planner.planning.robust.objective import Robustness
import pytest


@pytest.mark.parametrize('changes, message', [
    ({'max_residual': 0.0}, r'max_residual .* >= 1e-09 and <= 1000 m'),
    ({'max_residual': float('nan')}, 'max_residual'),
    ({'stiffness_error': -0.1}, 'stiffness_error .* >= 0 and <= 0.5'),
    ({'payload_error': 0.6}, 'payload_error .* >= 0 and <= 0.5'),
    ({'stiffness_error': 0.0, 'payload_error': 0.0}, 'stiffness_error .* where payload_error is'),
])
def test_bad_value_is_named_with_its_bound(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        Robustness(**{'max_residual': 1e-3, **changes})


def test_error_of_a_payload_needs_one(clamped_task: Task) -> None:
    task = Task(arm=clamped_task.arm, start_positions=clamped_task.start_positions,
                goal_positions=clamped_task.goal_positions, duration=1.0)
    with pytest.raises(InvalidTaskError, match='there is no payload'):
        Robustness(max_residual=1e-3, stiffness_error=0.0).check(task)
    Robustness(max_residual=1e-3).check(task)


def test_springs_of_joints_are_taken_as_known() -> None:
    arm = load_arm('scara_elastic')
    task = Task(arm=arm, start_positions=[0, 1, -0.1, 0], goal_positions=[1, 1, -0.1, 0],
                duration=1.0, payload_mass=1.0)
    with pytest.raises(InvalidTaskError, match='springs of joints are taken as known: give pay'):
        Robustness(max_residual=1e-3).check(task)
    Robustness(max_residual=1e-3, stiffness_error=0.0).check(task)
