"""The processes that compute a map: a local Dask cluster, or an existing one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import logging
import tempfile

import dask
from dask.system import CPU_COUNT
from distributed import Client, LocalCluster
from distributed.system import MEMORY_LIMIT
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.base.processes import deaf_to_interrupts, one_thread_each
from flex_planner.maps.addresses import greet

ATTEMPTS = 3  # at a block that ends its process, or raises
LOST = 'the scheduler was lost; finished blocks are kept, and are not computed again'
_GREETING, _CONNECTING = 5.0, 10.0  # [s]
_CLOSING = 5.0  # [s]
_SHARE = 0.9  # of the memory, for all workers together
_ANY_PORT = '127.0.0.1:0'  # of the scheduler's pages; Dask warns if its own is another map's
_SETTINGS = {
    'distributed.scheduler.allowed-failures': ATTEMPTS - 1,
    # one block at a time in each process: another one is not blamed for the end of it
    'distributed.scheduler.worker-saturation': 1.0,
    # else a process that happens to be starting again that long after its end is given up
    'distributed.deploy.lost-worker-timeout': '1000 hours',
    # it keeps an hour of call stacks: 15 MB a minute in every process
    'distributed.worker.profile.enabled': False,
}
_NOISY = ('distributed', 'distributed.client', 'tornado.application')


class ClusterError(FlexPlannerError):
    """The processes that should compute a map cannot be had, or are lost."""


@contextmanager
def local_cluster(workers: int) -> Iterator[Client]:
    """
    Provide a client of processes on this machine, which end with it.

    Parameters
    ----------
    workers : int
        How many.

    Raises
    ------
    ClusterError
        If they cannot be started.

    """
    with _quiet(), one_thread_each(), _scratch_folder() as scratch, \
            dask.config.set({**_SETTINGS, 'temporary-directory': scratch}):
        try:
            with deaf_to_interrupts(pool=True):
                cluster = LocalCluster(
                    n_workers=workers, threads_per_worker=1, processes=True,
                    dashboard_address=None, scheduler_kwargs={'dashboard_address': _ANY_PORT},
                    memory_limit=int(_SHARE * MEMORY_LIMIT / workers),
                    silence_logs=logging.CRITICAL)
        except (OSError, RuntimeError) as error:
            raise ClusterError(f'cannot start {workers} processes: {error}') from error
        try:
            with Client(cluster, set_as_default=False) as client:
                yield client
        finally:
            cluster.close(timeout=_CLOSING)


def _scratch_folder() -> tempfile.TemporaryDirectory[str]:
    """Return a folder for what workers put aside; Dask would leave parts of it behind."""
    return tempfile.TemporaryDirectory(prefix='flex_planner-map-', ignore_cleanup_errors=True)


@contextmanager
def remote_cluster(address: str) -> Iterator[Client]:
    """
    Provide a client of an existing cluster.

    Parameters
    ----------
    address : str
        Of its scheduler, such as ``tcp://host:8786``.

    Raises
    ------
    ClusterError
        If it does not answer, or has no workers.
    InvalidValueError
        If it is no address.

    """
    with _quiet():
        try:
            greet(address, _GREETING)
            client = Client(address, timeout=_CONNECTING, set_as_default=False)
        except InvalidValueError:
            raise
        except Exception as error:  # of any kind where another program answers
            reason = str(error) or type(error).__name__
            raise ClusterError(f'no scheduler answers at {address}: {reason}') from error
        with client:
            try:
                client.wait_for_workers(1, timeout=_CONNECTING)
            except TimeoutError:
                raise ClusterError(f'the scheduler at {address} has no workers') from None
            yield client


def default_workers() -> int:
    """Return the number of processors that this process may use."""
    return int(CPU_COUNT)


def threads(client: Client) -> dict[str, int]:
    """Return the number of threads of every worker, by address; ClusterError if it is lost."""
    try:
        threads: dict[str, int] = client.nthreads()
    except Exception as error:
        raise ClusterError(LOST) from error
    return threads


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep what Dask logs of workers that come and go from the terminal."""
    loggers = [logging.getLogger(name) for name in _NOISY]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
