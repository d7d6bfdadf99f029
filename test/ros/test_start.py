"""The start and the end of a node's process, whatever it is started with."""

from __future__ import annotations

import os
from pathlib import Path
import signal
import subprocess
import sys

from flex_planner.ros.runtime import start
import pytest

START = [sys.executable, '-m', 'flex_planner.ros.runtime.start']
SIMULATOR = 'flex_planner.ros.arm_simulator'
# a program whose libraries take long to load
SLOW = 'import time\nprint("loading", flush=True)\nwhile True:\n    time.sleep(0.01)\n'
# a node that was told to end, and hangs
HANGING = ('from flex_planner.ros.runtime import running\nimport time\n'
           'running._LAST_RESORT = 0.2\nrunning._end_soon()\ntime.sleep(60)\n')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signal_while_libraries_are_loaded_ends_the_process_quietly(
        tmp_path: Path, number: signal.Signals) -> None:
    (tmp_path / 'slow.py').write_text(SLOW)
    with subprocess.Popen([*START, 'slow'], cwd=tmp_path, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == 'loading\n'
        process.send_signal(number)
        assert process.communicate(timeout=60) == ('', '')
    assert process.returncode == 0


def test_node_that_hangs_when_it_was_told_to_end_leaves_quietly() -> None:
    ended = subprocess.run([sys.executable, '-c', HANGING], capture_output=True, text=True,
                           check=False, timeout=50)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, '', '')


@pytest.mark.parametrize('arguments', [['-p', 'bad'], ['--nonsense']])
def test_wrong_arguments_are_told_without_a_traceback(arguments: list[str]) -> None:
    ended = subprocess.run([*START, SIMULATOR, '--ros-args', *arguments], capture_output=True,
                           text=True, check=False, timeout=100)
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith('arm_simulator: ROS cannot start: ')
    assert 'Traceback' not in ended.stderr


def test_node_needs_neither_streams_nor_a_home(tmp_path: Path) -> None:
    kept = {name: value for name, value in os.environ.items() if not name.startswith('ROS_')}
    parameters = tmp_path / 'parameters.yaml'
    parameters.write_text('/**: {ros__parameters: {arm: "none\\x1b[31m.yaml"}}\n')
    ended = subprocess.run(
        ['bash', '-c', 'exec "$@" <&- >&-', 'bash', *START, SIMULATOR, '--ros-args',
         '--params-file', str(parameters)], stderr=subprocess.PIPE, text=True, check=False,
        timeout=100, env={**kept, 'HOME': '/proc/none'})
    assert ended.returncode == 1
    assert ended.stderr.count('\n') == 1
    assert r"[arm_simulator]: arm file 'none\x1b[31m.yaml' does not exist" in ended.stderr


@pytest.mark.parametrize('name', ['planner', 'arm_simulator', 'replay'])
def test_help_says_how_a_node_is_started_and_starts_none(
        name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(start, 'import_module', pytest.fail)
    monkeypatch.setattr(start, 'prepare_process', lambda: None)
    monkeypatch.setattr(sys, 'argv', [name, '--help'])
    getattr(start, name)()
    told = capsys.readouterr().out
    assert told.startswith(f'usage: {name} [--ros-args ')
    assert f'{name} --ros-args -p ' in told
