"""Recordings of plans whose torques have no jumps: checked against their costates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.reports.recording import check_motion, RecordedRequest
import numpy as np
import pytest
from report_support import recorded


@pytest.fixture(scope='module')
def smooth(tmp_path_factory: pytest.TempPathFactory) -> RecordedRequest:
    """Return the recording of a plan whose rates have a price, and for one joint a bound."""
    return RecordedRequest.read(recorded(
        tmp_path_factory.mktemp('smooth'), 'plan', 'korayem_rigid', '--payload', '1', '--search',
        'fast', '--torque-rate-weight', '5e-5', '--max-torque-rate', 'inf,120', '--start-hold',
        '0.1'))


def test_recording_says_what_the_plan_did(smooth: RecordedRequest, rigid_model: ArmModel) -> None:
    assert smooth.task.torque_rate_weight.tolist() == [5e-5, 5e-5]
    assert smooth.task.max_torque_rate.tolist() == [np.inf, 120.0]
    assert smooth.report.torque_rate_weight.tolist() == [5e-5, 5e-5]
    # the second is on its bound at both ends, the first beyond it
    first, second = smooth.report.peak_torque_rates
    assert second == pytest.approx(120.0) and first > 120
    check = check_motion(smooth, rigid_model)
    assert check.passed, [str(finding) for finding in check.findings if not finding.passed]
    found = {finding.name: finding for finding in check.findings}
    assert found['torques against their costates'].value < 0.01
    assert found['Hamiltonian drift'].value < 1e-3


@pytest.mark.parametrize(('change', 'expected'), [
    (lambda motion: {'torques': 1.05 * motion.torques}, {'torques against their costates'}),
    (lambda motion: {'torque_costates': 0.9 * motion.torque_costates},
     {'torques against their costates'}),
    (lambda motion: {'velocity_costates': 0.9 * motion.velocity_costates}, {'Hamiltonian drift'}),
    (lambda motion: {'position_costates': 0.9 * motion.position_costates},
     {'Hamiltonian drift'})])
def test_every_falsified_plan_is_found_out(
        smooth: RecordedRequest, rigid_model: ArmModel,
        change: Callable[[Any], dict[str, Any]], expected: set[str]) -> None:
    assert smooth.motion is not None
    changed = replace(smooth, motion=replace(smooth.motion, **change(smooth.motion)))
    failed = {finding.name for finding in check_motion(changed, rigid_model).findings
              if not finding.passed}
    assert failed >= expected


def test_older_recordings_have_no_costates_of_torques(plan: Path) -> None:
    request = RecordedRequest.read(plan)
    assert request.motion is not None and request.motion.torque_costates.shape[1] == 0
