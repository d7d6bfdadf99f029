"""Requests between the node's executor and its worker thread."""

from __future__ import annotations

from collections.abc import Iterator
import threading
import time
from typing import Any

from flex_planner.base.progress import Progress
from flex_planner.ros.planner.outcome import Outcome, unknown_failure
from flex_planner.ros.planner.request_queue import RequestQueue
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import PlanReport
import pytest


class FakeExecutor:
    """What a future needs of an executor, and a count of the times it was woken."""

    def __init__(self) -> None:
        self.woken = 0

    def create_task(self, callback: Any, *arguments: Any) -> None:
        callback(*arguments)

    def wake(self) -> None:
        self.woken += 1


@pytest.fixture
def queue() -> Iterator[RequestQueue]:
    queue = RequestQueue(1)
    yield queue
    assert queue.close(5)


@pytest.fixture
def settings() -> PlannerSettings:
    return PlannerSettings()


def wait(what: str, done: Any) -> None:
    end = time.monotonic() + 60
    while not done():
        assert time.monotonic() < end, f'waited for {what}'
        time.sleep(0.001)


def until_canceled(state: RequestState) -> Outcome:
    state.report(Progress(phase='test', iteration=3, residual=0.5, intervals=7))
    wait('the cancellation', state.is_canceled)
    return unknown_failure(ValueError('too late'))


def code(pending: Any) -> int:
    return int(pending.future.result().report.error_code)


def test_outcome_wakes_the_executor(queue: RequestQueue, settings: PlannerSettings) -> None:
    executor = FakeExecutor()
    pending = queue.submit(lambda state: unknown_failure(ValueError('x')), settings, executor)
    wait('the outcome', pending.future.done)
    wait('the executor to be woken', lambda: executor.woken)
    assert pending.future.result().report.error_msg == 'ValueError: x'


def test_exception_of_the_work_is_an_outcome(queue: RequestQueue,
                                             settings: PlannerSettings) -> None:
    def fail(state: RequestState) -> Outcome:
        raise KeyError('nobody foresaw this')

    pending = queue.submit(fail, settings, FakeExecutor())
    wait('the outcome', pending.future.done)
    assert code(pending) == PlanReport.UNKNOWN
    assert queue.active is None


def test_one_works_one_waits_and_the_third_is_refused(queue: RequestQueue,
                                                      settings: PlannerSettings) -> None:
    executor = FakeExecutor()
    first = queue.submit(until_canceled, settings, executor)
    wait('the third iteration', lambda: (
        queue.active is not None and queue.active.progress.iteration == 3))
    second = queue.submit(until_canceled, settings, executor)
    assert queue.waiting == 1
    assert code(queue.submit(until_canceled, settings, executor)) == PlanReport.BUSY
    queue.withdraw(second)
    assert queue.waiting == 0
    assert code(second) == PlanReport.CANCELED
    assert not first.future.done()
    queue.withdraw(first)


def test_withdrawn_request_has_its_outcome_at_once_and_keeps_it(
        queue: RequestQueue, settings: PlannerSettings) -> None:
    ended = threading.Event()

    def slow(state: RequestState) -> Outcome:
        until_canceled(state)
        time.sleep(0.05)
        ended.set()
        return unknown_failure(ValueError('too late'))

    pending = queue.submit(slow, settings, FakeExecutor())
    wait('a request at work', lambda: queue.active)
    queue.withdraw(pending)
    assert not ended.is_set()
    assert code(pending) == PlanReport.CANCELED
    wait('the end of the work', lambda: queue.active is None)
    assert ended.is_set()
    assert code(pending) == PlanReport.CANCELED


def test_request_that_is_withdrawn_while_it_waits_is_called_to_note_its_end(
        queue: RequestQueue, settings: PlannerSettings) -> None:
    noted: list[bool] = []

    def note(state: RequestState) -> Outcome:
        noted.append(state.withdrawn)
        return unknown_failure(ValueError('too late'))

    first = queue.submit(until_canceled, settings, FakeExecutor())
    wait('a request at work', lambda: queue.active)
    second = queue.submit(note, settings, FakeExecutor())
    queue.withdraw(second)
    assert code(second) == PlanReport.CANCELED
    third = queue.submit(until_canceled, settings, FakeExecutor())
    assert (queue.waiting, noted) == (1, [])
    queue.withdraw(first)
    wait('the note', lambda: noted)
    assert noted == [True]
    assert code(second) == PlanReport.CANCELED
    wait('the third', lambda: queue.active is third.state)
    queue.withdraw(third)


def test_desk_that_closes_tells_the_work_and_takes_no_more(settings: PlannerSettings) -> None:
    queue = RequestQueue(1)
    queue.submit(until_canceled, settings, FakeExecutor())
    wait('a request at work', lambda: queue.active)
    assert queue.close(5)
    assert code(queue.submit(until_canceled, settings, FakeExecutor())) == PlanReport.BUSY


def test_times_of_those_that_wait_are_bounded(settings: PlannerSettings) -> None:
    queue, executor = RequestQueue(10, 100.0), FakeExecutor()
    first = queue.submit(until_canceled, settings, executor, 1000.0)
    wait('a request at work', lambda: queue.active)
    waiting = [queue.submit(until_canceled, settings, executor, 40.0) for _ in range(2)]
    refused = queue.submit(until_canceled, settings, executor, 40.0)
    sentence = refused.future.result().report.error_msg
    assert code(refused) == PlanReport.BUSY
    assert 'may take 80 s and this one 40 s, together more than max_waiting_time = 100' in sentence
    # the one at work leaves in 1000 s, then the first of those that wait
    assert 'there is room in about 1000 s at the latest' in sentence
    longer = queue.submit(until_canceled, settings, executor, 200.0)
    assert 'about 1080 s at the latest' in longer.future.result().report.error_msg
    assert not queue.submit(until_canceled, settings, executor, 20.0).future.done()
    queue.withdraw(waiting[0])
    assert not queue.submit(until_canceled, settings, executor, 40.0).future.done()
    assert not first.future.done()
    assert queue.close(5)


def test_request_of_any_length_is_taken_by_an_idle_queue(settings: PlannerSettings) -> None:
    queue = RequestQueue(1, 1.0)
    pending = queue.submit(until_canceled, settings, FakeExecutor(), 3600.0)
    wait('a request at work', lambda: queue.active)
    assert not pending.future.done()
    assert queue.close(5)


def test_full_queue_says_when_there_is_room(settings: PlannerSettings) -> None:
    queue, executor = RequestQueue(2, 1e6), FakeExecutor()
    queue.submit(until_canceled, settings, executor, 30.0)
    wait('a request at work', lambda: queue.active)
    for _ in range(2):
        queue.submit(until_canceled, settings, executor, 500.0)
    refused = queue.submit(until_canceled, settings, executor, 1.0)
    assert refused.future.result().report.error_msg == (
        '2 requests are waiting already; the parameter queue_length allows no more: '
        'there is room in about 30 s at the latest, try again then')
    assert queue.close(5)


def test_time_that_a_request_waits_is_told_apart(queue: RequestQueue,
                                                 settings: PlannerSettings) -> None:
    executor = FakeExecutor()
    first = queue.submit(until_canceled, settings, executor)
    wait('a request at work', lambda: queue.active)
    second = queue.submit(until_canceled, settings, executor)
    time.sleep(0.05)
    queue.withdraw(first)
    wait('the next at work', lambda: queue.active is second.state)
    assert 0.05e9 <= second.state.waited_ns < 10e9
    waited = second.state.waited_ns
    time.sleep(0.02)
    assert second.state.waited_ns == waited < second.state.elapsed_ns
    queue.withdraw(second, 'nobody waits for it')
    assert second.future.result().report.error_msg == 'nobody waits for it'
