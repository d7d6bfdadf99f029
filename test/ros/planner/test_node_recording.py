"""Recordings of the planner node, read by libraries that we did not write."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
import shutil
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from factories import PlanFactory
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import find_arm_file
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import sample_plan
from flex_planner.reports.recording import RecordedRequest
from flex_planner.ros.messages.plans import (
    flexible_trajectory,
    joint_trajectory,
    report_from_plan,
)
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.recorder import OutcomeRecorder
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.settings.planner import MIN_RECORDING_SIZE, PlannerSettings
from flex_planner_interfaces.msg import (
    FlexibleTrajectory,
    MotionTask,
    PayloadSearch,
    PlanReport,
)
from flex_planner_interfaces.srv import FindMaxPayload, PlanPath
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from ros_support import Planner, search_request, task
from rosbags.highlevel import AnyReader
from trajectory_msgs.msg import JointTrajectory
import yaml

NODE = '/flex_planner'
SMALLEST = MIN_RECORDING_SIZE
STAMP = 1_700_000_000_000_000_005  # [ns]
TYPES = {
    f'{NODE}/motion_task': 'flex_planner_interfaces/msg/MotionTask',
    f'{NODE}/plan_report': 'flex_planner_interfaces/msg/PlanReport',
    f'{NODE}/joint_trajectory': 'trajectory_msgs/msg/JointTrajectory',
    f'{NODE}/flexible_trajectory': 'flex_planner_interfaces/msg/FlexibleTrajectory',
    f'{NODE}/reference_states': 'sensor_msgs/msg/JointState',
}


class Found(NamedTuple):
    """A message of a recording: topic, type, log time [ns], content."""

    topic: str
    kind: str
    time: int
    message: Any


def plain(message: Any, like: Any) -> Any:
    """Return a message of any library as dicts, lists and numbers, by the fields of rclpy's."""
    if hasattr(like, 'get_fields_and_field_types'):
        return {name: plain(getattr(message, name), getattr(like, name))
                for name in like.get_fields_and_field_types()}
    if isinstance(like, list) and like and not isinstance(like[0], str):
        return [plain(a, b) for a, b in zip(message, like, strict=True)]
    return list(message) if hasattr(like, '__len__') and not isinstance(like, str) else message


def read_by_rosbags(folder: Path) -> list[Found]:
    with AnyReader([folder]) as reader:
        return [Found(connection.topic, connection.msgtype, time,
                      reader.deserialize(data, connection.msgtype))
                for connection, time, data in reader.messages()]


def read_by_mcap(folder: Path) -> list[Found]:
    with next(folder.glob('*.mcap')).open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [Found(channel.topic, schema.name, record.log_time, message)
                for schema, channel, record, message in reader.iter_decoded_messages() if schema]


READERS = pytest.mark.parametrize('read', [read_by_rosbags, read_by_mcap])


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob('*.mcap'))


def only(found: list[Found], topic: str) -> Found:
    """Return the message of a topic that has one."""
    (message,) = [entry for entry in found if entry.topic == f'{NODE}/{topic}']
    return message


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    folder = tmp_path_factory.mktemp('recorded')
    path = folder / 'arm.yaml'
    shutil.copy(find_arm_file('korayem_ei50'), path)
    path.with_name('arm_identification.yaml').write_text(yaml.safe_dump({'parameters': [
        {'name': name, 'value': value, 'half_width': share * value, 'spread': None,
         'verdict': 'identified'} for name, value, share in (
             ('payload_mass', 0.8, 0.02), ('links[0].flexural_rigidity', 50, 0.03))]}))
    with Planner(folder, str(path)) as planner:
        yield planner


@pytest.fixture(scope='module')
def sent() -> MotionTask:
    return task(payload_mass=0.8, velocity_weights=[0.5, 0.25], publish=True)


@pytest.fixture(scope='module')
def answer(planner: Planner, sent: MotionTask) -> PlanPath.Response:
    answer = planner.call(PlanPath, f'{NODE}/plan_path', PlanPath.Request(task=sent))
    assert answer.report.error_code == PlanReport.NONE, answer.report.error_msg
    return answer


@READERS
def test_recording_holds_every_topic_once_and_the_samples(answer: PlanPath.Response,
                                                          read: Any) -> None:
    found = read(Path(answer.report.recording))
    assert {entry.topic: entry.kind for entry in found} == TYPES
    states = [entry for entry in found if entry.topic == f'{NODE}/reference_states']
    assert len(states) == len(answer.trajectory.points)
    assert len(found) == len(states) + 4
    assert [entry.time for entry in found] == sorted(entry.time for entry in found)


@READERS
def test_request_and_answer_are_recorded_as_they_were(answer: PlanPath.Response,
                                                      sent: MotionTask, read: Any) -> None:
    found = read(Path(answer.report.recording))
    trajectory = answer.trajectory
    for topic, original in (('motion_task', sent), ('plan_report', answer.report),
                            ('joint_trajectory', trajectory.joint_trajectory),
                            ('flexible_trajectory', trajectory)):
        recorded = plain(only(found, topic).message, original)
        assert recorded == plain(original, original), topic


def test_figures_on_other_arms_are_those_of_the_identification_beside_the_arm_file(
        planner: Planner, answer: PlanPath.Response) -> None:
    report = answer.report
    assert (report.stiffness_difference, report.payload_difference) == (0.03, 0.02)
    assert 'stiffness +-3%, payload of 0.8 kg +-2% (identified, ' in planner.log()


@READERS
def test_reference_states_come_at_the_times_of_the_motion(answer: PlanPath.Response,
                                                          read: Any) -> None:
    found = read(Path(answer.report.recording))
    ready = only(found, 'joint_trajectory').time
    states = [entry for entry in found if entry.topic == f'{NODE}/reference_states']
    points = answer.trajectory.joint_trajectory.points
    for entry, point, bend in zip(states, points, answer.trajectory.points, strict=True):
        after = point.time_from_start.sec * 10**9 + point.time_from_start.nanosec
        stamp = entry.message.header.stamp
        assert entry.time == stamp.sec * 10**9 + stamp.nanosec == ready + after
        position, velocity = entry.message.position, entry.message.velocity
        assert list(position) == [*point.positions, *bend.modal_displacements]
        assert list(velocity) == [*point.velocities, *bend.modal_rates]
        # the efforts of the trajectory are those of half a millisecond before
        assert list(entry.message.effort) == pytest.approx([*point.effort, 0, 0, 0, 0], abs=0.1)
    assert list(states[-1].message.effort) == [*points[-1].effort, 0, 0, 0, 0]
    assert list(states[0].message.name)[:3] == ['joint1', 'joint2', 'link1_mode1']


def test_outcome_is_recorded_the_planning_time_after_the_request(
        answer: PlanPath.Response) -> None:
    found = read_by_rosbags(Path(answer.report.recording))
    took = answer.report.planning_time
    passed = only(found, 'plan_report').time - only(found, 'motion_task').time
    assert passed == took.sec * 10**9 + took.nanosec
    assert only(found, 'flexible_trajectory').time == only(found, 'plan_report').time


def test_scenario_is_attached(answer: PlanPath.Response) -> None:
    with next(Path(answer.report.recording).glob('*.mcap')).open('rb') as stream:
        (attachment,) = make_reader(stream).iter_attachments()
    scenario = yaml.safe_load(attachment.data)
    assert attachment.name == 'scenario.yaml'
    assert scenario['arm']['links'][0]['flexural_rigidity'] == 50
    assert scenario['parameters']['joint_names'] == ['joint1', 'joint2']
    assert scenario['parameters']['tolerance'] == 1e-3


def test_latched_topics_are_recorded_as_latched(answer: PlanPath.Response) -> None:
    text = (Path(answer.report.recording) / 'metadata.yaml').read_text()
    topics = yaml.safe_load(text)['rosbag2_bagfile_information']['topics_with_message_count']
    policies = {entry['topic_metadata']['name']:
                entry['topic_metadata']['offered_qos_profiles'][0]['durability']
                for entry in topics}
    latched = {name for name, policy in policies.items() if policy == 'transient_local'}
    assert latched == {f'{NODE}/joint_trajectory', f'{NODE}/flexible_trajectory'}


@pytest.mark.parametrize(('wrong', 'code'), [
    ({'duration': float('nan')}, PlanReport.NOT_FINITE),
    ({'duration': 0.1}, PlanReport.INFEASIBLE)])
def test_failed_request_is_recorded_with_its_report(planner: Planner, wrong: dict[str, Any],
                                                    code: int) -> None:
    report = planner.report(**wrong)
    assert report.error_code == code
    for found in (read_by_rosbags(Path(report.recording)), read_by_mcap(Path(report.recording))):
        assert len(found) == 2
        assert plain(only(found, 'plan_report').message, report) == plain(report, report)
        recorded, original = only(found, 'motion_task').message, task(**wrong)
        np.testing.assert_equal(plain(recorded, original), plain(original, original))


def test_nothing_is_recorded_if_told_so(planner: Planner) -> None:
    folder = Path(planner.parameter('recording_folder'))
    planner.plan(duration=-1.0)
    before = sorted(folder.iterdir())
    assert planner.set_parameter('record', False).successful
    report = planner.report()
    assert planner.set_parameter('record', True).successful
    assert report.error_code == PlanReport.NONE
    assert report.recording == ''
    assert sorted(folder.iterdir()) == before


def test_recording_continues_in_another_file_at_the_size_of_the_parameter(
        planner: Planner) -> None:
    assert planner.set_parameter('max_recording_size', SMALLEST).successful
    answer = planner.plan()
    assert planner.set_parameter('max_recording_size', 0).successful
    folder = Path(answer.report.recording)
    assert files(folder) == [f'{folder.name}_{k}.mcap' for k in range(len(files(folder)))]
    assert len(files(folder)) > 1
    found = read_by_rosbags(folder)
    assert len(found) == len(answer.trajectory.points) + 4
    assert plain(only(found, 'plan_report').message, answer.report) == plain(
        answer.report, answer.report)


def test_size_that_would_make_a_file_of_every_message_is_refused(planner: Planner) -> None:
    for size, reason in ((SMALLEST - 1, 'max_recording_size is 65535, but must be 0 or at least'),
                         (-1, 'max_recording_size')):
        result = planner.set_parameter('max_recording_size', size)
        assert not result.successful
        assert reason in result.reason
    assert planner.parameter('max_recording_size') == 0


def test_every_recording_has_its_own_folder(planner: Planner) -> None:
    paths = [planner.report(duration=-1.0).recording for _ in range(3)]
    assert len(set(paths)) == 3
    assert sorted(paths) == paths
    assert {str(Path(path).parent) for path in paths} == {planner.parameter('recording_folder')}


@contextmanager
def no_folder(planner: Planner) -> Iterator[None]:
    """Put a file in the place of the folder of the recordings."""
    planner.recordings.mkdir(exist_ok=True)
    aside = planner.recordings.rename(planner.recordings.with_name('aside'))
    planner.recordings.write_text('no folder')
    try:
        yield
    finally:
        planner.recordings.unlink()
        aside.rename(planner.recordings)


def test_plan_that_cannot_be_recorded_is_published_with_a_warning(planner: Planner) -> None:
    told: list[Any] = planner.listen(DiagnosticArray, '/diagnostics', 10)
    with no_folder(planner):
        wrong = planner.report(duration=-1.0)
        answer = planner.plan(publish=True, payload_mass=0.9)
        planner.wait('the warning on /diagnostics', lambda: any(
            status.level == DiagnosticStatus.WARN and 'could not be recorded' in status.message
            for message in told for status in message.status))
    report = answer.report
    assert (report.error_code, report.error_msg, report.recording) == (PlanReport.NONE, '', '')
    assert report.warning_kinds[-1] == wrong.warning_kinds[-1] == 'NOT_RECORDED'
    assert report.warnings[-1].startswith(
        f'the request could not be recorded: cannot write {planner.recordings}')
    assert wrong.error_code == PlanReport.OUT_OF_RANGE
    published = planner.latched(JointTrajectory, f'{NODE}/joint_trajectory')
    assert published == answer.trajectory.joint_trajectory
    assert 'Traceback' not in planner.log()


def test_plan_that_must_be_recorded_and_cannot_is_returned_but_not_published(
        planner: Planner) -> None:
    before = planner.plan(publish=True).trajectory.joint_trajectory
    assert planner.set_parameter('recording_required', True).successful
    with no_folder(planner):
        answer = planner.plan(publish=True, payload_mass=0.9)
    assert planner.set_parameter('recording_required', False).successful
    assert answer.report.error_code == PlanReport.RECORDING_FAILED
    assert str(planner.recordings) in answer.report.error_msg
    assert answer.report.recording == ''
    assert len(answer.trajectory.points) > 100
    assert planner.latched(JointTrajectory, f'{NODE}/joint_trajectory') == before


# Searches for the maximum payload


SEARCHED = {'payload_accuracy': 0.1, 'payload_step': 0.5}


def recorded_search(response: FindMaxPayload.Response, **asked: Any) -> PayloadSearch:
    """Return the message that a recording should hold: what was asked and what was answered."""
    shared = PayloadSearch.get_fields_and_field_types().keys() - asked.keys()
    return PayloadSearch(**asked, **{name: getattr(response, name) for name in shared})


@pytest.fixture(scope='module')
def searched(planner: Planner) -> FindMaxPayload.Response:
    answer = planner.search(publish=True, **SEARCHED)
    assert answer.report.error_code == PlanReport.NONE, answer.report.error_msg
    return answer


@READERS
def test_search_is_recorded_with_its_request_and_its_motion(searched: FindMaxPayload.Response,
                                                            read: Any) -> None:
    found, trajectory = read(Path(searched.report.recording)), searched.trajectory
    expected = recorded_search(searched, method=PayloadSearch.DIRECT, **SEARCHED)
    assert {entry.topic: entry.kind for entry in found} == {
        **TYPES, f'{NODE}/payload_search': 'flex_planner_interfaces/msg/PayloadSearch'}
    assert len(found) == 5 + len(trajectory.points)
    for topic, original in (('motion_task', search_request(publish=True).task),
                            ('plan_report', searched.report), ('payload_search', expected),
                            ('joint_trajectory', trajectory.joint_trajectory),
                            ('flexible_trajectory', trajectory)):
        recorded = plain(only(found, topic).message, original)
        assert recorded == plain(original, original), topic


def test_recording_of_a_search_is_named_by_its_service(searched: FindMaxPayload.Response,
                                                       answer: PlanPath.Response) -> None:
    assert Path(searched.report.recording).name.startswith('find_max_payload_')
    assert Path(answer.report.recording).name.startswith('plan_path_')


@READERS
def test_every_field_of_a_search_is_read_back(rigid_arm: Arm, tmp_path: Path, read: Any) -> None:
    sent = PayloadSearch(
        method=PayloadSearch.INCREMENTAL, payload_accuracy=0.1, payload_step=0.2, payload=3.0,
        payload_upper=3.1, limiting_joint=-1, held=True, front_payloads=[1.0, 2.0],
        front_efforts=[3.0, 4.0], front_prices=[5.0, 6.0], tried_payloads=[7.0, 8.0, 9.0],
        tried_solved=[True, False, True], tried_errors=[1e-9, float('inf'), 0.0])
    settings = replace(PlannerSettings.for_arm(rigid_arm), recording_folder=str(tmp_path))
    folder = OutcomeRecorder(rigid_arm, NODE).write(
        task(), RequestState(settings=settings, stamp_ns=STAMP),
        Outcome(report=PlanReport(), trajectory=FlexibleTrajectory(), search=sent))
    assert folder == tmp_path / 'find_max_payload_20231114T221320_000000005_0001'
    found = only(read(folder), 'payload_search')
    assert found.time == STAMP
    assert plain(found.message, sent) == plain(sent, sent)


@READERS
def test_failed_search_is_recorded_as_it_was_asked(planner: Planner, read: Any) -> None:
    asked = {'method': 3, 'payload_accuracy': float('nan'), 'payload_step': 0.0}
    response = planner.search(**asked)
    found = read(Path(response.report.recording))
    assert response.report.error_code == PlanReport.OUT_OF_RANGE
    assert len(found) == 3
    recorded, expected = only(found, 'payload_search'), recorded_search(response, **asked)
    assert recorded.time == only(found, 'plan_report').time
    np.testing.assert_equal(plain(recorded.message, expected), plain(expected, expected))


# Files


def written(plan: Plan, folder: Path, **changes: Any) -> Path:
    """Return where the recorder puts a plan with some parameters changed."""
    settings = replace(PlannerSettings.for_arm(plan.arm), recording_folder=str(folder), **changes)
    reference = sample_plan(plan, settings.sampling())
    joints = joint_trajectory(reference, settings.joint_names)
    trajectory = flexible_trajectory(plan, reference, joints, settings.base_frame)
    outcome = Outcome(report=report_from_plan(plan), trajectory=trajectory, plan=plan,
                      reference=reference)
    return OutcomeRecorder(plan.arm, NODE).write(
        task(), RequestState(settings=settings, stamp_ns=STAMP), outcome)


def raw(folder: Path) -> list[tuple[str, int, bytes]]:
    """Return topics, log times and contents, without the report, which names its folder."""
    with AnyReader([folder]) as reader:
        return [(connection.topic, time, bytes(data))
                for connection, time, data in reader.messages()
                if connection.topic != f'{NODE}/plan_report']


def test_same_request_and_outcome_make_the_same_bytes(plan_of: PlanFactory,
                                                      tmp_path: Path) -> None:
    contents = []
    for _ in range(2):
        folder = written(plan_of('ei50', 0.8), tmp_path / 'now')
        contents.append({path.name: path.read_bytes() for path in folder.iterdir()})
        shutil.rmtree(folder)
    assert len(contents[0]) == 2
    assert contents[0] == contents[1]


def test_split_recording_holds_what_a_whole_one_holds(plan_of: PlanFactory,
                                                      tmp_path: Path) -> None:
    plan = plan_of('ei50', 0.8)
    whole = written(plan, tmp_path / 'whole')
    split = written(plan, tmp_path / 'split', max_recording_size=SMALLEST)
    assert len(files(whole)) == 1 < len(files(split))
    assert raw(split) == raw(whole)
    request = RecordedRequest.read(split)
    assert request.solved
    assert request.settings['max_recording_size'] == SMALLEST
