"""Settings and the worker of a planner for the rigid arm, without a node."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flex_planner.arms.arm import Arm
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.request_planner import RequestPlanner
from flex_planner.ros.settings.planner import PlannerSettings
import pytest


@pytest.fixture
def settings(rigid_arm: Arm, tmp_path: Path) -> PlannerSettings:
    return replace(PlannerSettings.for_arm(rigid_arm), recording_folder=str(tmp_path))


@pytest.fixture
def worker(rigid_arm: Arm, rigid_model: ArmModel) -> RequestPlanner:
    return RequestPlanner(rigid_model, OutcomeRecorder(rigid_arm, '/flex_planner'))
