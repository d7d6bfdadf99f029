"""
Blocks of a map solved on a Dask cluster; the store is written by the client alone.

A block is solved again elsewhere if its worker dies. One that raises, or ends its workers, again
and again fails with its reason in every cell and does not end the run.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count, islice
from queue import Empty, SimpleQueue
import time
from typing import TypeAlias

from distributed import Client, Future, get_worker, KilledWorker
from flex_planner.base.processes import without_helpers
from flex_planner.base.progress import Monitor
from flex_planner.maps.axes import Block
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.cluster import ATTEMPTS, ClusterError, LOST, threads
from flex_planner.maps.store import cells, MapStore
from flex_planner.maps.study import Study
from flex_planner.maps.tally import Tally

BlockSolver: TypeAlias = Callable[[Study, Block, Monitor], Sequence[CellResult]]

_AHEAD = 4  # blocks under way for each thread
_FETCHING = 20.0  # [s], to have a result
_OFTEN = 0.25  # [s], between two looks at Ctrl-C
_COUNTED = 10.0  # [s], between two counts of the workers
_DESERTED = 300.0  # [s], without any, until the run ends
_RUNS = count()


def compute(study: Study, store: MapStore, client: Client, left: Sequence[Block],
            solve: BlockSolver, *, report: Callable[[Tally], None] = lambda tally: None,
            canceled: Callable[[], bool] = lambda: False) -> Tally:
    """
    Solve blocks, and write the results of each as soon as they arrive.

    Parameters
    ----------
    study, store
        What is computed, and where it goes.
    client : distributed.Client
        Of the cluster.
    left : sequence of tuple of slice
        The blocks.
    solve : callable
        ``solve_block``, or what takes its place; found by name on the workers.
    report : callable
        Receives the progress, several times per second.
    canceled : callable
        Says when to stop.

    Returns
    -------
    Tally
        Short of cells if it was canceled.

    Raises
    ------
    ClusterError
        If the scheduler is lost.
    OSError
        If the store cannot be written. In both cases, what is finished is kept.

    """
    tally, flight = Tally(store.codes), _Flight(client, study, left, solve)
    try:
        while not canceled() and flight.fill():
            landed = flight.next_result()
            if landed is not None:
                block, results = landed
                before = store.codes[block].copy()
                store.write(block, results)
                tally.count(before, store.codes[block])
            report(tally)
    finally:
        flight.abandon()
    return tally


class _Flight:
    """The blocks that are under way: a bounded number, in the order of the grid."""

    def __init__(self, client: Client, study: Study, left: Sequence[Block],
                 solve: BlockSolver) -> None:
        self._client, self._study, self._solve = client, study, solve
        self._run, self._left = f'map-{time.time_ns()}-{next(_RUNS)}', iter(enumerate(left))
        self._flying: dict[str, tuple[Future, Block]] = {}
        self._arrived: SimpleQueue[Future] = SimpleQueue()
        self._most, self._count_at = 1, time.monotonic()
        self._seen = self._count_at

    def fill(self) -> bool:
        """Send blocks off up to the number that is allowed; return whether any is under way."""
        self._count()
        for number, block in islice(self._left, self._most - len(self._flying)):
            future = self._client.submit(
                _solve_on_worker, self._solve, self._study, block, key=f'{self._run}-{number}',
                pure=False, retries=ATTEMPTS - 1, priority=-number)
            self._flying[future.key] = future, block
            future.add_done_callback(self._arrived.put)
        return bool(self._flying)

    def _count(self) -> None:
        """Count the workers from time to time: they come and go."""
        now = time.monotonic()
        if now < self._count_at:
            return
        there = sum(threads(self._client).values())
        self._most, self._count_at = max(1, _AHEAD * there), now + _COUNTED
        self._seen = now if there else self._seen
        if now > self._seen + _DESERTED:
            raise ClusterError(f'there has been no worker for {_DESERTED:g} s; finished blocks '
                               'are kept, and are not computed again')

    def next_result(self) -> tuple[Block, Sequence[CellResult]] | None:
        """Return a finished block with its results, or None if there is none for a moment."""
        try:
            future = self._arrived.get(timeout=_OFTEN)
        except Empty:
            return None
        block = self._flying[future.key][1]
        results = _outcome(future, block)
        if results is None:
            future.add_done_callback(self._arrived.put)
            return None
        del self._flying[future.key]
        return block, results

    def abandon(self) -> None:
        """Give up what is still under way."""
        self._client.cancel([future for future, _ in self._flying.values()], force=True)
        self._flying.clear()


def _solve_on_worker(solve: BlockSolver, study: Study, block: Block) -> Sequence[CellResult]:
    """Solve a block on a worker; there is one for each processor."""
    with without_helpers():
        results = solve(study, block, Monitor(canceled=_withdrawal_check()))
    there = {result.index for result in results if result.code != CellCode.PENDING}
    missing = [index for index in cells(block) if index not in there]
    if missing or len(results) != len(there):
        raise RuntimeError(f'the cells {missing} were left out')
    return results


def _withdrawal_check() -> Callable[[], bool]:
    """Return a function that says whether the client has given up the task that runs here."""
    worker = get_worker()
    key = worker.get_current_task()

    def is_withdrawn() -> bool:
        task = worker.state.tasks.get(key)
        return task is None or task.state == 'cancelled'

    return is_withdrawn


def _outcome(future: Future, block: Block) -> Sequence[CellResult] | None:
    """Return the results of a block's cells; None if it was lost and is solved again."""
    status = future.status  # which may change at any time, as workers die
    if status == 'cancelled':
        raise ClusterError(LOST)
    if status == 'error':
        return _failed_results(block, future.exception())
    if status == 'finished':
        try:
            found: Sequence[CellResult] = future.result(timeout=_FETCHING)
            return found
        except TimeoutError:
            return None
        except Exception as error:
            if future.status == 'finished':  # it is there, but cannot be read
                return _failed_results(block, error)
    return None


def _failed_results(block: Block, error: BaseException | None) -> Sequence[CellResult]:
    """Return the cells of a block that could not be solved."""
    return [CellResult(index=index, code=CellCode.FAILED, message=_reason(error))
            for index in cells(block)]


def _reason(error: BaseException | None) -> str:
    """Return the reason of a block's failure."""
    if isinstance(error, KilledWorker):
        return ('the processes that solved its block died, one after the other; perhaps out of '
                'memory')
    return f'{type(error).__name__}: {error}'
