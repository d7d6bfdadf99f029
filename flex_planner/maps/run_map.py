"""A map computed from where it is: on all processors of this machine, or on a cluster."""

from __future__ import annotations

from collections.abc import Callable
import time

from distributed import Client
from distributed.comm import get_address_host
from flex_planner.base.version import VERSION
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.maps.block_solver import blocks, solve_block
from flex_planner.maps.cluster import (
    ClusterError,
    default_workers,
    local_cluster,
    remote_cluster,
    threads,
)
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.scheduling import BlockSolver, compute
from flex_planner.maps.store import MapStore
from flex_planner.maps.study import Study
from flex_planner.maps.tally import Tally
from flex_planner.optimal_control.arm_model import ArmModel

_WARM_UP = 300.0  # [s], to derive and compile on a strange machine
_OFTEN = 0.05  # [s], between two looks at it


def run_map(study: Study, store: MapStore, *, workers: int = 0, scheduler: str = '',
            solve: BlockSolver = solve_block, begin: Callable[[str], None] = lambda phase: None,
            report: Callable[[Tally], None] = lambda tally: None,
            canceled: Callable[[], bool] = lambda: False) -> Tally:
    """
    Compute the blocks of a map that are not complete.

    Parameters
    ----------
    study, store
        What is computed, and where it goes.
    workers : int
        Processes on this machine; 0 for one per processor. Never more than blocks.
    scheduler : str
        Address of a cluster to use instead; empty for none.
    solve : callable
        What solves a block.
    begin : callable
        Receives the name of each phase.
    report, canceled : callable
        As of :func:`compute`, which also says what is raised and returned.

    """
    left = [block for block in blocks(study) if not store.is_complete(block)]
    if not left:
        return Tally(store.codes)
    if scheduler:
        begin(f'connecting to {scheduler}')
        with remote_cluster(scheduler) as client:
            begin(f'preparing the dynamics of {study.arm.name} on {len(threads(client))} workers')
            warm_up(client, study, canceled)
            return compute(study, store, client, left, solve, report=report, canceled=canceled)
    begin(f'preparing the dynamics of {study.arm.name}')
    _compile(study)  # the workers find it in the cache
    count = min(workers or default_workers(), len(left))
    begin(f'starting {count} processes')
    with local_cluster(count) as client:
        tally = compute(study, store, client, left, solve, report=report, canceled=canceled)
        begin('stopping the processes')
    return tally


def warm_up(client: Client, study: Study, canceled: Callable[[], bool] = lambda: False) -> None:
    """
    Have one worker of every machine compile the arm's functions, which others find in its cache.

    Raises
    ------
    ClusterError
        If a machine cannot do it, or has another version of this package.

    """
    hosts = {get_address_host(address): address for address in threads(client)}
    futures = {address: client.submit(_ready, study, workers=[address], pure=False)
               for address in hosts.values()}
    until = time.monotonic() + _WARM_UP
    while (any(not future.done() for future in futures.values())
           and time.monotonic() < until and not canceled()):
        time.sleep(_OFTEN)
    for address, future in futures.items():
        if canceled():
            return
        if future.status != 'finished':
            reason = future.exception() if future.done() else f'not ready in {_WARM_UP:g} s'
            raise ClusterError(f'worker {address} cannot compute: {reason}')
        if future.result() != VERSION:
            raise ClusterError(f'worker {address} has flex_planner {future.result()}, but this '
                               f'is {VERSION}')


def _ready(study: Study) -> str:
    """Compile what a study needs; return the version of this package. Runs on a worker."""
    _compile(study)
    return VERSION


def _compile(study: Study) -> None:
    """Have the functions of a study's arms in the cache of this machine."""
    ArmModel(study.arm)
    if study.quantity is Quantity.RESIDUAL_VIBRATION:
        ArmDynamics(study.plant((0,) * len(study.axes))[0])
