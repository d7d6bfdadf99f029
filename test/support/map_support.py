"""A small study, and stand-ins for `solve_block` that take no time and misbehave as told."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import errno
import os
from pathlib import Path
import signal
import time

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.progress import Monitor
from flex_planner.maps.axes import Axis, Block
from flex_planner.maps.block_solver import blocks, solve_block
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.end_points import End
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.store import cells, MapStore
from flex_planner.maps.study import load_study, Study
from flex_planner.maps.study_motion import StudyMotion
import numpy as np
import pytest

SUPPORT = Path(__file__).parent
STUDY = """
name: starts
arm: {arm}
quantity: {quantity}
start: [0.5, 0.0]
duration: 1.0
effort_weights: [0.125, 0.125]
axes: {{goal_x: {{from: 0.40, to: 0.50, count: 2}}, goal_y: [0.45, 0.5, 1.5]}}
block: {{goal_x: 2, goal_y: 3}}
"""
TEXT = 'name: small\nquantity: max_payload\naccuracy: 0.01\n'
BAD = 3  # of the goal's x in steps: where a stand-in misbehaves
TROUBLE = 'FLEX_PLANNER_TEST_TROUBLE'  # a folder, for stand-ins in other processes


def small_study(columns: int = 6, rows: int = 4, text: str = TEXT,
                block_shape: tuple[int, ...] = (2, 2)) -> Study:
    """Return a study of the rigid arm."""
    axes = (Axis(name='goal_x', values=np.linspace(0.3, 0.6, columns)),
            Axis(name='goal_y', values=np.linspace(0.3, 0.5, rows)))
    return Study(name='small', arm=load_arm('korayem_rigid'), quantity=Quantity.MAX_PAYLOAD,
                 axes=axes, motion=StudyMotion(start=End(name='start', point=np.array([0.5, 0.0])),
                                               goal=End(name='goal')),
                 accuracy=0.01, block_shape=block_shape, text=text)


def value_of(index: tuple[int, ...]) -> float:
    return 10.0 * index[0] + index[1]


@contextmanager
def full_disk(store: Path, blocks: int, files: int) -> Iterator[None]:
    """Let a store be written until so many blocks are whole, and so many files more."""
    replace, left = os.replace, {'blocks': blocks, 'files': files}

    def limited(source: str, target: str) -> None:
        """Put a file in its place, or half of it."""
        inside = str(store) in str(target)
        if inside and not left['blocks']:
            left['files'] -= 1
            if left['files'] < 0:
                Path(target).write_bytes(Path(source).read_bytes()[:7])
                raise OSError(errno.ENOSPC, 'No space left on device')
        replace(source, target)
        left['blocks'] -= inside and 'checksum' in str(target) and bool(left['blocks'])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, 'replace', limited)
        yield


def solve(study: Study, block: Block, monitor: Monitor) -> list[CellResult]:
    """Solve all cells but those of the first row."""
    return [CellResult(index=index, code=CellCode.SOLVED, value=value_of(index), seconds=1e-3,
                       bound=value_of(index) + study.accuracy, iterations=3, warm=bool(index[1]))
            if index[0] else CellResult(index=index, code=CellCode.INFEASIBLE, message='too weak')
            for index in cells(block)]


def solve_slowly(study: Study, block: Block, monitor: Monitor) -> list[CellResult]:
    """Note which block is begun, and by whom, and take a moment."""
    corner = f'{block[0].start}-{block[1].start}'
    begun = Path(os.environ[TROUBLE], f'block-{corner}-{os.getpid()}')
    with begun.open('a') as file:
        file.write('begun\n')
    time.sleep(0.3)
    return solve(study, block, monitor)


def solve_until_canceled(study: Study, block: Block, monitor: Monitor) -> list[CellResult]:
    """Solve only when told to stop, and say so."""
    Path(os.environ[TROUBLE], f'begun-{os.getpid()}').touch()
    while not monitor.canceled():
        time.sleep(0.01)
    Path(os.environ[TROUBLE], f'canceled-{os.getpid()}').touch()
    return solve(study, block, monitor)


def die_once(study: Study, block: Block, monitor: Monitor) -> list[CellResult]:
    """End the process by SIGKILL, but not a second time."""
    died = Path(os.environ[TROUBLE], 'died')
    if block[0].start <= BAD < block[0].stop and not died.exists():
        died.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return solve(study, block, monitor)


def die_always(study: Study, block: Block, monitor: Monitor) -> list[CellResult]:
    """End the process by SIGKILL at one block."""
    if block[0].start <= BAD < block[0].stop and block[1].start == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return solve(study, block, monitor)


def raise_always(study: Study, block: Block, monitor: Monitor) -> list[CellResult]:
    """Raise at one block, leave out a cell of another."""
    if block[0].start <= BAD < block[0].stop and block[1].start == 0:
        raise ZeroDivisionError('this block is cursed')
    return solve(study, block, monitor)[:3 if block[1].start == 0 and not block[0].start else None]


def run(path: str) -> None:
    """Compute the map slowly; for a process of its own."""
    from flex_planner.maps.run_map import run_map
    from flex_planner.maps.store import MapStore

    study = small_study()
    with MapStore.of(Path(path), study) as store:
        run_map(study, store, workers=2, solve=solve_slowly)


def filled(folder: Path, quantity: str = 'max_payload', arm: str = 'korayem_rigid',
           more: str = '') -> tuple[Study, Path, list[CellResult]]:
    """Return a study with its store and results; goals with y = 1.5 m are out of reach."""
    text = STUDY.format(quantity=quantity, arm=arm)
    (folder / 'study.yaml').write_text(text + more)
    study, path = load_study(folder / 'study.yaml'), folder / 'map.zarr'
    (block,) = blocks(study)
    results = solve_block(study, block)
    with MapStore.of(path, study) as store:
        store.write(block, results)
    return study, path, results
