"""Maps computed on a cluster: what is lost when something dies, and that it changes no number."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from types import SimpleNamespace
from typing import Any
import warnings

import dask
from distributed import Client
from flex_planner.cli import main
from flex_planner.cli.map_progress import progress_line
from flex_planner.maps.block_solver import blocks, solve_block
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.cluster import ClusterError, local_cluster
from flex_planner.maps.run_map import run_map
from flex_planner.maps.scheduling import _outcome, compute
from flex_planner.maps.store import MapStore, open_map
from flex_planner.maps.study import load_study
from flex_planner.maps.tally import Tally
import map_support
from map_support import small_study, SUPPORT, TROUBLE, value_of
import numpy as np
import pytest
import xarray as xr

STUDY = """\
name: Small
arm: korayem_rigid
quantity: min_effort
start: [0.5, 0.0]
duration: 1.0
effort_weights: [0.125, 0.125]
axes:
  goal_x: {from: 0.3, to: 0.8, count: 3}
  goal_y: {from: 0.3, to: 0.9, count: 4}
block: {goal_x: 2, goal_y: 2}
"""
LARGE = STUDY.replace('3}', '30}').replace('4}', '30}').replace('2, goal_y: 2', '1, goal_y: 2')
PATIENCE = 60.0  # [s], on a busy machine


@pytest.fixture(scope='module')
def notes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Provide the folder that the workers know for their notes."""
    folder = tmp_path_factory.mktemp('notes')
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(TROUBLE, str(folder))
        yield folder


@pytest.fixture(scope='module')
def client(notes: Path) -> Iterator[Client]:
    with local_cluster(2) as client:
        yield client


@pytest.fixture(autouse=True)
def clear(notes: Path) -> None:
    for note in notes.iterdir():
        note.unlink()


@pytest.fixture
def store(tmp_path: Path) -> Iterator[MapStore]:
    with MapStore.of(tmp_path / 'small.zarr', small_study()) as store:
        yield store


def eventually(what: str, condition: Callable[[], Any]) -> None:
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until, f'waited for {what}: not within {PATIENCE:g} s'
        time.sleep(0.05)


def runs(pid: int) -> bool:
    """Return whether a process is there, and not only as an entry that nobody has reaped."""
    try:
        stat = Path('/proc', str(pid), 'stat').read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False
    return stat.rpartition(')')[2].split()[0] not in 'ZX'


def begun(notes: Path) -> Counter[str]:
    """Return how often each block was begun, by its corner."""
    counts: Counter[str] = Counter()
    for note in notes.glob('block-*'):
        counts[note.name.rpartition('-')[0]] += len(note.read_text().splitlines())
    return counts


def left(store: MapStore) -> list[tuple[slice, ...]]:
    return [block for block in blocks(small_study()) if not store.is_complete(block)]


def assert_right(store: MapStore, failed: int = 0) -> None:
    """Check every cell against what the stand-in gives."""
    found = store.dataset().load()
    assert (found.code == CellCode.FAILED).sum() == failed
    for index in np.ndindex(found.code.shape):
        if found.code[index] == CellCode.SOLVED:
            assert found.max_payload[index] == value_of(index)
        else:
            assert np.isnan(found.max_payload[index])
            assert found.message[index]
    assert (found.code[0] == CellCode.INFEASIBLE).all() or failed


def test_map_of_two_processes_equals_its_cells_solved_one_by_one(
        client: Client, tmp_path: Path) -> None:
    (tmp_path / 'small.yaml').write_text(STUDY)
    study = load_study(tmp_path / 'small.yaml')
    maps: list[xr.Dataset] = []
    for name, order in (('there', 1), ('back', -1)):
        with MapStore.of(tmp_path / f'{name}.zarr', study) as store:
            tally = compute(study, store, client, blocks(study)[::order], solve_block)
            maps.append(store.dataset().load().drop_vars('seconds'))
        assert (tally.done, tally.cells) == (12, 12)
    assert maps[0].drop_attrs().identical(maps[1].drop_attrs())
    alone = [result for block in blocks(study) for result in solve_block(study, block)]
    assert {result.code for result in alone} == {CellCode.SOLVED, CellCode.UNREACHABLE}
    for result in alone:
        cell = maps[0].isel(dict(zip(('goal_x', 'goal_y'), result.index, strict=True)))
        for name in ('code', 'message', 'cost', 'tip_error', 'warm', 'iterations'):
            np.testing.assert_equal(cell[name].item(), getattr(result, name))
        np.testing.assert_equal(cell.min_effort.item(), result.value)


def test_worker_that_is_killed_costs_its_current_block(client: Client, store: MapStore,
                                                       notes: Path) -> None:
    victims: list[int] = []

    def kill(tally: Tally) -> None:
        if tally.done and not victims:
            victims.extend(client.run(os.getpid).values())
            os.kill(victims[0], signal.SIGKILL)

    compute(small_study(), store, client, left(store), map_support.solve_slowly, report=kill)
    assert_right(store)
    assert len(begun(notes)) == 6
    # the one that was cut off; one may have been done and not yet been told
    assert 6 <= sum(begun(notes).values()) <= 8


def test_worker_that_dies_of_a_block_is_forgiven_once(client: Client, store: MapStore) -> None:
    tally = compute(small_study(), store, client, left(store), map_support.die_once)
    assert tally.done == 24
    assert_right(store)


def test_block_that_kills_its_workers_fails_alone(client: Client, store: MapStore) -> None:
    tally = compute(small_study(), store, client, left(store), map_support.die_always)
    assert (tally.done, tally.of(CellCode.FAILED)) == (24, 4)
    assert_right(store, failed=4)
    assert 'died, one after the other' in store.dataset().message[3, 0].item()


def test_block_that_raises_or_leaves_out_cells_fails_with_its_reason(client: Client,
                                                                     store: MapStore) -> None:
    compute(small_study(), store, client, left(store), map_support.raise_always)
    assert_right(store, failed=8)
    messages = store.dataset().message
    assert messages[3, 0].item() == 'ZeroDivisionError: this block is cursed'
    assert messages[0, 0].item() == 'RuntimeError: the cells [(1, 1)] were left out'


def test_full_disk_ends_the_run_and_keeps_finished_blocks(client: Client,
                                                          store: MapStore) -> None:
    with (map_support.full_disk(store.path, 2, 2),
          pytest.raises(OSError, match='No space left on device')):
        compute(small_study(), store, client, left(store), map_support.solve)
    assert len(left(store)) == 4
    assert compute(small_study(), store, client, left(store), map_support.solve).computed == 16
    assert_right(store)


@pytest.mark.parametrize('status', ['pending', 'lost'])
def test_result_that_died_with_its_worker_is_waited_for_again(status: str) -> None:
    assert _outcome(SimpleNamespace(status=status), blocks(small_study())[0]) is None


def test_lost_scheduler_fails_no_cell() -> None:
    with pytest.raises(ClusterError, match='the scheduler was lost; finished blocks are kept'):
        _outcome(SimpleNamespace(status='cancelled'), blocks(small_study())[0])


def test_canceled_run_tells_its_workers(client: Client, store: MapStore, notes: Path) -> None:
    def begun() -> bool:
        return any(notes.glob('begun-*'))

    tally = compute(small_study(), store, client, left(store), map_support.solve_until_canceled,
                    canceled=begun)
    assert tally.done == 0
    eventually('all workers to hear of it', lambda: (
        len(list(notes.glob('begun-*'))) == len(list(notes.glob('canceled-*')))))


def test_client_that_is_killed_loses_no_finished_block(client: Client, tmp_path: Path,
                                                       notes: Path) -> None:
    path, own = tmp_path / 'killed.zarr', tmp_path / 'own'
    own.mkdir()
    process = subprocess.Popen([sys.executable, '-c', 'import map_support, sys; '
                                'map_support.run(sys.argv[1])', str(path)],
                               cwd=SUPPORT, start_new_session=True,
                               env={**os.environ, TROUBLE: str(own)})
    eventually('eight cells', lambda: (
        path.exists() and (open_map(path).code != 0).sum() >= 8))
    process.kill()
    process.wait()
    pids = [int(note.name.rpartition('-')[2]) for note in own.glob('block-*')]
    eventually('the end of its workers', lambda: not any(map(runs, pids)))
    with MapStore.of(path, small_study()) as store:
        wanted = {f'block-{block[0].start}-{block[1].start}' for block in left(store)}
        compute(small_study(), store, client, left(store), map_support.solve_slowly)
        assert set(begun(notes)) == wanted
        assert len(wanted) < 6
        assert_right(store)


def test_processes_keep_no_profile_which_would_grow(client: Client) -> None:
    setting = 'distributed.worker.profile.enabled'
    assert set(client.run(dask.config.get, setting).values()) == {False}


def test_second_cluster_on_a_machine_is_no_cause_for_warnings(client: Client) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        with local_cluster(1) as other:
            assert other.submit(abs, -1).result() == 1


def test_map_is_computed_on_a_cluster_that_is_there(client: Client, store: MapStore) -> None:
    phases: list[str] = []
    eventually('two workers', lambda: len(client.nthreads()) == 2)  # killed ones are there again
    tally = run_map(small_study(), store, scheduler=client.scheduler.address,
                    solve=map_support.solve, begin=phases.append)
    assert tally.done == 24
    assert phases[1].endswith('on 2 workers')
    assert_right(store)


def test_cluster_that_is_not_there_is_named(store: MapStore,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('flex_planner.maps.cluster._CONNECTING', 0.3)
    with pytest.raises(ClusterError, match='no scheduler answers at tcp://127.0.0.1:9'):
        run_map(small_study(), store, scheduler='tcp://127.0.0.1:9')


def test_workers_leave_no_files_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    with local_cluster(1) as client:
        client.wait_for_workers(1, timeout=PATIENCE)
        assert list(tmp_path.rglob('worker-*'))
    assert not list(tmp_path.iterdir())


def test_command_stops_on_interrupt_and_goes_on_later(tmp_path: Path) -> None:
    study, path = tmp_path / 'large.yaml', tmp_path / 'large.zarr'
    study.write_text(LARGE)
    command = [sys.executable, '-m', 'flex_planner.cli', 'map', str(study), '--output', str(path),
               '--workers', '2']
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    eventually('a first cell', lambda: path.exists() and (open_map(path).code != 0).any())
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    done = int((open_map(path).code != 0).sum())
    assert 0 < done < 900
    assert said.splitlines()[-1] == (f'flex-planner: canceled: {done} of 900 cells are kept in '
                                     f'{path}; run the same command to go on')
    assert 'Traceback' not in said


def test_command_draws_what_is_there(client: Client, tmp_path: Path,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    study = tmp_path / 'small.yaml'
    study.write_text(STUDY)
    command = ['map', str(study), '--output', str(tmp_path), '--scheduler',
               client.scheduler.address, '--no-plot']
    assert main(command) == 0
    said = capsys.readouterr().out
    assert 'cells                      12 of 12' in said
    assert '3, start or goal cannot be reached' in said
    assert 'minimum effort             0.0326' in said
    assert main(command) == 0
    assert 'small.zarr: 12 of 12 cells are computed already' in capsys.readouterr().out
    assert main(['map', str(tmp_path / 'small.zarr'), '--draw']) == 0
    assert all(picture.stat().st_size > 10_000 for picture in (tmp_path / 'small').iterdir())


def test_command_without_its_packages_says_how_to_get_them(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(sys.modules, 'zarr', None)
    for name in ('store', 'store_layout', 'stored_map', 'zarr_groups'):
        monkeypatch.delitem(sys.modules, f'flex_planner.maps.{name}')
    assert main(['map', 'small.yaml']) == 1
    assert "pip install 'flex_planner[maps]'" in capsys.readouterr().err


def test_progress_tells_cells_rate_and_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, 'monotonic', lambda: now[0])
    codes = np.zeros((10, 10), dtype=np.int8)
    tally = Tally(codes)
    assert progress_line(tally) == '0/100 cells, 0 failed'
    for row, code in ((0, CellCode.SOLVED), (1, CellCode.INFEASIBLE)):
        now[0] += 100.0
        before = codes[row].copy()
        codes[row] = code
        tally.count(before, codes[row])
    # of the last minute, and of the time since the block before it
    assert progress_line(tally, bar=True) == (
        '[##........] 20/100 cells, 10 failed, 0.1 cells/s, 0:13:20 left')
    now[0] += 900.0
    assert progress_line(tally).endswith('0.01 cells/s, 2:13:20 left')


@pytest.mark.parametrize(('options', 'text'), [
    (['--workers', '0'], '--workers is 0, but must be'),
    (['--workers', '2', '--scheduler', 'tcp://a:1'], '--workers is 2, but must be left out'),
    (['--output', 'small.yaml/below'], 'Not a directory; the map is not created'),
    (['--output', 'folder.zarr'], 'folder.zarr exists, but is not a map'),
    (['--draw'], 'there is no map')])
def test_command_that_cannot_be_carried_out_says_why(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
        options: list[str], text: str) -> None:
    monkeypatch.chdir(tmp_path)
    Path('small.yaml').write_text(STUDY)
    Path('folder.zarr').mkdir()
    assert main(['map', 'small.yaml', *options]) == 1
    assert text in capsys.readouterr().err
