"""Stores that lost files, or parts of them: what is missing is computed again, or named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
import shutil

from flex_planner import load_arm, Task
from flex_planner.base.progress import Monitor
from flex_planner.cli import main
from flex_planner.maps.block_solver import blocks
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.draw_map import save_map
from flex_planner.maps.kept_motions import KeptMotion, signature
from flex_planner.maps.map_starts import MapStarts
from flex_planner.maps.store import MapStore, open_map
from flex_planner.maps.stored_map import MapStoreError
from map_support import small_study, solve
import numpy as np
import pytest
import xarray as xr

ARM = load_arm('korayem_rigid')
TASK = Task(arm=ARM, start_positions=[0.1, 0.2], goal_positions=[1.0, 0.5], duration=1.0)
DAMAGES: dict[str, Callable[[Path], object]] = {
    'lost': Path.unlink,
    'cut': lambda file: file.write_bytes(file.read_bytes()[:len(file.read_bytes()) // 2]),
    'empty': lambda file: file.write_bytes(b''),
    'foreign': lambda file: file.write_bytes(b'\x02\x01\x21\x08' + bytes(range(60))),
    'flipped': lambda file: file.write_bytes(file.read_bytes()[:-3] + bytes(
        255 - byte for byte in file.read_bytes()[-3:])),
}


def results(block: tuple[slice, ...]) -> list[CellResult]:
    """Return results with a motion where there is a value, as the solver makes them."""
    motion = KeptMotion(signature=signature(TASK), payload=2.0, price=0.5,
                        mesh=np.linspace(0, 1, 5), nodes=np.arange(40.0).reshape(5, 8))
    return [replace(result, motion=motion) if result.code is CellCode.SOLVED else result
            for result in solve(small_study(2, 2), block, Monitor())]


def complete(path: Path) -> int:
    """Compute what is missing; return how many blocks that was."""
    study = small_study(2, 2, block_shape=(2, 1))
    with MapStore.of(path, study) as store:
        missing = [block for block in blocks(study) if not store.is_complete(block)]
        for block in missing:
            store.write(block, results(block))
    return len(missing)


@pytest.fixture(scope='module')
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('whole') / 'small.zarr'
    assert complete(path) == 2
    return path


@pytest.fixture
def copy(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / 'small.zarr'))


def files(path: Path) -> list[str]:
    """Return the files of a store, but for arrays that are like others."""
    names = sorted(str(file.relative_to(path)) for file in path.rglob('*') if file.is_file())
    return [name for name in names if name.split('/')[0] not in ('bound', 'cost', 'warm', 'goal_y',
                                                                 'iterations', 'seconds')]


def assert_sentence(error: pytest.ExceptionInfo[MapStoreError], path: Path) -> None:
    text = str(error.value)
    assert str(path) in text
    assert '\n' not in text
    assert '--reset' in text or 'remove it yourself' in text


def assert_as_before(path: Path, whole: Path) -> None:
    """Nothing is wrong in a damaged map: it is refused, or what it says was computed."""
    before = open_map(whole)
    try:
        now = open_map(path)
    except MapStoreError:
        return
    kept = now.code != CellCode.PENDING
    xr.testing.assert_identical(now.where(kept), before.where(kept))
    try:
        cell = MapStarts(path, ARM).near(TASK, searched=True)
    except MapStoreError:
        return
    if cell is not None:
        assert (cell.motion.nodes == np.arange(40.0).reshape(5, 8)).all()


@pytest.mark.parametrize('damage', DAMAGES)
def test_every_file_that_is_damaged_is_noticed_or_does_not_matter(
        whole: Path, tmp_path: Path, damage: str) -> None:
    for number, name in enumerate(files(whole)):
        path = Path(shutil.copytree(whole, tmp_path / f'{number}.zarr'))
        DAMAGES[damage](path / name)
        assert_as_before(path, whole)
        try:
            again = complete(path)
        except MapStoreError:
            with pytest.raises(MapStoreError) as refused:
                complete(path)
            assert_sentence(refused, path)
            continue
        assert again <= 1
        xr.testing.assert_identical(open_map(path), open_map(whole))


@pytest.mark.parametrize('name', ['max_payload', 'message', 'code', 'goal_x', 'blocks', 'motions',
                                  'motions/signature', 'blocks/checksum'])
def test_a_store_without_one_of_its_arrays_is_refused_and_can_be_reset(
        copy: Path, name: str) -> None:
    shutil.rmtree(copy / name)
    with pytest.raises(MapStoreError) as refused:
        complete(copy)
    assert str(copy) in str(refused.value)
    with MapStore.of(copy, small_study(2, 2, block_shape=(2, 1)), reset=True) as store:
        assert (store.codes == CellCode.PENDING).all()
    assert complete(copy) == 2


@pytest.mark.parametrize('name', ['max_payload/0.1', 'code/0.1', 'warm/0.1',
                                  'blocks/checksum/0.1.0', 'motions/signature/0.1.0',
                                  'motions/motion/0.1'])
def test_a_lost_piece_costs_its_block(copy: Path, name: str) -> None:
    (copy / name).unlink()
    assert complete(copy) == 1
    assert complete(copy) == 0


def test_lost_codes_are_pending_to_everyone_who_reads_the_map(copy: Path) -> None:
    for file in (copy / 'code').glob('[0-9]*'):
        file.unlink()
    junk = [np.full(size, 1, np.int8) for size in (2, 4, 8, 16)]  # what memory may hold
    del junk
    with MapStore(copy) as store:
        assert store.codes.tolist() == [[0, 0], [0, 0]]
        assert store.damaged == 2
    assert (open_map(copy).code == CellCode.PENDING).all()
    assert np.isnan(xr.open_zarr(copy, chunks=None).code).all()
    assert MapStarts(copy, ARM).near(TASK, searched=True) is None


def test_blocks_in_each_other_s_place_are_not_taken(copy: Path) -> None:
    for name in ('max_payload/0.0', 'motions/motion/0.0'):
        (copy / name).write_bytes((copy / name.replace('0.0', '0.1')).read_bytes())
    assert complete(copy) == (1 if (copy / 'motions/motion/0.0').exists() else 0)


def test_a_damaged_map_is_drawn_as_one_that_is_not_finished(copy: Path, tmp_path: Path) -> None:
    (copy / 'max_payload/0.1').unlink()
    assert save_map(copy, tmp_path)
    assert (open_map(copy).code == CellCode.PENDING).sum() == 2


def test_the_map_of_the_layout_before_says_what_to_do(copy: Path, tmp_path: Path,
                                                      capsys: pytest.CaptureFixture[str]) -> None:
    attributes = copy / '.zattrs'
    attributes.write_text(attributes.read_text().replace('"layout": 2,', ''))
    for use in (complete, open_map, lambda path: MapStarts(path, ARM)):
        with pytest.raises(MapStoreError, match='another version of flex_planner.*--reset'):
            use(copy)
    assert main(['map', str(copy), '--draw']) == 1
    assert 'another version of flex_planner' in capsys.readouterr().err


def test_damaged_motions_are_no_starts_and_others_are(copy: Path) -> None:
    (copy / 'motions/motion/0.0').write_bytes(b'half')
    cell = MapStarts(copy, ARM).near(TASK, searched=True)
    assert cell is not None
    assert cell.place == 'goal_x = 0.6 m, goal_y = 0.5 m of small.zarr'
