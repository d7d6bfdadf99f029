"""Recordings read back into the terms of the core."""

from __future__ import annotations

from pathlib import Path
import re
import subprocess
import sys
from typing import Any

from flex_planner.base.errors import RecordingError
from flex_planner.cli import main
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.recording import (
    definition_folder,
    MessageTypes,
    read_attachments,
    read_recording,
    Recording,
)
from flex_planner.reports.recording import RecordedRequest
from mcap.records import Attachment, Schema
from other_writers import FOREIGN, OPTIONS, rewrite, with_schema
import pytest


def test_recording_is_read_back_into_the_terms_of_the_core(
        request_of_plan: RecordedRequest, ei50_model: ArmModel) -> None:
    found, arm = request_of_plan, ei50_model.arm
    assert (found.arm.links, found.arm.joints, found.arm.nodes) == (
        arm.links, arm.joints, arm.nodes)
    assert found.motion is not None
    assert found.motion.coordinates.shape == (found.motion.times.size, 6)
    assert (found.parameters.payload_mass, found.tolerance) == (0.8, 1e-3)
    assert found.parameters.velocity_weights.tolist() == [0.5, 0.25, 0, 0, 0, 0]
    assert found.solved


@pytest.mark.parametrize('attachment', [b'', b'{arm: {}, parameters: {}}', b'a: [', b'x: 1'])
def test_recordings_of_others_are_refused(plan: Path, tmp_path: Path, attachment: bytes) -> None:
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    with Recording.create(tmp_path, 'other', types) as recording:
        if attachment:
            recording.attach('scenario.yaml', attachment, media_type='application/yaml')
        for entry in read_recording(plan, types, ['/flex_planner/motion_task',
                                                  '/flex_planner/plan_report']):
            recording.write(entry.topic, entry.message, entry.log_time_ns)
    with pytest.raises(RecordingError, match=r'/other (is not the rec|contradicts|has a sc)'):
        RecordedRequest.read(recording.path)


def test_recording_without_a_request_is_refused(plan: Path, tmp_path: Path) -> None:
    with Recording.create(tmp_path, 'other', MessageTypes.load()) as recording:
        recording.attach('scenario.yaml', read_attachments(plan)['scenario.yaml'], media_type='')
    with pytest.raises(RecordingError, match='it has no MotionTask with a PlanReport'):
        RecordedRequest.read(recording.path)


def test_reports_do_not_take_ros(plan: Path) -> None:
    code = ('import sys; from flex_planner.reports.recording import *; '
            f'report_page(RecordedRequest.read({str(plan)!r})); '
            'assert not {"rclpy", "casadi", "matplotlib"} & set(sys.modules)')
    subprocess.run([sys.executable, '-c', code], check=True)


# Recordings of other writers, and of older planners


YOUNG = ['kind_values', 'kind_sentences', 'kind_counts', 'kind_starts', 'map_cell', 'state_error',
         'warning_kinds', 'warnings',
         'peak_torque_shares', 'saturation', 'allow_large_bending', 'kind', 'tried_shares']


def older_types(folder: Path) -> MessageTypes:
    """Return definitions of our messages without fields that they have not always had."""
    source = definition_folder('flex_planner_interfaces')
    old = folder / 'flex_planner_interfaces' / 'msg'
    old.mkdir(parents=True)
    for file in source.glob('msg/*.msg'):
        text = re.sub(rf'^\S+ ({"|".join(YOUNG)})$', '', file.read_text(), flags=re.MULTILINE)
        (old / file.name).write_text(text)
    return MessageTypes.load([old.parent])


def rewritten(plan: Path, folder: Path, types: MessageTypes) -> Path:
    """Return a recording as a planner with other definitions would have written it."""
    with Recording.create(folder, 'older', types) as recording:
        for name, data in read_attachments(plan).items():
            recording.attach(name, data, media_type='')
        own = MessageTypes.load([definition_folder('flex_planner_interfaces')])
        for entry in read_recording(plan, own):
            recording.write(entry.topic, entry.message, entry.log_time_ns)
    return recording.path


def test_recording_of_an_older_planner_is_reported_and_checked(
        plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = rewritten(plan, tmp_path, older_types(tmp_path / 'old'))
    request = RecordedRequest.read(path)
    assert (request.report.kind_starts, list(request.report.warnings)) == (0, [])
    assert request.report.cost == RecordedRequest.read(plan).report.cost
    assert main(['report', str(path), '--check', '--output', str(tmp_path / 'a.html')]) == 0
    assert 'the check of the recording passed' in capsys.readouterr().out
    assert main(['recover', str(path)]) == 0
    assert RecordedRequest.read(path.with_name('older_recovered')).solved


@pytest.mark.parametrize('name', ['all', 'nothing', 'unchunked_nothing'])
def test_foreign_channels_are_named_and_do_no_harm(
        plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    file = rewrite(plan, tmp_path / 'ü x.mcap', OPTIONS[name], backwards=True)
    assert main(['report', str(file), '--output', str(tmp_path / 'a.html')]) == 0
    said = capsys.readouterr().out
    for channel in FOREIGN[:4]:
        assert f'{channel} (1 message): ' in said
    page = (tmp_path / 'a.html').read_text(encoding='utf-8')
    assert 'Not read' in page
    assert 'protobuf, not ROS 2' in page


def test_trajectory_of_an_unknown_definition_is_named_and_missed(plan: Path,
                                                                 tmp_path: Path) -> None:
    change = with_schema('flex_planner_interfaces/msg/FlexibleTrajectory', 'float64 x\n', False)
    request = RecordedRequest.read(rewrite(plan, tmp_path / 'a.mcap', {}, change))
    assert not request.solved
    assert any('bytes are not a flex_planner_interfaces/msg/FlexibleTrajectory' in str(channel)
               for channel in request.left_out)


@pytest.mark.parametrize(('old', 'new'), [
    (b'joint_names:', b'names:'), (b'tolerance:', b'tolerances:'),
    (b'stall_torque: ', b'stall_torque: !!timestamp '), (b'parameters:', b'parameters: 7 #')])
def test_scenario_with_other_contents_is_an_error_or_none(
        plan: Path, tmp_path: Path, old: bytes, new: bytes,
        capsys: pytest.CaptureFixture[str]) -> None:
    def change(record: Any) -> Any:
        if isinstance(record, Attachment):
            assert old in record.data
            return Attachment(**{**vars(record), 'data': record.data.replace(old, new)})
        return record

    file = rewrite(plan, tmp_path / 'a.mcap', {}, change)
    code = main(['report', str(file), '--output', str(tmp_path / 'a.html')])
    said = capsys.readouterr().err
    assert code == (0 if not said else 1)
    assert said.count('\n') == code


def test_schemas_of_our_types_may_be_missing(plan: Path, tmp_path: Path) -> None:
    def change(record: Any) -> Any:
        return (Schema(**{**vars(record), 'data': b'', 'encoding': ''})
                if isinstance(record, Schema) else record)

    assert RecordedRequest.read(rewrite(plan, tmp_path / 'a.mcap', {}, change)).solved


def test_name_that_is_not_utf8_is_shown_as_far_as_it_is(
        plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = rewrite(plan, tmp_path / 'b\udcfcd.mcap')
    assert main(['report', str(file), '--output', str(tmp_path / 'a.html')]) == 0
    assert 'b\ufffdd.mcap, report of' in (tmp_path / 'a.html').read_text(encoding='utf-8')
    assert main(['recover', str(file)]) == 0
    assert capsys.readouterr().out.rstrip().endswith('/b_d_recovered')
    assert main(['replay', str(file)]) == 1
