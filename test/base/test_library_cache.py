"""The folder of compiled functions: bounded, shared, cleared, and never a reason to fail."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
import errno
import logging
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any

from flex_planner.base import library_cache
from flex_planner.base.library_cache import (
    clear_cache,
    find_entries,
    keep_library,
    largest_size,
    read_library,
    remove_surplus,
    scratch_folder,
    SIZE_VARIABLE,
    warn_once,
)
from flex_planner.base.paths import PathError
from flex_planner.cli import main
from flex_planner.dynamics.compiled_functions import load_functions
import pytest

KEYS = [f'{number:024x}' for number in range(5)]
FUNCTIONS = {'f': {'batched': 1, 'inputs': [1], 'outputs': [[1, 1]]}}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty cache folder, which only this test uses, with all warnings new."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    monkeypatch.delenv(SIZE_VARIABLE, raising=False)
    warn_once.cache_clear()
    return tmp_path / 'flex_planner'


def keep(key: str, folder: Path, used: float, content: bytes = b'library') -> None:
    """Keep a library that was used at a time [s]."""
    with scratch_folder(folder) as scratch:
        library = Path(scratch, 'functions.so')
        library.write_bytes(content)
        keep_library(key, library, FUNCTIONS)
    for path in folder.glob(f'{key}*'):
        with suppress(FileNotFoundError):  # another process may clear the folder
            os.utime(path, (used, used))


def content(library: Path, functions: dict[str, Any]) -> bytes:
    assert functions == FUNCTIONS
    return library.read_bytes()


def kept(folder: Path) -> list[str]:
    return sorted(entry.key for entry in find_entries(folder))


def build() -> dict[str, tuple[Any, int]]:
    import casadi as ca

    x = ca.SX.sym('x')
    return {'square': (ca.Function('square', [x], [x**2]), 1)}


def test_library_is_found_again_and_its_use_noted(cache: Path) -> None:
    keep(KEYS[0], cache, used=1000.0, content=b'first')
    assert read_library(KEYS[0], content) == b'first'
    assert read_library(KEYS[1], content) is None
    assert next(find_entries(cache)).used > time.time() - 60


def test_least_recently_used_entries_are_removed_first(cache: Path) -> None:
    for age, key in enumerate(KEYS):
        keep(key, cache, used=time.time() - 100 * age, content=bytes(10_000))
    read_library(KEYS[4], content)  # the oldest is used again
    remove_surplus(cache, most=33_000)
    assert kept(cache) == [KEYS[0], KEYS[1], KEYS[4]]


def test_new_entry_makes_room_for_itself_and_stays_even_if_it_is_too_large(
        cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(SIZE_VARIABLE, '1')
    for key in KEYS[:3]:
        keep(key, cache, used=1000.0, content=bytes(400_000))
    assert len(kept(cache)) == 2
    keep(KEYS[3], cache, used=1000.0, content=bytes(2_000_000))
    assert kept(cache) == [KEYS[3]]


@pytest.mark.parametrize('text', ['0', '-1', 'nan', 'inf', '1e9', 'large', '010', '1_000'])
def test_size_that_is_none_is_named_and_replaced(monkeypatch: pytest.MonkeyPatch, text: str,
                                                 caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setenv(SIZE_VARIABLE, text)
    assert largest_size() == largest_size() == 500e6
    assert [record.getMessage() for record in caplog.records] == [
        f"{SIZE_VARIABLE} is '{text}', but must be a number from 1 to 1e+06 MB: 500 MB are used"]


def test_remains_of_killed_builds_are_removed_after_a_while(cache: Path) -> None:
    old = time.time() - 7200
    for name in ('build-old', 'build-new'):
        (cache / name).mkdir(parents=True)
        (cache / name / 'functions.c').touch()
    alone = cache / f'{KEYS[0]}-{"0" * 16}.so'
    alone.touch()
    for path in (cache / 'build-old', alone):
        os.utime(path, (old, old))
    remove_surplus(cache, most=1e9)
    assert sorted(path.name for path in cache.iterdir()) == ['build-new']


def test_clearing_removes_all_entries_and_nothing_else(cache: Path) -> None:
    for key in KEYS:
        keep(key, cache, used=1000.0)
    (cache / 'notes.txt').write_text('mine')
    (cache / 'build-now').mkdir()
    assert clear_cache()[0] == 5
    assert sorted(path.name for path in cache.iterdir()) == ['build-now', 'notes.txt']
    assert clear_cache() == (0, 0)


def test_command_shows_and_clears_the_folder(cache: Path, monkeypatch: pytest.MonkeyPatch,
                                             capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['cache']) == 0
    assert 'entries 0' in ' '.join(capsys.readouterr().out.split())  # there is no folder yet
    keep(KEYS[0], cache, used=1000.0, content=bytes(2_000_000))
    monkeypatch.setenv(SIZE_VARIABLE, '250')
    assert main(['cache']) == 0
    shown = ' '.join(capsys.readouterr().out.split())
    assert all(text in shown for text in (str(cache), 'entries 1', '2.0 MB, at most 250 MB'))
    assert main(['cache', '--clear']) == 0
    assert '1 entries, 2.0 MB' in capsys.readouterr().out
    assert kept(cache) == []


def fill_disk(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Let nothing be written below a folder."""
    write = Path.write_text

    def refuse(self: Path, *given: Any, **others: Any) -> int:
        if folder in self.parents:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self))
        return write(self, *given, **others)

    monkeypatch.setattr(Path, 'write_text', refuse)


def take_home(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    def fail(variable: str, default: str) -> Path:
        raise PathError('there is no home folder of this user')

    monkeypatch.setattr(library_cache, 'folder_from_environment', fail)


def make_read_only(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setenv('XDG_CACHE_HOME', '/proc')  # where even root can make no folder


@pytest.mark.parametrize(('spoil', 'reason'), [
    (fill_disk, 'No space left'), (take_home, 'no home folder'), (make_read_only, '/proc/flex')])
def test_folder_that_is_of_no_use_costs_one_warning(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture,
        spoil: Callable[[pytest.MonkeyPatch, Path], None], reason: str) -> None:
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path / 'tmp'))
    (tmp_path / 'tmp').mkdir()
    spoil(monkeypatch, tmp_path / 'flex_planner')
    import numpy as np

    for key in KEYS[:2]:  # an arm has several libraries
        square = load_functions(key, build)['square']
        assert square(np.array([[3.0]]))[0].item() == 9.0
        assert type(square).__name__ == '_NativeFunction'
    warned = [record.getMessage() for record in caplog.records
              if record.levelno >= logging.WARNING]
    assert len(warned) == 1
    assert warned[0].startswith('cannot keep compiled functions (')
    assert reason in warned[0]
    assert not list((tmp_path / 'tmp').iterdir())


@pytest.mark.parametrize('spoil', [Path.mkdir, os.mkfifo, Path.touch])
def test_foreign_file_in_the_place_of_an_entry_costs_one_warning(
        cache: Path, caplog: pytest.LogCaptureFixture, spoil: Callable[[Path], object]) -> None:
    import numpy as np

    cache.mkdir()
    spoil(cache / f'{KEYS[0]}.json')
    square = load_functions(KEYS[0], build)['square']
    assert square(np.array([[3.0]]))[0].item() == 9.0
    damaged = [record for record in caplog.records if 'are damaged' in record.getMessage()]
    assert len(damaged) == 1


@pytest.mark.parametrize('compiler', ['/bin/true', '/bin/false', '/', '"', 'no-such-compiler'])
def test_compiler_that_makes_nothing_is_none(compiler: str, monkeypatch: pytest.MonkeyPatch,
                                             caplog: pytest.LogCaptureFixture) -> None:
    import numpy as np

    monkeypatch.setenv('CC', compiler)
    square = load_functions(KEYS[0], build)['square']
    assert square(np.array([[3.0]]))[0].item() == 9.0
    interpreted = compiler in ('/bin/true', '/bin/false')  # else the next one is taken
    assert type(square).__name__ == ('_InterpretedFunction' if interpreted else '_NativeFunction')
    assert len(caplog.records) == interpreted


def test_processes_that_clear_and_build_at_once_do_not_disturb_each_other(tmp_path: Path) -> None:
    code = ('import time; from flex_planner.base.library_cache import clear_cache\n'
            'print("ready", flush=True)\n'
            'while True:\n    clear_cache(); time.sleep(0.001)')
    environment = {**os.environ, 'XDG_CACHE_HOME': str(tmp_path)}
    with subprocess.Popen([sys.executable, '-c', code], env=environment, text=True,
                          stdout=subprocess.PIPE) as other:
        try:
            assert other.stdout is not None
            assert other.stdout.readline() == 'ready\n'
            folder = tmp_path / 'flex_planner'
            for number in range(300):
                keep(KEYS[number % 5], folder, used=1000.0)
                assert read_library(KEYS[number % 5], content) in (b'library', None)
        finally:
            other.kill()
