"""The part of the node that runs in its worker thread, stopped where the solver is not at work."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from flex_planner.arm import Arm
from flex_planner.model import ArmModel
from flex_planner.progress import StoppedError, StopReason
from flex_planner.ros import planning
from flex_planner.ros.planning import Planning
from flex_planner.ros.recorder import OutcomeRecorder
from flex_planner.ros.settings import PlannerSettings
from flex_planner_interfaces.msg import PlanReport
import pytest
from ros_support import task


@pytest.fixture
def worker(rigid_arm: Arm, rigid_model: ArmModel) -> Planning:
    return Planning(rigid_model, OutcomeRecorder(rigid_arm, '/flex_planner'))


@pytest.fixture
def settings(rigid_arm: Arm, tmp_path: Path) -> PlannerSettings:
    return replace(PlannerSettings.for_arm(rigid_arm), recording_folder=str(tmp_path))


@pytest.mark.parametrize(('reason', 'code'), [
    (StopReason.TIMEOUT, PlanReport.TIMEOUT), (StopReason.CANCELED, PlanReport.CANCELED)])
def test_stop_after_the_solve_is_reported_without_a_trajectory(
        worker: Planning, settings: PlannerSettings, monkeypatch: pytest.MonkeyPatch,
        reason: StopReason, code: int) -> None:
    def stopped(*arguments: Any) -> None:
        raise StoppedError(reason)

    monkeypatch.setattr(planning, 'sample_reference', stopped)
    outcome = worker.plan(task(), settings, lambda: False)
    assert (outcome.report.error_code, outcome.report.error_msg) == (code, reason.value)
    assert not outcome.trajectory.points
    assert not outcome.publishable


def test_recording_that_is_told_to_stop_leaves_nothing_and_is_not_published(
        worker: Planning, settings: PlannerSettings, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    told = []  # once the samples are made, everyone is told to stop
    sample = planning.sample_reference

    def sampled(*arguments: Any) -> Any:
        reference = sample(*arguments)
        told.append(True)
        return reference

    monkeypatch.setattr(planning, 'sample_reference', sampled)
    outcome = worker.plan(task(), settings, lambda: bool(told))
    assert outcome.report.error_code == PlanReport.RECORDING_FAILED
    assert 'writing stopped after 0 of' in outcome.report.error_msg
    assert outcome.report.recording == ''
    assert not outcome.publishable
    assert list(tmp_path.iterdir()) == []
