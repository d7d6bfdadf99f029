"""The part of the node that runs in its worker thread: searches, and work that is stopped."""

from __future__ import annotations

from dataclasses import replace
import logging
import math
from pathlib import Path
import threading
import time
from typing import Any

from flex_planner.arms.arm import Arm, Joint
from flex_planner.base.progress import StoppedError, StopReason
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.uncertainty import Uncertainty
from flex_planner.recording import read_metadata
from flex_planner.reports.recording import RecordedRequest
from flex_planner.ros.planner import request_planner
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.request_planner import RequestPlanner
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.settings.planner import MIN_RECORDING_SIZE, PlannerSettings
from flex_planner_interfaces.msg import MotionTask, PayloadSearch, PlanReport
from geometry_msgs.msg import Point
import pytest
from ros_support import search_request, task


@pytest.mark.parametrize(('reason', 'code'), [
    (StopReason.TIMEOUT, PlanReport.TIMEOUT), (StopReason.CANCELED, PlanReport.CANCELED)])
def test_stop_after_the_solve_is_reported_without_a_trajectory(
        worker: RequestPlanner, settings: PlannerSettings, monkeypatch: pytest.MonkeyPatch,
        reason: StopReason, code: int) -> None:
    def stopped(*arguments: Any) -> None:
        raise StoppedError(reason)

    monkeypatch.setattr(request_planner, 'sample_plan', stopped)
    outcome = worker.plan(task(), RequestState(settings=settings))
    limit = '; allowed_planning_time is 30 s' if reason is StopReason.TIMEOUT else ''
    assert (outcome.report.error_code, outcome.report.error_msg) == (code, reason.value + limit)
    assert not outcome.trajectory.points
    assert not outcome.publishable


ANGLES = {'start_positions': [1.0, -2.0], 'goal_positions': [0.8, -1.5]}
ASSUMED = 'space is 0, as in a request without it, so that JOINT was assumed'


@pytest.mark.parametrize(('fields', 'code', 'warned'), [
    ({}, PlanReport.INVALID_SIZE, False),
    ({'start_point': Point(), 'goal_point': Point()}, PlanReport.INVALID_SIZE, False),
    (ANGLES, PlanReport.NONE, True),
    ({**ANGLES, 'start_point': Point(), 'goal_point': Point()}, PlanReport.NONE, False)])
def test_request_without_a_space_is_told_that_angles_were_assumed(
        worker: RequestPlanner, settings: PlannerSettings, fields: dict[str, Any], code: int,
        warned: bool) -> None:
    request = task(**{'space': MotionTask().space, **fields})
    report = worker.plan(request, RequestState(settings=settings)).report
    assert (report.error_code, report.space) == (code, 'JOINT')
    assert (ASSUMED in report.error_msg) == (code != PlanReport.NONE)
    assert ('SPACE_ASSUMED' in report.warning_kinds) == warned
    assert any(ASSUMED in sentence for sentence in report.warnings) == warned


def test_space_of_a_request_is_repeated_in_its_result(worker: RequestPlanner,
                                                      settings: PlannerSettings) -> None:
    for space, name in ((1, 'CARTESIAN'), (2, 'CARTESIAN_GOAL'), (3, '')):
        request = task(space=space, duration=-1.0, start_positions=[1.0, -2.0])
        report = worker.plan(request, RequestState(settings=settings)).report
        assert report.space == name
        assert ASSUMED not in report.error_msg


def test_trajectory_that_cannot_be_carried_out_is_not_published(
        worker: RequestPlanner, settings: PlannerSettings) -> None:
    # the damping is held for 10 ms, in which it turns the speed of the joints round
    slow = replace(settings, controller_rate=100.0, controller_damping=[1000.0, 1000.0])
    outcome = worker.plan(task(), RequestState(settings=slow))
    report = outcome.report
    assert report.error_code == PlanReport.CERTIFICATE_FAILED
    assert 'the trajectory cannot be carried out: executed tip error is' in report.error_msg
    assert 'the PD of the joints (100, 100 N m/rad and 1000, 1000 N m s/rad at 100 Hz' in (
        report.error_msg)
    assert report.executed_tip_error > 5e-3
    assert report.feedback_growth > 0
    assert not outcome.trajectory.points
    assert not outcome.publishable


def test_recording_that_is_told_to_stop_leaves_nothing_and_is_not_published(
        worker: RequestPlanner, settings: PlannerSettings, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    told = []  # once the samples are judged, everyone is told to stop
    assess = request_planner.assess_robustness

    def assessed(*arguments: Any, **options: Any) -> Any:
        robustness = assess(*arguments, **options)
        told.append(True)
        return robustness

    monkeypatch.setattr(request_planner, 'assess_robustness', assessed)
    outcome = worker.plan(task(), RequestState(settings=settings, stopping=lambda: bool(told)))
    assert outcome.report.error_code == PlanReport.RECORDING_FAILED
    assert 'writing stopped after 0 of' in outcome.report.error_msg
    assert outcome.report.recording == ''
    assert not outcome.publishable
    assert list(tmp_path.iterdir()) == []


def test_recording_that_is_abandoned_leaves_nothing(
        worker: RequestPlanner, settings: PlannerSettings, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    reached, go_on = threading.Event(), threading.Event()

    def stuck(*arguments: Any) -> None:
        reached.set()
        go_on.wait(10)

    monkeypatch.setattr(OutcomeRecorder, '_write_states', stuck)
    thread = threading.Thread(target=worker.plan, args=(task(), RequestState(settings=settings)))
    thread.start()
    assert reached.wait(20)
    (stage,) = tmp_path.iterdir()
    assert stage.name.startswith('.plan_path_')
    worker.abandon()
    assert list(tmp_path.iterdir()) == []
    go_on.set()
    thread.join(10)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('fields', [{}, {'duration': -1.0}])
def test_client_that_gives_up_is_recorded_as_canceled(
        worker: RequestPlanner, settings: PlannerSettings, tmp_path: Path,
        fields: dict[str, Any]) -> None:
    state = RequestState(settings=settings)
    state.withdraw()
    time.sleep(0.01)
    outcome = worker.plan(task(**fields), state)
    report = RecordedRequest.read(next(tmp_path.iterdir())).report
    assert report.error_code == outcome.report.error_code == PlanReport.CANCELED
    assert [str(path) for path in tmp_path.iterdir()] == [outcome.report.recording]
    assert report.planning_time.nanosec == state.elapsed_ns < 10**7


@pytest.mark.parametrize('bounds', [
    {'max_recordings': 2}, {'max_total_recording_size': MIN_RECORDING_SIZE}])
def test_old_recordings_are_removed_and_that_is_told(
        worker: RequestPlanner, settings: PlannerSettings, tmp_path: Path,
        bounds: dict[str, int], caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / 'notes.txt').write_text('precious')
    paths = []
    with caplog.at_level(logging.INFO, 'flex_planner'):
        for _ in range(12):
            wrong = task(duration=-1.0)
            state = RequestState(settings=replace(settings, **bounds))
            paths.append(worker.plan(wrong, state).report.recording)
    left = sorted(str(path) for path in tmp_path.iterdir() if path.is_dir())
    assert left == paths[len(paths) - len(left):]
    if 'max_recordings' in bounds:
        assert len(left) == 2
    else:
        sizes = [sum(file.stat().st_size for file in Path(path).iterdir()) for path in left]
        assert sum(sizes) <= MIN_RECORDING_SIZE < sum(sizes) + min(sizes) + 1000
    assert (tmp_path / 'notes.txt').read_text() == 'precious'
    gone = [path for path in paths if path not in left]
    assert [record.args[0] for record in caplog.records] == [Path(path) for path in gone]
    assert f'removed the recording {gone[0]} of' in caplog.messages[0]


def test_topics_of_a_recording_are_named_as_they_are_remapped(
        rigid_arm: Arm, rigid_model: ArmModel, settings: PlannerSettings) -> None:
    remapped = {'~/joint_trajectory': '/controller/joint_trajectory'}
    worker = RequestPlanner(rigid_model, OutcomeRecorder(
        rigid_arm, lambda name: remapped.get(name, name.replace('~', '/planner'))))
    path = worker.plan(task(), RequestState(settings=settings)).report.recording
    assert [entry.topic.name for entry in read_metadata(path).topics] == [
        '/planner/motion_task', '/planner/plan_report', '/controller/joint_trajectory',
        '/planner/flexible_trajectory', '/planner/reference_states']
    assert RecordedRequest.read(path).solved


def test_arms_that_differ_are_those_of_an_identification(
        ei5_model: ArmModel, settings: PlannerSettings) -> None:
    known = Uncertainty(stiffness=0.01, payload=0.02, payload_mass=1.0)
    worker = RequestPlanner(ei5_model, OutcomeRecorder(ei5_model.arm, '/flex_planner'),
                            uncertainty=known)
    state = RequestState(settings=replace(settings, record=False, feedback_gains=True))
    outcome = worker.plan(task(), state)
    report, gains = outcome.report, outcome.gains
    assert (report.stiffness_difference, report.payload_difference) == (0.01, 0.02)
    assert gains is not None
    assert {(abs(one.stiffness), abs(one.payload)) for one in gains.differences} == {
        (0.0, 0.0), (0.01, 0.02)}


def test_ticket_tells_how_far_a_plan_is(worker: RequestPlanner, settings: PlannerSettings) -> None:
    # a search for cheaper kinds would end on the mesh of another motion
    state = RequestState(settings=replace(settings, record=False, search='fast'))
    assert state.progress.iteration == 0
    outcome = worker.plan(task(), state)
    assert state.progress.iteration == outcome.report.iterations > 0
    assert state.progress.payload == 1.0
    assert state.progress.intervals == outcome.report.mesh_intervals


# The maximum payload


MOST = 5.855  # [kg], of the rigid arm in the paper's motion
MOST_EI5 = 5.742  # [kg], with links of 5 N m^2
ACCURACY = 2e-3  # [kg], of both, and twice the default of a request


def search(worker: RequestPlanner, settings: PlannerSettings, **fields: Any) -> Outcome:
    """Ask for the maximum payload of the motion of the paper with some fields changed."""
    return worker.find_max_payload(search_request(**fields), RequestState(settings=settings))


def check_failure(outcome: Outcome, code: int, text: str) -> None:
    """Require that a search failed with a reason, and left nothing to go by."""
    assert (outcome.report.error_code, outcome.publishable) == (code, False)
    assert text in outcome.report.error_msg
    assert outcome.search is not None
    assert (outcome.search.payload, outcome.search.payload_upper) == (0.0, math.inf)
    assert outcome.search.limiting_joint == -1
    assert not outcome.trajectory.points
    assert outcome.report.recording


def test_direct_search_finds_the_maximum_payload_and_its_motion(
        worker: RequestPlanner, settings: PlannerSettings) -> None:
    outcome = search(worker, settings)
    report, found = outcome.report, outcome.search
    assert outcome.publishable
    assert found is not None
    assert found.payload == pytest.approx(MOST, abs=ACCURACY)
    assert found.payload < found.payload_upper <= found.payload + settings.payload_accuracy
    assert (found.method, found.limiting_joint, found.held) == (PayloadSearch.DIRECT, 0, False)
    assert outcome.trajectory.payload_mass == found.payload
    assert report.tip_error < 1e-5
    assert max(report.peak_torque_shares) == pytest.approx(1, abs=1e-6)  # the limit is used up
    assert report.saturation[0] > 0.9


def test_flexible_arm_carries_less(ei5_model: ArmModel, settings: PlannerSettings) -> None:
    worker = RequestPlanner(ei5_model, OutcomeRecorder(ei5_model.arm, '/flex_planner'))
    outcome = search(worker, settings)
    assert outcome.report.error_code == PlanReport.NONE
    assert outcome.search is not None
    assert outcome.search.payload == pytest.approx(MOST_EI5, abs=ACCURACY)
    assert len(outcome.trajectory.modal_names) == 4


def test_incremental_search_takes_the_steps_of_the_request(worker: RequestPlanner,
                                                           settings: PlannerSettings) -> None:
    outcome = search(worker, settings, method=PayloadSearch.INCREMENTAL, payload_mass=5.0,
                     payload_accuracy=0.3, payload_step=0.5)
    assert outcome.publishable
    assert outcome.search is not None
    assert outcome.search.tried_payloads.tolist() == [5.5, 6.0, 5.75]
    assert outcome.search.tried_solved == [True, False, True]
    assert (outcome.search.payload, outcome.search.payload_upper) == (5.75, 6.0)
    assert outcome.trajectory.payload_mass == 5.75


def test_parameters_decide_where_the_request_does_not(worker: RequestPlanner,
                                                      settings: PlannerSettings) -> None:
    coarse = replace(settings, payload_accuracy=0.1, payload_step=0.9, record=False)
    found = search(worker, coarse).search
    assert found is not None
    assert (found.payload_accuracy, found.payload_step) == (0.1, 0.9)
    assert 10 * settings.payload_accuracy < found.payload_upper - found.payload <= 0.1


def test_search_from_more_than_the_maximum_finds_nothing(worker: RequestPlanner,
                                                         settings: PlannerSettings) -> None:
    outcome = search(worker, replace(settings, search='fast', allowed_planning_time=200.0),
                     payload_mass=7.0)
    check_failure(outcome, PlanReport.NOT_FOUND, 'no motion with 7 kg in 1 s was found')


@pytest.mark.parametrize(('fields', 'code', 'text'), [
    ({'method': 2}, PlanReport.OUT_OF_RANGE, 'method is 2, but must be'),
    ({'payload_accuracy': 1e-7}, PlanReport.OUT_OF_RANGE, 'payload_accuracy is 1e-07, but must'),
    ({'payload_accuracy': math.nan}, PlanReport.NOT_FINITE, 'payload_accuracy is nan, but must'),
    ({'payload_step': 1e-4}, PlanReport.OUT_OF_RANGE, 'payload_step is 0.0001, but must be'),
    ({'payload_step': math.inf}, PlanReport.NOT_FINITE, 'payload_step is inf, but must be'),
    ({'payload_mass': math.nan}, PlanReport.NOT_FINITE, 'payload_mass is nan, but must be'),
    ({'effort_weights': [1.0]}, PlanReport.INVALID_SIZE, 'effort_weights has 1 number, but'),
    ({'allowed_planning_time': 1e-9}, PlanReport.TIMEOUT, 'time limit reached'),
])
def test_search_that_cannot_be_done_says_why(worker: RequestPlanner, settings: PlannerSettings,
                                             fields: dict[str, Any], code: int,
                                             text: str) -> None:
    check_failure(search(worker, settings, **fields), code, text)


@pytest.mark.parametrize('method', [PayloadSearch.DIRECT, PayloadSearch.INCREMENTAL])
@pytest.mark.parametrize('looks', [0, 8])
def test_search_is_canceled_before_and_while_it_is_at_work(
        worker: RequestPlanner, settings: PlannerSettings, method: int, looks: int) -> None:
    left = iter(range(looks))
    state = RequestState(settings=replace(settings, record=False),
                         stopping=lambda: next(left, None) is None)
    outcome = worker.find_max_payload(search_request(method=method), state)
    assert (outcome.report.error_code, outcome.publishable) == (PlanReport.CANCELED, False)
    assert 0 <= outcome.report.iterations <= looks
    assert bool(outcome.report.iterations) == bool(looks)
    assert outcome.search is not None
    assert outcome.search.payload == 0.0


def test_arm_whose_motors_have_no_limit_has_no_maximum_payload(
        rigid_arm: Arm, settings: PlannerSettings) -> None:
    free = replace(rigid_arm, joints=(Joint(), Joint()))
    planner = RequestPlanner(ArmModel(free), OutcomeRecorder(free, '/flex_planner'))
    outcome = search(planner, settings)
    check_failure(outcome, PlanReport.INVALID_TASK, 'no motor of the arm has a stall torque')


def test_search_that_is_stopped_after_the_solve_has_no_payload(
        worker: RequestPlanner, settings: PlannerSettings,
        monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*arguments: Any) -> None:
        raise StoppedError(StopReason.TIMEOUT)

    monkeypatch.setattr(request_planner, 'sample_plan', stopped)
    check_failure(search(worker, settings), PlanReport.TIMEOUT, StopReason.TIMEOUT.value)


def test_search_that_breaks_is_reported_as_unknown(
        worker: RequestPlanner, settings: PlannerSettings,
        monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*arguments: Any, **options: Any) -> None:
        raise ZeroDivisionError('somewhere')

    monkeypatch.setattr(request_planner, 'find_max_payload', broken)
    check_failure(search(worker, settings), PlanReport.UNKNOWN, 'ZeroDivisionError: somewhere')


def test_payload_found_is_returned_but_not_published_if_it_cannot_be_recorded(
        worker: RequestPlanner, settings: PlannerSettings, tmp_path: Path) -> None:
    blocker = tmp_path / 'file'
    blocker.write_text('no folder')
    blocked = replace(settings, recording_folder=str(blocker / 'recordings'))
    outcome = search(worker, replace(blocked, recording_required=True))
    assert (outcome.report.error_code, outcome.publishable) == (PlanReport.RECORDING_FAILED, False)
    assert outcome.search is not None
    assert outcome.search.payload == pytest.approx(MOST, abs=ACCURACY)
    assert outcome.trajectory.points


@pytest.mark.parametrize('required', [True, False])
def test_execution_that_cannot_be_recorded_is_no_success_if_that_is_required(
        worker: RequestPlanner, settings: PlannerSettings, tmp_path: Path,
        required: bool) -> None:
    blocked = tmp_path / 'a file'
    blocked.write_text('')
    state = RequestState(settings=replace(settings, recording_folder=str(blocked),
                                          recording_required=required))
    report = PlanReport(execution_accepted=True)
    worker.record_execution(task(), state, report)
    assert report.error_code == (PlanReport.RECORDING_FAILED if required else PlanReport.NONE)
    assert report.warning_kinds == ([] if required else ['NOT_RECORDED'])
    sentence = report.error_msg if required else report.warnings[0]
    assert sentence.startswith('the plan was carried out, but its outcome could not be recorded: ')
    assert (report.execution_accepted, report.execution_recording) == (True, '')
    aborted = PlanReport(error_code=PlanReport.EXECUTION_ABORTED, error_msg='it gave up')
    worker.record_execution(task(), state, aborted)
    assert (aborted.error_code, aborted.error_msg) == (
        PlanReport.EXECUTION_ABORTED, 'it gave up')


def test_motion_cannot_start_where_the_arm_is_if_nobody_knows_that(
        worker: RequestPlanner, settings: PlannerSettings) -> None:
    outcome = worker.plan(task(start=MotionTask.CURRENT), RequestState(settings=settings))
    assert outcome.report.error_code == PlanReport.ARM_STATE_UNKNOWN
    assert outcome.report.error_msg == 'nobody knows where the arm is'
