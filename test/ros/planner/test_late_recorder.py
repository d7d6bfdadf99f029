"""Recordings that are written after the answer, without a node."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import threading
import time
from typing import Any

from factories import PlanFactory
from flex_planner.base.errors import RecordingError
from flex_planner.planning.plan import Plan
from flex_planner.planning.residuals import find_motion_residuals
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.reports.recording.contents import RecordedRequest
from flex_planner.reports.recording.execution import carried_motion
from flex_planner.ros.planner.late_recorder import LateRecorder, once
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.replanner import Replanner
from flex_planner.ros.planner.request_planner import RequestPlanner
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.planner.running_plan import RunningPlan, RunningPlans, Track
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import MotionTask, PlanReport
import pytest


def test_all_that_waits_is_written_in_order_before_the_end() -> None:
    recorder, gate, written = LateRecorder(), threading.Event(), list[int]()
    recorder.add(lambda: gate.wait(10))
    for k in range(5):
        recorder.add(lambda k=k: written.append(k))  # type: ignore[misc]
    assert written == []
    assert recorder.close(0.01) == 6  # what it waits for, too
    gate.set()
    second = LateRecorder()
    for k in range(5):
        second.add(lambda k=k: written.append(k))  # type: ignore[misc]
    assert second.close(10) == 0
    assert written == [0, 1, 2, 3, 4]
    assert not second.ready


def test_one_that_fails_is_logged_and_others_are_written_before_the_answer(
        caplog: pytest.LogCaptureFixture) -> None:
    recorder, done = LateRecorder(), threading.Event()

    def fail() -> None:
        raise RecordingError('no space')

    recorder.add(fail)
    recorder.add(done.set)
    assert done.wait(10)
    assert not recorder.ready and 'no space' in caplog.text
    recorder.recover()
    assert recorder.ready
    assert recorder.close(10) == 0


def test_there_is_room_for_some_and_not_for_more() -> None:
    recorder, gate = LateRecorder(), threading.Event()
    for _ in range(101):
        recorder.add(lambda: gate.wait(10))
    assert not recorder.ready
    gate.set()
    assert recorder.close(10) == 0


def test_what_comes_after_the_end_is_told_as_lost(caplog: pytest.LogCaptureFixture) -> None:
    recorder, written = LateRecorder(), list[int]()
    assert recorder.close(1) == 0
    recorder.add(lambda: written.append(1))
    assert 'a recording after the answer is not written' in caplog.text
    assert (recorder.close(1), written) == (0, [])


def test_once_is_once() -> None:
    calls = list[int]()
    call = once(lambda: calls.append(1))
    call()
    call()
    assert calls == [1]


class Arm:
    """A planner whose arm moves, and what it is asked."""

    def __init__(self, plan: Plan, folder: Path) -> None:
        self._settings = replace(PlannerSettings.for_arm(plan.arm), replan_lead=0.3,
                                 recording_folder=str(folder))
        running, reference = RunningPlans(), sample_plan(plan, SamplingSettings())
        running.begin(RunningPlan(plan_id='first', plan=plan, begin_ns=0,
                                  track=Track.of(reference, 0)))
        self.planner = RequestPlanner(plan.model, OutcomeRecorder(plan.arm, '/flex_planner'),
                                      replanner=Replanner(running, lambda: 0))
        self._goal = (plan.problem.goal[:2] + 0.05).tolist()

    def ask(self, **parameters: Any) -> Outcome:
        """Return another plan."""
        message = MotionTask(replaces='first', publish=True, goal_positions=self._goal)
        state = RequestState(settings=replace(self._settings, **parameters))
        outcome = self.planner.plan(message, state)
        assert outcome.report.error_code == PlanReport.NONE, outcome.report.error_msg
        return outcome


@pytest.fixture
def arm(plan_of: PlanFactory, tmp_path: Path) -> Arm:
    return Arm(plan_of('ei50'), tmp_path)


def test_plan_in_motion_is_recorded_once_it_is_answered(arm: Arm, tmp_path: Path) -> None:
    outcome = arm.ask()
    assert outcome.record is not None and not list(tmp_path.iterdir())
    outcome.record()
    outcome.report.execution_error_string = 'of later'
    outcome.record()
    arm.planner.close(20)
    assert [str(folder) for folder in tmp_path.iterdir()] == [outcome.report.recording]
    read = RecordedRequest.read(outcome.report.recording).report
    assert (read.plan_id, read.execution_error_string) == (outcome.report.plan_id, '')
    assert arm.ask().record is None  # which is recorded at once, as nothing is later any more
    assert len(list(tmp_path.iterdir())) == 2


def test_plan_that_must_be_recorded_is_so_before_the_answer(arm: Arm, tmp_path: Path) -> None:
    outcome = arm.ask(recording_required=True)
    assert outcome.record is None
    recorded = RecordedRequest.read(outcome.report.recording)
    assert recorded.report.plan_id == outcome.report.plan_id
    # and can be carried out again, from where the arm moved
    assert outcome.plan is not None
    left = find_motion_residuals(carried_motion(recorded, outcome.plan.model)).responses[0]
    assert left.bending == pytest.approx(outcome.report.executed_residual_vibration, abs=1e-5)
    assert left.tip_error < 1e-3


def test_failure_is_told_by_the_plan_after_it(arm: Arm, tmp_path: Path) -> None:
    blocked = tmp_path / 'a file'
    blocked.touch()
    first = arm.ask(recording_folder=str(blocked))
    assert first.record is not None
    first.record()
    while arm.planner.records_later:
        time.sleep(0.001)
    second = arm.ask(recording_folder=str(blocked))
    assert 'NOT_RECORDED' in second.report.warning_kinds and second.record is None
    assert arm.ask().record is None and arm.ask().record is not None  # once it was possible
