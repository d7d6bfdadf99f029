"""Recordings read back into the terms of the core."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

from flex_planner.base.errors import RecordingError
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.recording import (
    definition_folder,
    MessageTypes,
    read_attachments,
    read_recording,
    Recording,
)
from flex_planner.reports.recording import RecordedRequest
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
