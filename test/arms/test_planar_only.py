"""What knows planar arms only says so of spatial ones, and draws or bounds nothing wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flex_planner.arms.inverse_kinematics import workspace
from flex_planner.arms.kinematics import frame_angles
from flex_planner.arms.planar_only import PlanarOnlyError
from flex_planner.dynamics.rigid_inertia import RigidInertia
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.holding import knows_holding
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.proofs import (
    bound_duration,
    bound_payload,
    find_proof,
    is_payload_bounded,
)
from flex_planner.planning.proofs.short_durations import rigid_bound
import numpy as np
import pytest
from spatial_arms import yaw_pitch

ARM = yaw_pitch()


def task() -> Task:
    return Task(arm=ARM, start_positions=[0, 0], goal_positions=[1, 1], duration=1.0)


@pytest.mark.parametrize('make', [
    lambda: workspace(ARM),
    lambda: frame_angles(ARM, np.zeros(4)),
    lambda: RigidInertia.of(ARM, 1.0, 0.0),
])
def test_spatial_arms_are_refused(make: Callable[[], Any]) -> None:
    with pytest.raises(PlanarOnlyError, match="arm is 'yaw and pitch', but must be a planar one"):
        make()


def test_nothing_is_proved_of_spatial_arms() -> None:
    problem = MotionProblem(ArmModel.of(ARM), task(), task_parameters(task()))
    assert not knows_holding(ARM)
    assert find_proof(problem, thorough=True) is None
    assert bound_duration(problem) == rigid_bound(problem) == 0
    assert np.isinf(bound_payload(problem).payload)
    assert not is_payload_bounded(problem)
