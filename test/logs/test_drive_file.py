"""Files of drives are read strictly."""

from __future__ import annotations

from pathlib import Path

from flex_planner.control.joint_controller import EffortHold
from flex_planner.identification.experiments import LogError
from flex_planner.logs.drive_file import load_drive
import pytest


def test_one_gain_stands_for_all_joints(tmp_path: Path) -> None:
    path = tmp_path / 'drive.yaml'
    path.write_text('rate: 500\nstiffness: 40\ndamping: [4, 3]\nspeeds: measured\n'
                    'effort_hold: start\nresolution: 1e-4\n')
    drive = load_drive(path, 2)
    assert (drive.rate, drive.hold, drive.measured_speeds) == (500, EffortHold.START, True)
    assert drive.gains.stiffness.tolist() == [40, 40] and drive.gains.damping.tolist() == [4, 3]


@pytest.mark.parametrize(('text', 'message'), [
    ('rate: 500\nstiffness: 40\n', 'damping'),
    ('rate: 5\nstiffness: 40\ndamping: 4\n', 'rate'),
    ('rate: 500\nstiffness: [1, 2, 3]\ndamping: 4\n', 'stiffness'),
    ('rate: 500\nstiffness: 40\ndamping: 4\nspeeds: none\n', 'speeds'),
    ('rate: 500\nstiffness: 40\ndamping: 4\ndelay: 1\n', '4 periods'),
    ('rate: 500\nstiffness: 40\ndamping: 4\nfilter: 1\n', 'there is no such field')])
def test_mistakes_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / 'drive.yaml'
    path.write_text(text)
    with pytest.raises(LogError, match=message):
        load_drive(path, 2)
