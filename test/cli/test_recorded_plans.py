"""Commands that carry out a recorded plan."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from flex_planner.base.yaml_text import parse_yaml
from flex_planner.cli import main
from flex_planner.cli.recorded_plans import names_recording
import pytest

MOTION = ['--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1', '--payload', '1']


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a recording that `flex-planner gains` has made, and its figures."""
    path: Path = tmp_path_factory.mktemp('recorded')
    assert main(['gains', 'korayem_ei50', *MOTION, '--stiffness-error', '0.05',
                 '--output', str(path)]) == 0
    return path


@pytest.fixture(scope='module')
def recording(folder: Path) -> Path:
    found, = (folder / 'recordings').iterdir()
    return found


def values(path: Path) -> Any:
    return parse_yaml(path.read_text())


def test_recorded_plan_is_carried_out_as_it_was_published(
        folder: Path, recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mcap, = recording.glob('*.mcap')
    assert main(['robustness', str(mcap), '--payload-error', '0.05', '--output',
                 str(folder)]) == 0
    text = capsys.readouterr().out
    assert '100, 100 N m/rad and 10, 10 N m s/rad at 1000 Hz, effort_hold end' in text
    assert 'stiffness +-5%, payload +-5% (in part as recorded)' in text
    found = {one['if']: one for one in values(folder / f'{mcap.stem}_robustness.yaml')['arms']}
    assert 0 < found['as modelled']['tip_motion'] < 1e-4 < found['payload +5%']['tip_motion']


def test_another_controller_may_be_asked_for(folder: Path, recording: Path,
                                             capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['robustness', str(recording), '--controller-rate', '200', '--output',
                 str(folder)]) == 1
    text = capsys.readouterr().out
    assert '100, 100 N m/rad and 10, 10 N m s/rad at 200 Hz' in text and 'unstable' in text


def test_gains_of_a_recorded_plan_are_those_of_the_plan(
        folder: Path, recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['gains', str(recording), '--stiffness-error', '0.05', '--output',
                 str(folder)]) == 0
    assert str(recording) in capsys.readouterr().out
    before, after = (values(folder / f'{name}_gains.yaml')
                     for name in ('korayem_ei50', recording.name))
    assert after['joints'] == before['joints'] and after['arms'] == before['arms']
    # of points, whose torques are straight in between
    for name, left in before['tip_motion_after_arrival'].items():
        assert after['tip_motion_after_arrival'][name] == pytest.approx(left, abs=2e-5)


@pytest.mark.parametrize(('options', 'message'), [
    (['--from', '0.5,0'], '--from is'), (['--duration', '2'], '--duration is'),
    (['--limit', 'joint_speed:1'], '--limit is'), (['--payload', '1'], '--payload is'),
    (['--payload', '0'], '--payload is 0'), (['--elbow=-1'], '--elbow is -1'),  # as by default
    (['--start-hold', '1'], '--start-hold is')])
def test_options_of_a_motion_are_refused(recording: Path, capsys: pytest.CaptureFixture[str],
                                         options: list[str], message: str) -> None:
    assert main(['robustness', str(recording), *options]) == 1
    error = capsys.readouterr().err
    assert message in error and 'left out: the recording has the motion' in error


def test_what_is_missing_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['robustness', str(tmp_path)]) == 1
    assert str(tmp_path) in capsys.readouterr().err
    assert main(['gains', 'korayem_rigid', '--from', '0.5,0', '--to', '0.5,0.5']) == 1
    assert '--duration is missing' in capsys.readouterr().err
    assert not names_recording(argparse.Namespace(arm='korayem_rigid'))
