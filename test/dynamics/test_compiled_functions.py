"""Compiled functions: right, kept between processes, and never a reason to fail."""

from __future__ import annotations

from collections.abc import Callable
import logging
import os
from pathlib import Path
import platform
import shutil
import subprocess
import sys
import threading
import time
from typing import Any

import flex_planner
from flex_planner.arms.arm import Arm
from flex_planner.base import compiled_library
from flex_planner.base.compiled_library import content_key
from flex_planner.base.library_cache import cache_folder, warn_once
from flex_planner.dynamics import compiled_functions
from flex_planner.dynamics.compiled_functions import load_functions
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
import numpy as np
from numpy.typing import NDArray
import pytest

KEY = content_key('tiny')
POINTS = np.arange(6.0).reshape(3, 2)
SHARED = np.array([0.5])


def build() -> dict[str, tuple[Any, int]]:
    """Return a function of one batched and one shared input with a column and a matrix."""
    import casadi as ca

    x, p = ca.SX.sym('x', 2), ca.SX.sym('p')
    matrix = ca.vertcat(x.T, ca.horzcat(p, 7), x.T**2)  # 3 x 2
    return {'tiny': (ca.Function('tiny', [x, p], [ca.sin(x) + p, matrix]), 1)}


def never() -> dict[str, tuple[Any, int]]:
    raise AssertionError('built again although it was kept')


def check_tiny(functions: dict[str, compiled_functions.BatchFunction]) -> None:
    column, matrix = functions['tiny'](POINTS, SHARED)
    np.testing.assert_allclose(column, np.sin(POINTS) + 0.5, rtol=1e-15)  # rounding
    # a matrix arrives transposed: (points, columns, rows)
    expected = np.stack([POINTS, np.tile([0.5, 7.0], (3, 1)), POINTS**2], axis=-1)
    assert np.array_equal(matrix, expected)


@pytest.fixture(autouse=True)
def warnings_are_new() -> None:
    """Let a warning be logged that an earlier test has had."""
    warn_once.cache_clear()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty cache folder, which only this test uses."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    return tmp_path / 'flex_planner'


@pytest.fixture
def no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, 'which', lambda name: None)


def warnings_of(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records
            if record.levelno >= logging.WARNING]


def run_python(code: str, **environment: str) -> subprocess.Popen[str]:
    """Start the interpreter of this test on some code."""
    folder = str(Path(flex_planner.__file__).parents[1])
    return subprocess.Popen(
        [sys.executable, '-c', code], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env={**os.environ, 'PYTHONPATH': folder, **environment})


def test_functions_are_evaluated_point_by_point(cache: Path) -> None:
    check_tiny(load_functions(KEY, build))


def test_kept_functions_are_not_built_again(cache: Path,
                                            caplog: pytest.LogCaptureFixture) -> None:
    load_functions(KEY, build)
    check_tiny(load_functions(KEY, never))
    assert sorted(path.suffix for path in cache.iterdir()) == ['.json', '.so']
    assert not warnings_of(caplog)


def test_second_start_does_not_import_casadi(rigid_model: ArmModel) -> None:
    process = run_python(
        'import sys; from flex_planner.arms.arm_files import load_arm\n'
        'from flex_planner.planning.plan_path import plan_path\n'
        'from flex_planner.optimal_control.task import Task\n'
        "task = Task(arm=load_arm('korayem_rigid'), start_positions=[0, 1],\n"
        '            goal_positions=[1, 1], duration=1.0)\n'
        "print(plan_path(task).solved, 'casadi' in sys.modules)")
    out, err = process.communicate(timeout=60)
    assert (out, err) == ('True False\n', '')


@pytest.mark.parametrize('damage', [
    lambda data: data[:len(data) // 2], lambda data: b'', lambda data: data[::-1]],
    ids=['cut', 'empty', 'changed'])
@pytest.mark.parametrize('suffix', ['.so', '.json'])
def test_damaged_file_is_built_again_with_a_warning(
        cache: Path, caplog: pytest.LogCaptureFixture, suffix: str,
        damage: Callable[[bytes], bytes]) -> None:
    load_functions(KEY, build)
    path = next(cache.glob(f'*{suffix}'))
    # a new file: this process still has the old one mapped
    data = path.read_bytes()
    path.unlink()
    path.write_bytes(damage(data))
    check_tiny(load_functions(KEY, build))
    assert len(warnings_of(caplog)) == 1
    assert 'are damaged' in warnings_of(caplog)[0]
    check_tiny(load_functions(KEY, never))


@pytest.mark.parametrize('text', ['{}', '[]', '3', 'null', '{"library": 3, "sha256": ""}',
                                  '{"library": "x.so", "sha256": "", "functions": {}}'])
def test_entry_without_the_expected_content_is_built_again(cache: Path, text: str) -> None:
    cache.mkdir()
    (cache / f'{KEY}.json').write_text(text)
    check_tiny(load_functions(KEY, build))
    check_tiny(load_functions(KEY, never))


@pytest.mark.parametrize('suffix', ['.so', '.json'])
def test_missing_file_is_built_again(cache: Path, suffix: str) -> None:
    load_functions(KEY, build)
    next(cache.glob(f'*{suffix}')).unlink()
    check_tiny(load_functions(KEY, build))


@pytest.mark.usefixtures('no_compiler')
def test_without_compiler_functions_are_interpreted_with_one_warning(
        cache: Path, caplog: pytest.LogCaptureFixture) -> None:
    functions = load_functions(KEY, build)
    check_tiny(functions)
    check_tiny(functions)
    assert len(warnings_of(caplog)) == 1
    assert 'no C compiler' in warnings_of(caplog)[0]
    assert not cache.exists()


@pytest.mark.usefixtures('no_compiler')
def test_interpreted_arm_gives_the_values_of_the_compiled_one(rigid_arm: Arm, cache: Path,
                                                              rigid_model: ArmModel) -> None:
    interpreted, parameters = ArmModel(rigid_arm), Parameters.of(rigid_arm, payload_mass=1.0)
    p, physical = parameters.stack(), parameters.physical
    z = np.random.default_rng(0).normal(size=(5, 8))
    for ours, theirs in zip(interpreted.optimality_jacobian(z, p),
                            rigid_model.optimality_jacobian(z, p), strict=True):
        # rounding: the C compiler may fuse a multiplication and an addition
        np.testing.assert_allclose(ours, theirs, rtol=1e-11, atol=1e-11)
    state, torque = np.array([0.1, 0.2, 0.3, 0.4]), np.array([1.0, 2.0])
    np.testing.assert_allclose(interpreted.state_rate(physical)(state, torque),
                               rigid_model.state_rate(physical)(state, torque), rtol=1e-12)


def fake_compiler(folder: Path, script: str) -> str:
    path = folder / 'my-cc'
    path.write_text(f'#!/bin/sh\n{script}\n')
    path.chmod(0o755)
    return str(path)


def test_compiler_is_the_one_that_cc_names(cache: Path, tmp_path: Path,
                                           monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('CC', fake_compiler(tmp_path, f'touch {tmp_path}/used; exec cc "$@"'))
    check_tiny(load_functions(KEY, build))
    assert (tmp_path / 'used').exists()


def test_compiler_that_fails_is_no_compiler(cache: Path, tmp_path: Path,
                                            caplog: pytest.LogCaptureFixture,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    # e.g. a gcc without the headers of the C library
    monkeypatch.setenv('CC', fake_compiler(tmp_path, 'echo stdlib.h: not found >&2; exit 1'))
    check_tiny(load_functions(KEY, build))
    assert 'stdlib.h: not found' in '\n'.join(warnings_of(caplog))
    assert not list(cache.iterdir())


def build_beside_another(folder: str) -> None:
    """Build in the cache of ``$XDG_CACHE_HOME`` while another process builds the same."""

    def build_together() -> dict[str, tuple[Any, int]]:
        Path(folder, f'building-{os.getpid()}').touch()
        while len(list(Path(folder).glob('building-*'))) < 2:
            time.sleep(0.01)
        return build()

    check_tiny(load_functions(KEY, build_together))
    check_tiny(load_functions(KEY, never))


def test_two_processes_that_build_at_once_both_work(tmp_path: Path) -> None:
    code = (f'import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); '
            'import test_compiled_functions as t; '
            f't.build_beside_another({str(tmp_path)!r})')
    processes = [run_python(code, XDG_CACHE_HOME=str(tmp_path)) for _ in range(2)]
    assert [process.communicate(timeout=60)[1] for process in processes] == ['', '']
    assert [process.returncode for process in processes] == [0, 0]
    kept = {path.suffix for path in (tmp_path / 'flex_planner').iterdir()}
    assert kept == {'.so', '.json'}  # no build folder is left behind


def test_cache_folder_that_cannot_be_written_costs_only_a_warning(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / 'file').write_text('in the way')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'file'))
    check_tiny(load_functions(KEY, build))
    assert len(warnings_of(caplog)) == 1
    assert 'cannot keep compiled functions' in warnings_of(caplog)[0]


@pytest.mark.parametrize('root', ['', None])
def test_cache_is_in_the_home_folder_unless_told_otherwise(
        monkeypatch: pytest.MonkeyPatch, root: str | None) -> None:
    monkeypatch.setenv('HOME', '/nowhere')
    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    if root is not None:
        monkeypatch.setenv('XDG_CACHE_HOME', root)
    assert cache_folder() == Path('/nowhere/.cache/flex_planner')


def test_key_tells_apart_where_one_part_ends() -> None:
    keys = {content_key('ab', 'c'), content_key('a', 'bc'), content_key('abc'),
            content_key('c', 'ab'), content_key(b'abc')}
    assert len(keys) == 4  # bytes and text of the same content are the same


def test_key_tells_processors_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    # the code is compiled for one kind, and a home folder may serve several
    keys = []
    for flags in ('x86_64 flags: sse4_2 avx2', 'x86_64 flags: sse4_2', 'aarch64 Features: asimd'):
        monkeypatch.setattr(compiled_library, '_processor', lambda flags=flags: flags)
        keys.append(content_key('same'))
    assert len(set(keys)) == 3


def test_processor_is_known_by_its_flags_or_at_least_its_kind(
        monkeypatch: pytest.MonkeyPatch) -> None:
    find = compiled_library._processor.__wrapped__
    monkeypatch.setattr(Path, 'read_text', lambda self: 'model: x\nflags\t: sse avx\nflags\t: no')
    assert find() == f'{platform.machine()} flags\t: sse avx'

    def missing(self: Path) -> str:
        raise FileNotFoundError(self)

    monkeypatch.setattr(Path, 'read_text', missing)
    assert find() == f'{platform.machine()} '


@pytest.mark.parametrize('inputs', [
    (np.zeros((3, 3)), SHARED), (np.zeros(2), SHARED), (POINTS, np.zeros(2)),
    (POINTS, np.zeros((3, 1))), (POINTS,), (POINTS, SHARED, SHARED)])
def test_inputs_of_the_wrong_shape_are_refused(inputs: tuple[NDArray[np.float64], ...]) -> None:
    with pytest.raises(ValueError, match='inputs have shapes'):
        load_functions(KEY, build)['tiny'](*inputs)


def test_inputs_need_not_be_contiguous_or_floats() -> None:
    tiny = load_functions(KEY, build)['tiny']
    integers = np.arange(12).reshape(2, 6)[:, ::2].T  # (3, 2), strided
    for found, expected in zip(tiny(integers, SHARED), tiny(integers.astype(float).copy(),
                                                            SHARED), strict=True):
        assert np.array_equal(found, expected)


def test_no_points_give_no_results() -> None:
    column, matrix = load_functions(KEY, build)['tiny'](np.zeros((0, 2)), SHARED)
    assert (column.shape, matrix.shape) == ((0, 2), (0, 2, 3))


def test_repeated_call_reads_and_writes_the_same_arrays() -> None:
    x, p = np.zeros((1, 2)), np.array([0.5])
    column, matrix = np.empty((1, 2)), np.empty((1, 2, 3))
    run = load_functions(KEY, build)['tiny'].bind_arrays([x, p], [column, matrix])
    for value in (1.0, 2.0):
        x[:] = value
        run()
        np.testing.assert_allclose(column, np.sin(value) + 0.5, rtol=1e-15)  # rounding
        assert matrix[0, 0].tolist() == [value, 0.5, value**2]


def ticks_during(work: Callable[[], object]) -> tuple[float, int]:
    """Return how long work takes, and how often another thread had its turn meanwhile."""
    ticks, done = list[float](), threading.Event()

    def tick() -> None:
        while not done.wait(0.002):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    work()
    end = time.monotonic()
    done.set()
    thread.join()
    return end - start, sum(start < each < end for each in ticks)


def test_calls_release_the_interpreter_lock(ei50_model: ArmModel) -> None:
    p, z = Parameters.of(ei50_model.arm).stack(), np.ones((20_000, 24))
    seconds, ticks = ticks_during(lambda: ei50_model.optimality_jacobian(z, p))
    assert seconds > 0.04, 'too quick to tell; raise the number of points'
    # with the lock held there would be none; the call lasts for 20 ticks at the very least
    assert ticks >= 5
