"""The check of a recorded plan: sound ones pass, falsified ones are found out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from flex_planner.base.errors import RecordingError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.cli import main
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.recording import (
    definition_folder,
    MessageTypes,
    read_attachments,
    read_recording,
    Recording,
)
from flex_planner.reports.recording import check_motion, RecordedRequest
import numpy as np
import pytest

# two clamped aluminium links that sag by millimetres
SAGGING = """
name: Sagging
gravity: [0.0, -9.81]
links:
  - &link {length: 0.6, density: 2700, youngs_modulus: 69.0e+9, modes: 1,
           section: {width: 0.04, thickness: 0.005}, mode_family: clamped_free}
  - *link
joints:
  - &joint {motor: {stall_torque: 20, no_load_speed: 4}}
  - *joint
nodes:
  - &node {mass: 0.8, inertia: 0.05}
  - *node
  - {}
"""


def failed_findings(request: RecordedRequest, model: ArmModel) -> set[str]:
    return {finding.name for finding in check_motion(request, model).findings
            if not finding.passed}


def with_motion(request: RecordedRequest, **changes: Any) -> RecordedRequest:
    assert request.motion is not None
    return replace(request, motion=replace(request.motion, **changes))


@pytest.mark.parametrize(('name', 'model'), [('plan', 'ei50_model'), ('trials', 'rigid_model')])
def test_recorded_plans_pass_their_check(name: str, model: str,
                                         request: pytest.FixtureRequest) -> None:
    recording = RecordedRequest.read(request.getfixturevalue(name))
    check = check_motion(recording, request.getfixturevalue(model))
    assert check.passed
    found = {finding.name: finding for finding in check.findings}
    # the recorded motion is replayed exactly as it was certified
    assert found['executed tip error'].value == recording.report.executed_tip_error < 2e-5
    assert found['executed tip error'].recorded == recording.report.executed_tip_error
    assert found['difference from the certificate'].value == 0
    # of states and costates between the points, where efforts are those of half a period before
    assert found['torques against the costates'].value < 1e-3


@pytest.fixture(scope='module')
def bent(tmp_path_factory: pytest.TempPathFactory) -> RecordedRequest:
    """Return the recording of an arm under gravity that moves and rings at the start."""
    folder = tmp_path_factory.mktemp('bent')
    (folder / 'arm.yaml').write_text(SAGGING)
    main(['plan', str(folder / 'arm.yaml'), '--from-angles', '-110,80', '--to', '0.6,-0.6',
          '--elbow', '1', '--start-velocities', '0.3,-0.2,0.01,0', '--payload', '0.3',
          '--start-modal-displacements', '0.004,-0.006', '--duration', '2', '--no-plot',
          '--output', str(folder)])
    (path,) = (folder / 'recordings').iterdir()
    return RecordedRequest.read(path)


def test_goal_is_where_the_bent_tip_rests_and_the_start_as_it_moves(bent: RecordedRequest) -> None:
    check = check_motion(bent)
    assert check.passed, [str(finding) for finding in check.findings if not finding.passed]
    values = {finding.name: finding.value for finding in check.findings}
    assert values['deviation from task, goal'] < 1e-9
    assert values['deviation from task, start'] < 1e-9
    assert values['deviation from its state, start'] < 1e-9
    assert bent.task.space == bent.task.CARTESIAN_GOAL
    assert bent.motion is not None
    assert bent.motion.coordinates[0, 2:].tolist() == [0.004, -0.006]
    assert bent.motion.rates[0].tolist() == [0.3, -0.2, 0.01, 0.0]


@pytest.mark.parametrize(('field', 'value', 'name'), [
    ('start_velocities', [0.3, -0.2, 0.0, 0.0], 'its state, start'),
    ('start_modal_displacements', [0.004, 0.0], 'its state, start'),
    ('start_positions', [-1.9, 1.4], 'task, start'),
    ('goal_point', SimpleNamespace(x=0.6, y=-0.6001), 'task, goal')])
def test_motion_from_another_state_is_found_out(bent: RecordedRequest, field: str, value: Any,
                                                name: str) -> None:
    original = getattr(bent.task, field)
    setattr(bent.task, field, value)
    try:
        failed = {finding.name for finding in check_motion(bent).findings if not finding.passed}
        assert f'deviation from {name}' in failed
    finally:
        setattr(bent.task, field, original)


@pytest.mark.parametrize(('change', 'expected'), [
    (lambda motion: {'torques': 1.02 * motion.torques},
     {'difference from the certificate', 'torques against the costates'}),
    (lambda motion: {'torques': 3 * motion.torques},
     {'difference from the certificate', 'largest tip deviation', 'torques against the costates',
      'largest joint deviation', 'torque beyond its bounds'}),
    (lambda motion: {'payload_mass': 1.0},
     {'difference from the certificate', 'torques against the costates'}),
    (lambda motion: {'tip': motion.tip + 0.01}, {'executed tip error', 'largest tip deviation'}),
    (lambda motion: {'rates': 1.02 * motion.rates}, {'difference from the certificate'}),
    (lambda motion: {'accelerations': 1.02 * motion.accelerations},
     {'difference from the certificate'}),
    (lambda motion: {'times': 1.001 * motion.times}, {'difference from the certificate'}),
    (lambda motion: {'velocity_costates': 0.9 * motion.velocity_costates},
     {'torques against the costates', 'Hamiltonian drift'}),
    (lambda motion: {'torques': np.full_like(motion.torques, 1e200)}, {
        'executed tip error', 'largest tip deviation', 'torques against the costates',
        'torque beyond its bounds'}),
    (lambda motion: {'rates': motion.rates + 1e-3}, {
        'deviation from rest, start', 'deviation from rest, goal'})])
def test_every_falsified_plan_is_found_out(request_of_plan: RecordedRequest, ei50_model: ArmModel,
                                           change: Callable[[Any], dict[str, Any]],
                                           expected: set[str]) -> None:
    changed = with_motion(request_of_plan, **change(request_of_plan.motion))
    assert failed_findings(changed, ei50_model) >= expected


def test_plan_of_another_task_is_found_out(request_of_plan: RecordedRequest,
                                           ei50_model: ArmModel) -> None:
    original = request_of_plan.task.goal_point
    request_of_plan.task.goal_point = type(original)(0.5, 0.4, 0.0)
    try:
        assert failed_findings(request_of_plan, ei50_model) == {'deviation from task, goal'}
    finally:
        request_of_plan.task.goal_point = original


def test_effort_shifted_as_the_recording_says_is_that_of_eq_14(
        request_of_plan: RecordedRequest, ei50_model: ArmModel) -> None:
    period = request_of_plan.report.controller_period
    assert period == 1e-3
    request_of_plan.report.controller_period = 0.0
    try:
        assert failed_findings(request_of_plan, ei50_model) == {'torques against the costates'}
    finally:
        request_of_plan.report.controller_period = period


def test_older_recording_is_checked_with_linear_efforts(request_of_plan: RecordedRequest,
                                                        ei50_model: ArmModel) -> None:
    rate, request_of_plan.report.controller_rate = request_of_plan.report.controller_rate, 0.0
    try:
        check = check_motion(request_of_plan, ei50_model)
    finally:
        request_of_plan.report.controller_rate = rate
    names = [finding.name for finding in check.findings]
    assert 'executed tip error' in names
    assert 'difference from the certificate' not in names


def test_check_obeys_its_monitor_and_needs_a_motion(request_of_plan: RecordedRequest,
                                                    ei50_model: ArmModel, failure: Path) -> None:
    with pytest.raises(StoppedError):
        check_motion(request_of_plan, ei50_model, Monitor(canceled=lambda: True))
    with pytest.raises(RecordingError, match='has no motion to check: impossible'):
        check_motion(RecordedRequest.read(failure))


def test_falsified_recording_fails_on_the_command_line(plan: Path, tmp_path: Path,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    with Recording.create(tmp_path, 'forged', types) as recording:
        recording.attach('scenario.yaml', read_attachments(plan)['scenario.yaml'], media_type='')
        for entry in read_recording(plan, types):
            for point in getattr(getattr(entry.message, 'joint_trajectory', None), 'points', ()):
                point.effort = 1.1 * point.effort
            recording.write(entry.topic, entry.message, entry.log_time_ns)
    page = tmp_path / 'forged.html'
    assert main(['report', str(recording.path), '--check', '--output', str(page)]) == 1
    told = capsys.readouterr().out
    assert 'the check of the recording FAILED (difference from the certificate' in told
    assert 'class="verdict failed"' in page.read_text()
