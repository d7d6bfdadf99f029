"""The command line where streams are closed, go away, or lack letters."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

from flex_planner.cli import main
import pytest

NAME = 'Größe λ 長腕 🦾'
MOTION = ['--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1']
_ARM = 'name: "{}"\nlinks: [{{length: 0.5, mass: 3.0}}]\njoints: [{{}}]\n'


@pytest.fixture
def strange(tmp_path: Path) -> Path:
    """Return an arm file whose name is not UTF-8."""
    path = Path(os.fsdecode(bytes(tmp_path) + b'/\xe9t\xe9.yaml'))
    path.write_text(_ARM.format(NAME), encoding='utf-8')
    return path


def shell(script: str, *arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line in a shell, as `"$@"` of a script."""
    command = [sys.executable, '-m', 'flex_planner.cli', *map(str, arguments)]
    return subprocess.run(['bash', '-c', script, 'bash', *command], text=True, check=False,
                          capture_output=True, timeout=120, env={**os.environ, **environment},
                          encoding='latin-1')


def test_name_that_cannot_be_encoded_is_escaped(strange: Path, tmp_path: Path) -> None:
    ended = shell('"$@"', 'arm', strange, '--output', tmp_path, PYTHONIOENCODING='ascii',
                  PYTHONUTF8='0', PYTHONCOERCECLOCALE='0', LC_ALL='C')
    assert (ended.returncode, ended.stderr) == (0, '')
    assert ended.stdout.startswith('Gr\\xf6\\xdfe \\u03bb \\u9577\\u8155 \\U0001f9be\n')


@pytest.mark.parametrize('script', [
    '"$@" <&- >&- 2>&-; echo $?', '"$@" 2>&1 | true; echo ${PIPESTATUS[0]}'],
    ids=['closed', 'no reader'])
def test_streams_that_are_gone_are_no_failure(script: str, tmp_path: Path) -> None:
    ended = shell(script, 'arm', 'korayem_rigid', '--output', tmp_path)
    assert (ended.stdout, ended.stderr) == ('0\n', '')


def test_results_that_are_lost_are_a_failure() -> None:
    ended = shell('"$@" >/dev/full', '--help')
    assert (ended.returncode, ended.stderr) == (
        1, 'flex-planner: standard output failed: No space left on device\n')


def test_plan_needs_no_streams(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, 'stderr', None)
    monkeypatch.setattr(sys, 'stdout', None)
    assert main(['plan', 'korayem_rigid', *MOTION, '--no-plot', '--output', str(tmp_path)]) == 0
    assert len(list(tmp_path.glob('recordings/*/*.mcap'))) == 1


def test_names_are_escaped_wherever_they_are_printed(tmp_path: Path,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    folder = Path(os.fsdecode(bytes(tmp_path) + b'/\xff\x1b[31m'))
    folder.mkdir()
    arm = folder / 'arm.yaml'
    arm.write_text(_ARM.format('\\x1b[2J\\a\\n $\\\\frac{1$').replace(
        'mass: 3.0', 'mass: 3.0, modes: 1, flexural_rigidity: 50.0'))
    code = main(['plan', str(arm), '--from-angles', '0', '--to-angles', '30', '--duration', '2',
                 '--output', str(folder)])
    said = capsys.readouterr()
    assert code == 0
    for text in said:
        assert text.replace('\n', '').isprintable()
    assert said.out.startswith('arm                        \\x1b[2J\\x07\\n $\\frac{1$\n')
    assert said.out.endswith(f'output folder              {tmp_path}/\\udcff\\x1b[31m\n')
    (recording,) = (folder / 'recordings').iterdir()
    page = folder / 'page.html'
    assert main(['report', str(recording), '--output', str(page)]) == 0
    assert page.read_text(encoding='utf-8').replace('\n', '').isprintable()
    assert (folder / 'arm_motion.png').exists()
    assert main(['report', str(folder / 'none')]) == 1
    assert '\x1b' not in capsys.readouterr().err
