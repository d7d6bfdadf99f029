"""The store of a map: what xarray reads, what is refused, and what a full disk leaves."""

from __future__ import annotations

import errno
import json
from pathlib import Path
from typing import Any

from flex_planner.base.progress import Monitor
from flex_planner.maps.block_solver import blocks
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.store import MapStore, MapStoreError, open_map
from map_support import full_disk, small_study, solve, TEXT, value_of
import numpy as np
import pytest
import xarray as xr
import zarr


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / 'new' / 'small.zarr'


def fill(store: MapStore, count: int | None = None) -> None:
    """Write the first blocks."""
    study = small_study()
    for block in blocks(study)[:count]:
        store.write(block, solve(study, block, Monitor()))


def test_anyone_with_xarray_reads_the_map(path: Path) -> None:
    with MapStore.of(path, small_study()) as store:
        fill(store)
    opened = xr.open_zarr(path, chunks=None, zarr_format=2)
    assert opened.max_payload.sel(goal_x=0.6, goal_y=0.3).item() == value_of((5, 0))
    assert opened.max_payload.attrs == {'long_name': 'maximum payload', 'units': 'kg'}
    assert opened.max_payload.encoding['chunks'] == (2, 2)
    assert opened.goal_x.attrs['units'] == 'm'
    assert np.isnan(opened.max_payload[0]).all()  # infeasible, so no number
    assert opened.message[0, 0] == 'too weak'
    assert opened.iterations[1, 1] == 3
    assert (opened.warm[1, 0], opened.warm[1, 1]) == (0, 1)
    meanings = dict(zip(opened.code.attrs['flag_meanings'].split(),
                        opened.code.attrs['flag_values'], strict=True))
    assert (opened.code[0] == meanings['infeasible']).all()
    assert opened.attrs['study'] == TEXT
    assert 'Korayem' in opened.attrs['arm']
    assert {f'{name}_version' for name in ('flex_planner', 'numpy', 'scipy', 'casadi')} <= set(
        opened.attrs)


def test_cells_that_are_not_computed_are_pending_and_without_numbers(path: Path) -> None:
    with MapStore.of(path, small_study()) as store:
        fill(store, 1)
    opened = open_map(path)
    assert opened.code.dtype == np.int8
    pending = opened.code == CellCode.PENDING
    assert pending.sum() == 20
    for name in ('max_payload', 'bound', 'cost', 'tip_error', 'iterations', 'seconds', 'warm'):
        assert opened[name].where(pending).isnull().all()


def test_complete_blocks_are_known_when_the_map_is_opened_again(path: Path) -> None:
    study = small_study()
    with MapStore.of(path, study) as store:
        fill(store, 2)
    with MapStore.of(path, study) as store:
        assert [store.is_complete(block) for block in blocks(study)] == [True] * 2 + [False] * 4


@pytest.mark.parametrize('room', [0, 1, 4])
def test_a_full_disk_costs_only_the_block_that_it_cuts_off(path: Path, room: int) -> None:
    study = small_study()
    with MapStore.of(path, study) as store, full_disk(path, 1, room):
        with pytest.raises(OSError, match='No space left on device; finished') as caught:
            fill(store)
        assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(path))
        assert not store.is_complete(blocks(study)[1])
    with MapStore.of(path, study) as store:
        assert [store.is_complete(block) for block in blocks(study)] == [True] + [False] * 5
        fill(store)
        assert store.dataset().max_payload[5, 3] == value_of((5, 3))


def test_results_of_other_cells_are_refused(path: Path) -> None:
    first, second = blocks(small_study())[:2]
    with MapStore.of(path, small_study()) as store:
        with pytest.raises(ValueError, match='are not those of the block'):
            store.write(first, solve(small_study(), second, Monitor()))
        with pytest.raises(ValueError, match='1 results are not those'):
            store.write(first, [CellResult(index=(0, 0), code=CellCode.SOLVED)])


@pytest.mark.parametrize(('changes', 'text'), [
    ({'text': TEXT.replace('0.01', '0.02')}, 'study, accuracy: 0.02, there 0.01'),
    ({'text': TEXT + 'elbow: 1\n'}, 'study, elbow: 1, there None'),
    ({'columns': 7}, r'shape: \(7, 4\), there \(6, 4\)')])
def test_the_map_of_another_study_is_refused_saying_what_differs(
        path: Path, changes: dict[str, Any], text: str) -> None:
    MapStore.of(path, small_study()).close()
    with pytest.raises(MapStoreError, match=f'{text}.*--reset'):
        MapStore.of(path, small_study(**changes))
    with MapStore.of(path, small_study(**changes), reset=True) as store:
        assert store.codes.shape == small_study(**changes).shape


def test_the_map_of_another_version_is_refused(path: Path) -> None:
    MapStore.of(path, small_study()).close()
    zarr.open_group(str(path), mode='r+').attrs['flex_planner_version'] = '0.0.1'
    with pytest.raises(MapStoreError, match='flex planner version: .*, there 0.0.1'):
        MapStore.of(path, small_study())


def test_comments_and_order_of_the_study_file_do_not_matter(path: Path) -> None:
    MapStore.of(path, small_study()).close()
    text = '# the same\n' + ''.join(f'{line}\n' for line in reversed(TEXT.splitlines()))
    MapStore.of(path, small_study(text=text)).close()


def test_reset_removes_a_map_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / 'precious').touch()
    with pytest.raises(MapStoreError, match='exists, but is not a map'):
        MapStore.of(tmp_path, small_study(), reset=True)
    with pytest.raises(MapStoreError, match='exists, but is not a map'):
        MapStore.of(tmp_path / 'precious', small_study(), reset=True)
    assert (tmp_path / 'precious').exists()


def test_a_map_is_written_by_one_process_at_a_time(path: Path) -> None:
    with MapStore.of(path, small_study()):
        with pytest.raises(MapStoreError, match='being written by another process'):
            MapStore.of(path, small_study(), reset=True)
        assert open_map(path).sizes == {'goal_x': 6, 'goal_y': 4}  # but read at any time
    MapStore.of(path, small_study(), reset=True).close()


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / 'file').touch()
    with pytest.raises(OSError, match='the map is not created') as caught:
        MapStore.of(tmp_path / 'file' / 'small.zarr', small_study())
    assert caught.value.filename == str(tmp_path / 'file' / 'small.zarr')


def test_a_disk_that_is_full_from_the_beginning_leaves_nothing(path: Path) -> None:
    said = 'No space left on device; the map is not created'
    with full_disk(path.parent, 0, 2), pytest.raises(OSError, match=said):
        MapStore.of(path, small_study())
    assert list(path.parent.iterdir()) == []


def test_there_is_no_map_to_open(tmp_path: Path) -> None:
    with pytest.raises(MapStoreError, match='there is no map'):
        open_map(tmp_path / 'none.zarr')


def test_files_hold_nothing_that_only_one_generation_of_zarr_reads(path: Path) -> None:
    with MapStore.of(path, small_study()) as store:
        fill(store, 1)
    summary = json.loads((path / '.zmetadata').read_text())['metadata']
    arrays = {name.rpartition('/')[0]: entry for name, entry in summary.items()
              if name.endswith('.zarray')}
    assert {'code', 'motions/motion', 'motions/signature', 'blocks/checksum'} <= set(arrays)
    for name, entry in arrays.items():
        assert json.loads((path / name / '.zarray').read_text()) == entry
        filters = [one['id'] for one in entry['filters'] or []]
        assert filters in ([], ['vlen-utf8'], ['vlen-bytes'])
        assert (entry['dtype'] == '|O') is bool(filters)
        assert entry['zarr_format'] == 2
    assert arrays['code']['fill_value'] == CellCode.PENDING
    motions = xr.open_zarr(path, group='motions', chunks=None).load()
    assert motions.motion.dims == ('goal_x', 'goal_y')
    assert motions.signature.dims == ('goal_x', 'goal_y', 'quantity')
