"""What a command leaves: recordings first, all below one folder, each in its own file."""

from __future__ import annotations

from pathlib import Path
import sys

from flex_planner.cli import main
from flex_planner.cli.parser import parse
import pytest

MOTION = ['--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1']


def rows(text: str) -> list[tuple[str, str]]:
    """Return the rows that name files."""
    names = ('recording', 'picture', 'output folder', 'picture of the arm')
    return [(line[:26].strip(), line[27:]) for line in text.splitlines()
            if line.startswith(names)]


def test_picture_that_fails_is_a_warning_and_loses_no_recording(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'korayem_rigid_motion.png').mkdir()
    assert main(['plan', 'korayem_rigid', *MOTION, '--output', str(tmp_path)]) == 0
    said = capsys.readouterr()
    (recording,) = (tmp_path / 'recordings').iterdir()
    assert rows(said.out) == [('recording', str(recording)), ('output folder', str(tmp_path))]
    assert 'flex-planner: warning: no picture of the motion: ' in said.err


def test_picture_is_drawn_where_the_recording_fails(tmp_path: Path,
                                                    capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'recordings').write_text('')
    assert main(['plan', 'korayem_rigid', *MOTION, '--output', str(tmp_path)]) == 1
    assert 'flex-planner: cannot write ' in capsys.readouterr().err
    assert (tmp_path / 'korayem_rigid_motion.png').exists()


def test_arm_is_described_without_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(sys.modules, 'flex_planner.plotting', None)
    assert main(['arm', 'korayem_ei50', '--output', str(tmp_path)]) == 0
    said = capsys.readouterr()
    assert said.out.startswith('Korayem 2009 two-link arm')
    assert said.err.startswith('flex-planner: warning: no picture of the arm: ')
    assert main(['arm', 'korayem_ei50', '--plot', str(tmp_path / 'a.png')]) == 1


def test_picture_of_an_unknown_kind_is_refused_in_a_line(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['arm', 'korayem_ei50', '--plot', str(tmp_path / 'a.picture')]) == 1
    assert 'must be named like a picture, NAME.png' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('command', ['plan', 'payload', 'compare'])
def test_planning_ends_after_a_minute_unless_told_otherwise(command: str) -> None:
    assert parse([command, 'korayem_rigid', *MOTION]).time_limit == 60.0
