"""Helper processes: they answer, end with who wants them, and never outlive him."""

from __future__ import annotations

from collections.abc import Iterator
import os
from pathlib import Path
import signal
import subprocess
import sys
import textwrap
import time

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.helper_process import HelperLostError, HelperPool, HelperProcess
from flex_planner.base.processes import helper_processes, PROCESSES, without_helpers
import pytest

# what an interpreter may take to start where others keep all processors busy [s]
PATIENCE = 60.0
# echoes; computes without end and without a look at Python when asked to
ECHO = """
import re
from flex_planner.base.helper_process import ending_with_caller

def serve(requests, replies):
    replies.send(None)
    while True:
        request = requests.recv()
        with ending_with_caller(requests):
            if request == 'compute':
                replies.send('computing')
                re.match(r'(a|a)*b', 'a' * 60)
        replies.send(request)
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / 'echoing_helper.py').write_text(ECHO)
    monkeypatch.syspath_prepend(tmp_path)
    return 'echoing_helper'


@pytest.fixture
def helper(module: str) -> Iterator[HelperProcess]:
    started = HelperProcess(module)
    yield started
    started.end()


def has_ended(number: int) -> bool:
    """Wait until a process is gone, or has ended and waits for its parent."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        try:
            if Path(f'/proc/{number}/stat').read_text().rsplit(')', 1)[1].split()[0] == 'Z':
                return True
        except OSError:
            return True
        time.sleep(0.01)
    return False


def test_it_says_that_it_is_ready_and_answers(helper: HelperProcess) -> None:
    assert helper.receive() is None
    for request in ('a', ['b', 1.5]):
        helper.send(request)
        assert helper.receive() == request
    assert HelperProcess.wait([helper], 0.0) == []


def test_it_ends_at_once_whatever_it_does(helper: HelperProcess) -> None:
    helper.receive()
    helper.send('compute')
    assert helper.receive() == 'computing'
    began = time.monotonic()
    helper.end()
    assert time.monotonic() - began < 0.5
    helper.end()  # again


def test_its_own_end_is_told(helper: HelperProcess) -> None:
    helper.receive()
    os.kill(helper.process_id, signal.SIGKILL)
    with pytest.raises(HelperLostError, match='ended by signal 9'):
        helper.receive()
    with pytest.raises(HelperLostError, match='ended by signal 9'):
        helper.send('too late')


@pytest.mark.parametrize('last', ['os.kill(os.getpid(), 9)', 'sys.exit()', 'os._exit(0)'])
def test_it_ends_with_its_caller_also_while_it_computes(module: str, tmp_path: Path,
                                                        last: str) -> None:
    code = textwrap.dedent(f"""
        import os, sys
        sys.path.insert(0, {str(tmp_path)!r})
        from flex_planner.base.helper_process import HelperProcess
        one, other = HelperProcess({module!r}), HelperProcess({module!r})
        one.receive(), other.receive()
        one.send('compute')
        one.receive()
        print(one.process_id, other.process_id, flush=True)
        {last}
        """)
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.stderr == ''
    assert all(has_ended(int(number)) for number in done.stdout.split())


def test_copy_of_the_process_leaves_the_helpers_alone(module: str) -> None:
    code = textwrap.dedent(f"""
        import os, sys
        sys.path[:] = {sys.path!r}
        from flex_planner.base.helper_process import HelperPool
        pool = HelperPool({module!r}, kept=2)
        [helper] = pool.borrow(1, 1)
        helper.receive()
        pool.give_back(helper)
        if not os.fork():
            [mine] = pool.borrow(1, 1)
            assert mine.receive() is None and mine is not helper
            sys.exit()
        assert os.wait()[1] == 0
        [again] = pool.borrow(1, 1)
        again.send('still there')
        print(again is helper, again.receive())
        """)
    done = subprocess.run([sys.executable, '-W', 'error', '-c', code], capture_output=True,
                          text=True)
    assert (done.stdout, done.stderr) == ('True still there\n', '')


def test_pool_keeps_so_many_for_the_next_use(module: str) -> None:
    pool = HelperPool(module, kept=1)
    first, second = pool.borrow(2, 2)
    for helper in (first, second):
        pool.give_back(helper)
    with pytest.raises(HelperLostError):
        second.receive()
    assert pool.borrow(2, 0) == [first]
    first.end()


def test_program_that_is_no_interpreter_is_not_started(module: str,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('flex_planner.base.helper_process.get_executable', lambda: '/bin/true')
    with pytest.raises(OSError, match='no Python interpreter'):
        HelperPool(module, kept=1).borrow(1, 1)


# How many


@pytest.mark.parametrize(('given', 'number'), [('0', 0), ('1', 1), ('12', 12)])
def test_environment_says_how_many(monkeypatch: pytest.MonkeyPatch, given: str,
                                   number: int) -> None:
    monkeypatch.setenv(PROCESSES, given)
    assert helper_processes() == number
    with without_helpers():  # which is said on purpose
        assert helper_processes() == number


def test_one_for_each_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(PROCESSES, raising=False)
    for processors, number in ((1, 1), (2, 2), (64, 4)):
        monkeypatch.setattr(os, 'sched_getaffinity', lambda _, n=processors: set(range(n)))
        assert helper_processes() == number
        with without_helpers():
            assert helper_processes() == 0
    assert PROCESSES not in os.environ


@pytest.mark.parametrize('given', ['two', '-1', '1.5', '²'])
def test_number_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch, given: str) -> None:
    monkeypatch.setenv(PROCESSES, given)
    with pytest.raises(InvalidValueError, match=f"{PROCESSES} is '{given}', but must be an int"):
        helper_processes()
