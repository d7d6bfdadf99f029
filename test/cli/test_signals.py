"""Ctrl-C and its like, at any moment of a command."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from flex_planner.cli import run_command
from flex_planner.cli.pictures import drawn, print_files
from flex_planner.cli.signals import CommandSignals, SIGNALS
import pytest

# a command that hangs while a module of it is loaded, or at work, and says when it does
HANGING = """
import os, signal, sys, time
# as from a terminal: nohup and a shell's background jobs ignore some
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from flex_planner.cli import main, run_command
from flex_planner.cli.signals import SIGNALS

def hang():
    print('hangs', flush=True)
    while True:
        time.sleep(0.01)

class Finder:
    def find_spec(self, name, path, target=None):
        if name == 'flex_planner.cli.parser':
            hang()

def clean_up():
    try:
        hang()
    finally:
        time.sleep(0.3)
        print('cleaned up', flush=True)

def deaf():
    with SIGNALS.patient():
        clean_up()

class Slow:  # to end
    def __del__(self, say=os.write, wait=time.sleep):
        say(1, b'ends\\n')
        wait(0.3)

if sys.argv[1] == 'end':
    slow = Slow()
    sys.exit(run_command(lambda: print('hangs', flush=True) or 0))
if sys.argv[1] == 'imports':
    sys.meta_path.insert(0, Finder())
    sys.exit(main())
sys.exit(run_command({'work': clean_up, 'deaf': deaf}[sys.argv[1]]))
"""


@pytest.fixture
def start() -> Iterator[Callable[[str], subprocess.Popen[str]]]:
    """Provide a function that starts a command and waits until it hangs."""
    started = []

    def start_command(where: str) -> subprocess.Popen[str]:
        process = subprocess.Popen([sys.executable, '-c', HANGING, where], text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        started.append(process)
        assert process.stdout is not None
        assert process.stdout.readline() == 'hangs\n'
        return process

    yield start_command
    for process in started:
        process.kill()
        process.wait()


@pytest.mark.parametrize(('where', 'number', 'presses', 'code', 'said', 'out'), [
    ('imports', signal.SIGINT, 1, 130, 'canceled', ''),
    ('imports', signal.SIGTERM, 1, 143, 'ended by SIGTERM', ''),
    ('work', signal.SIGINT, 1, 130, 'canceled', 'cleaned up\n'),
    ('work', signal.SIGINT, 3, 130, 'canceled', 'cleaned up\n'),
    ('work', signal.SIGHUP, 1, 129, 'ended by SIGHUP', 'cleaned up\n'),
    ('deaf', signal.SIGINT, 3, 130, 'canceled', 'cleaned up\n')],
    ids=['imports', 'imports SIGTERM', 'work', 'work thrice', 'work SIGHUP', 'deaf thrice'])
def test_command_ends_in_good_order(start: Callable[[str], subprocess.Popen[str]], where: str,
                                    number: signal.Signals, presses: int, code: int, said: str,
                                    out: str) -> None:
    process = start(where)
    for _ in range(presses):
        process.send_signal(number)
        time.sleep(0.05)
    shown, errors = process.communicate(timeout=60)
    assert (process.returncode, errors, shown) == (code, f'flex-planner: {said}\n', out)


def test_interrupt_while_python_ends_changes_nothing(
        start: Callable[[str], subprocess.Popen[str]]) -> None:
    process = start('end')
    assert process.stdout is not None
    assert process.stdout.readline() == 'ends\n'
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60) == ('', '')
    assert process.returncode == 0


def press() -> None:
    signal.raise_signal(signal.SIGINT)


def test_interruption_that_python_drops_comes_again() -> None:
    class Dropping:
        def __del__(self) -> None:
            press()

    def work() -> int:
        Dropping()
        time.sleep(60)
        return 0

    assert run_command(work, ends=False) == 130


def test_interruption_that_becomes_another_error_is_known(
        capsys: pytest.CaptureFixture[str]) -> None:
    def work() -> int:
        try:
            press()
        except KeyboardInterrupt:
            raise RuntimeError('a library failed') from None
        return 0

    assert run_command(work, ends=False) == 130
    assert capsys.readouterr().err == 'flex-planner: canceled\n'


def test_import_is_not_interrupted_in_its_middle(tmp_path: Path,
                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'half_imported.py').write_text(
        'import signal\ntry:\n    signal.raise_signal(signal.SIGINT)\n'
        'except KeyboardInterrupt:\n    raise ImportError from None\nwhole = True\n')
    monkeypatch.syspath_prepend(tmp_path)

    def work() -> int:
        import half_imported  # type: ignore[import-not-found]

        assert half_imported.whole
        time.sleep(60)
        return 0

    assert run_command(work, ends=False) == 130
    assert 'half_imported' in sys.modules


def test_file_that_is_being_written_becomes_whole(capsys: pytest.CaptureFixture[str],
                                                  tmp_path: Path) -> None:
    def draw(path: Path) -> None:
        path.write_text('drawn')

    def files() -> Iterator[tuple[str, str]]:
        press()
        (tmp_path / 'recording').write_text('whole')
        yield 'recording', 'recording'
        yield from drawn('picture', tmp_path / 'picture', draw)

    def work() -> int:
        print_files(files())
        return 0

    assert run_command(work, ends=False) == 130
    assert capsys.readouterr().err == 'flex-planner: canceled\n'
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [
        ('recording', 'whole')]


def test_picture_is_not_waited_for(tmp_path: Path) -> None:
    def draw(path: Path) -> None:
        press()
        path.write_text('drawn')

    def work() -> int:
        print_files(drawn('picture', tmp_path / 'picture', draw))
        return 0

    assert run_command(work, ends=False) == 130
    assert not list(tmp_path.iterdir())


def test_signals_mean_what_they_meant_before(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM)
    before = [signal.getsignal(number) for number in numbers]
    with CommandSignals():
        assert signal.getsignal(signal.SIGTERM) is not before[1]
    assert [signal.getsignal(number) for number in numbers] == before


def test_nohup_is_obeyed() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with SIGNALS:
            os.kill(os.getpid(), signal.SIGHUP)
        assert SIGNALS.number == 0
    finally:
        signal.signal(signal.SIGHUP, before)
