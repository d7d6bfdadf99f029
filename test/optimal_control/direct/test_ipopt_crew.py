"""IPOPT in helper processes: it can be stopped at any time, and two do what one does."""

from __future__ import annotations

from collections.abc import Callable
import logging
import os
from pathlib import Path
import pickle
import signal
import subprocess
import sys
import threading
import time

from counter_examples import level_task
from flex_planner.base.helper_process import HelperPool, HelperProcess
from flex_planner.base.processes import PROCESSES
from flex_planner.base.progress import Monitor, Progress
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct import ipopt_crew as module
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.ipopt_crew import solve_each
from flex_planner.optimal_control.direct.ipopt_start import Start
from flex_planner.optimal_control.direct.result import DirectResult, DirectStatus
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.kinds.search import find_kinds, starting_paths
from huge_programme import huge_problem, solve_huge
import numpy as np
from plan_checks import problem_of
import pytest

# of a stop, a second of which is for machines that are busy [s]
PROMPTLY = 1.5


@pytest.fixture(autouse=True)
def helpers(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Allow so many helper processes; one if not told otherwise."""
    monkeypatch.setenv(PROCESSES, '1')
    return lambda count: monkeypatch.setenv(PROCESSES, str(count))


@pytest.fixture(scope='module')
def problem() -> MotionProblem:
    task = level_task('S12', 1.0)
    return problem_of(ArmModel.of(task.arm), task)


@pytest.fixture(scope='module')
def huge() -> MotionProblem:
    return huge_problem()


def solve_from(problem: MotionProblem, count: int,
               monitor: Monitor | None = None) -> list[DirectResult]:
    """Return what the first paths lead to."""
    paths = [lambda times, path=path: path(times / problem.task.duration, problem.task.duration)
             for path in starting_paths(problem, count)]
    direct = DirectProblem(problem.model, DirectSettings(intervals=12, max_iterations=60))
    return list(direct.solve_from_paths(paths, problem.parameters, problem.start, problem.goal,
                                        problem.task.duration, monitor=monitor))


# Two do what one does


def test_results_and_progress_do_not_depend_on_how_many_there_are(
        problem: MotionProblem, helpers: Callable[[int], None]) -> None:
    found, heard = [], []
    for count in (1, 2):
        helpers(count)
        lines: list[float] = []
        monitor = Monitor(report=lambda line, lines=lines: lines.append(line.residual))
        found.append(solve_from(problem, 9, monitor))
        heard.append(lines)
    assert {result.status for result in found[0]} == {DirectStatus.CONVERGED, DirectStatus.FAILED}
    for one, other in zip(*found, strict=True):
        assert (one.message, one.iterations) == (other.message, other.iterations)
        assert np.array_equal(one.iterate['x0'], other.iterate['x0'])
    assert heard[0] == heard[1]


def test_motions_are_those_of_this_process(problem: MotionProblem,
                                           helpers: Callable[[int], None]) -> None:
    there = solve_from(problem, 3)
    helpers(0)
    here = solve_from(problem, 3)
    for one, other in zip(here, there, strict=True):
        assert one.message == other.message
        np.testing.assert_allclose(one.states, other.states, atol=1e-6)


def test_kinds_come_in_the_same_order(problem: MotionProblem,
                                      helpers: Callable[[int], None]) -> None:
    found = []
    for count in (1, 2):
        helpers(count)
        kinds = find_kinds(problem, Free.NOTHING, 16, Solver())
        found.append([(kind.value, kind.sentence, kind.met) for kind in kinds])
    assert len(found[0]) > 1
    assert found[0] == found[1]


# Stopped


@pytest.mark.parametrize('seconds', [0.3, 3.0], ids=['derivation', 'iterations'])
def test_cancellation_is_obeyed_at_once(huge: MotionProblem,
                                        seconds: float) -> None:
    event = threading.Event()
    timer = threading.Timer(seconds, event.set)
    timer.start()
    began = time.monotonic()
    result = solve_huge(huge, Monitor(canceled=event.is_set))
    assert time.monotonic() - began < seconds + PROMPTLY
    assert (result.status, result.message) == (DirectStatus.STOPPED, 'canceled')


def test_time_limit_is_kept(huge: MotionProblem) -> None:
    began = time.monotonic()
    result = solve_huge(huge, Monitor(time_limit=0.5))
    assert time.monotonic() - began < 0.5 + PROMPTLY
    assert (result.status, result.message) == (DirectStatus.STOPPED, 'time limit reached')
    assert np.isfinite(result.states).all()


def test_helper_that_gives_up_is_kept(problem: MotionProblem,
                                      monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, '_PATIENCE', 10.0)  # on a busy machine
    for helper in module._POOL.borrow(9, 0):  # several that wait take turns
        helper.end()
    before = solve_from(problem, 1)
    kept = module._POOL.borrow(9, 0)
    for helper in kept:
        module._POOL.give_back(helper)
    lines: list[Progress] = []
    monitor = Monitor(report=lines.append, canceled=lambda: len(lines) > 2)
    [stopped] = solve_from(problem, 1, monitor)
    assert (stopped.status, len(lines)) == (DirectStatus.STOPPED, 3)
    assert module._POOL.borrow(9, 0) == kept
    for helper in kept:
        module._POOL.give_back(helper)
    [again] = solve_from(problem, 1)
    assert np.array_equal(again.iterate['x0'], before[0].iterate['x0'])


PROGRAM = """
import signal, sys, time
sys.path[:] = {path!r}
# a shell's background job is started with Ctrl-C ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
from flex_planner import Monitor
from huge_programme import huge_problem, solve_huge
problem = huge_problem()
# Python drops a KeyboardInterrupt that comes amid some steps of an import: none is left to do
solve_huge(problem, Monitor(), 2)
try:
    print('begun', flush=True)
    solve_huge(problem, Monitor(report=lambda line: print(line.iteration, flush=True)))
except KeyboardInterrupt:
    print('interrupted', flush=True)
"""


@pytest.mark.parametrize(('line', 'signals', 'processes'), [
    ('begun', 1, '1'), ('2', 1, '1'), ('2', 2, '1'), ('1', 1, '0')],
    ids=['derivation', 'iterations', 'twice', 'in this process'])
def test_ctrl_c_ends_it(monkeypatch: pytest.MonkeyPatch, line: str, signals: int,
                        processes: str) -> None:
    monkeypatch.setenv(PROCESSES, processes)
    with subprocess.Popen([sys.executable, '-c', PROGRAM.format(path=sys.path)], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert any(said.strip() == line for said in iter(process.stdout.readline, ''))
        began = time.monotonic()
        for _ in range(signals):
            process.send_signal(signal.SIGINT)
        rest, errors = process.communicate()
    # in this process once an iteration has ended
    assert time.monotonic() - began < PROMPTLY + 10 * (processes == '0')
    assert rest.split()[-1] == 'interrupted' or 'KeyboardInterrupt' in errors and signals == 2


# Lost


def test_start_whose_helper_dies_is_solved_by_another(
        problem: MotionProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = solve_from(problem, 2)
    kill_at_work(monkeypatch, 1)
    for one, other in zip(solve_from(problem, 2), expected, strict=True):
        assert one.message == other.message
        assert np.array_equal(one.iterate['x0'], other.iterate['x0'])


def test_start_that_ends_two_helpers_fails_with_the_reason(
        problem: MotionProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    kill_at_work(monkeypatch, 2)
    lost, solved = solve_from(problem, 2)
    assert lost.status is DirectStatus.FAILED
    assert lost.message == 'its process ended by signal 9'
    assert solved.converged


def test_helpers_that_died_at_rest_are_replaced(problem: MotionProblem,
                                                helpers: Callable[[int], None]) -> None:
    helpers(2)
    solve_from(problem, 9)
    kept = module._POOL.borrow(9, 0)
    assert len(kept) >= 2
    for helper in kept:
        os.kill(helper.process_id, signal.SIGKILL)
        module._POOL.give_back(helper)
    assert [result.converged for result in solve_from(problem, 2)] == [True, True]


def kill_at_work(monkeypatch: pytest.MonkeyPatch, times: int) -> None:
    """End helpers as soon as they have been given a start."""
    left, original = [True] * times, HelperProcess.send

    def send(helper: HelperProcess, request: object) -> None:
        original(helper, request)
        if left:
            left.pop()
            os.kill(helper.process_id, signal.SIGKILL)

    monkeypatch.setattr(HelperProcess, 'send', send)


@pytest.mark.parametrize('executable', ['/bin/true', '/nowhere/python', 'python-that-ends'])
def test_where_no_other_process_can_be_had_this_one_does_it(
        problem: MotionProblem, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
        caplog: pytest.LogCaptureFixture, executable: str) -> None:
    (tmp_path / 'python-that-ends').symlink_to('/bin/true')
    monkeypatch.setattr('flex_planner.base.helper_process.get_executable',
                        lambda: str(tmp_path / executable))
    monkeypatch.setattr(module, '_POOL', HelperPool('nothing', kept=1))
    module._warn_once.cache_clear()
    assert [result.converged for result in solve_from(problem, 2)] == [True, True]
    assert {record.levelno for record in caplog.records} == {logging.WARNING}
    assert len(caplog.records) == 1
    assert caplog.messages[0].startswith('IPOPT runs in this process')


def test_error_in_a_helper_is_raised_here() -> None:
    start = Start(recipe=pickle.dumps(('no arm', 'no mesh', None, {})), inputs={})
    with pytest.raises(AttributeError, match="'str' object has no attribute"):
        list(solve_each([start], Monitor(), 1))
