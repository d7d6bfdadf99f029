"""
Capacity maps: cells per second in one and in two processes, from neighbours and cold.

Run by ``tools/run python -m bench.maps``, on an idle machine; takes ten minutes.

"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
import multiprocessing
from pathlib import Path
import resource
import statistics
import sys
import tempfile

from flex_planner import find_max_payload, load_arm
from flex_planner.base.processes import one_thread_each
from flex_planner.maps.axes import Axis
from flex_planner.maps.block_solver import blocks, solve_block
from flex_planner.maps.end_points import End
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.run_map import run_map
from flex_planner.maps.store import MapStore
from flex_planner.maps.study import Study
from flex_planner.maps.study_motion import StudyMotion
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.plan import PlanStatus
from flex_planner.reports.motion import table
from flex_planner.simulation.mismatch import Mismatch
import numpy as np

BLOCK, REPEATS, COLD_A_BLOCK = 5, 3, 2
SIDES = {'korayem_rigid': 20, 'korayem_ei50': 15}
_MEGABYTE = 1024  # in the unit of ru_maxrss


def study(arm: str) -> Study:
    """Return the middle of the workspace, where every cell is solved; one mode per link if any."""
    side = SIDES[arm]
    axes = (Axis(name='goal_x', values=np.linspace(0.2, 0.6, side, dtype=np.float64)),
            Axis(name='goal_y', values=np.linspace(0.3, 0.7, side, dtype=np.float64)))
    given = load_arm(arm)
    single = Mismatch(modes=1).apply(given) if given.n_modes else given
    return Study(name='bench', arm=single, quantity=Quantity.MAX_PAYLOAD, axes=axes,
                 motion=StudyMotion(start=End(name='start', point=np.array([0.5, 0.0])),
                                    goal=End(name='goal'),
                                    effort_weights=np.array([0.125, 0.125])), accuracy=1e-3,
                 block_shape=(BLOCK, BLOCK), text='name: bench\n')


def rate(one: Study, workers: int) -> float:
    """Return the cells per second of a number of processes."""
    with tempfile.TemporaryDirectory() as folder:
        with MapStore.of(Path(folder, 'bench.zarr'), one) as store:
            tally = run_map(one, store, workers=workers)
    return tally.computed / tally.elapsed


def costs(one: Study) -> dict[str, float]:
    """Return the time of a cell in its block and on its own [s], and the memory it takes [MB]."""
    with one_thread_each(), ProcessPoolExecutor(1, multiprocessing.get_context('spawn')) as pool:
        return pool.submit(_costs, one).result()


def _costs(one: Study) -> dict[str, float]:
    """Solve blocks, and cells of each without neighbours, in turns."""
    model, together, alone = ArmModel(one.arm), [], []
    for block in blocks(one):
        results = solve_block(one, block)
        together += results
        for result in results[:: BLOCK**2 // COLD_A_BLOCK]:
            found = find_max_payload(one.task(result.index), model=model, accuracy=one.accuracy)
            if found.status is PlanStatus.SOLVED:
                alone.append(found.planning_time)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / _MEGABYTE
    continued = [result.seconds for result in together if result.warm]
    return {'whole block': statistics.mean(result.seconds for result in together),
            'from neighbors': statistics.median(continued),
            'from nothing': statistics.median(alone), 'mean from nothing': statistics.mean(alone),
            'memory': memory}


def rows(arm: str) -> list[tuple[str, str]]:
    """Return the figures of an arm, in words."""
    one, side = study(arm), SIDES[arm]
    ArmModel(one.arm)  # compiled beforehand
    rates = [(rate(one, 1), rate(one, 2)) for _ in range(REPEATS)]
    single, double = (statistics.median(column) for column in zip(*rates, strict=True))
    gain = statistics.median(two / one for one, two in rates)
    found = costs(one)
    return [(f'{one.arm.name}', f'{side} x {side} cells in blocks of {BLOCK} x {BLOCK}'),
            ('  cells per second, 1 process', f'{single:.1f}'),
            ('  cells per second, 2 processes', f'{double:.1f}'),
            ('  gain, median of the runs', f'{gain:.2f}'),
            ('  a cell in its block, mean', f'{found["whole block"]:.3f} s'),
            ('  a cell from neighbors, median', f'{found["from neighbors"]:.3f} s'),
            ('  a cell from nothing, mean', f'{found["mean from nothing"]:.3f} s'),
            ('  a cell from nothing, median', f'{found["from nothing"]:.3f} s'),
            ('  from nothing over block, means',
             f'{found["mean from nothing"] / found["whole block"]:.2f}'),
            ('  from nothing over neighbors, medians',
             f'{found["from nothing"] / found["from neighbors"]:.2f}'),
            ('  memory of a process', f'{found["memory"]:.0f} MB')]


def main() -> None:
    """Measure and print."""
    for arm in sys.argv[1:] or SIDES:
        print(table(rows(arm)), flush=True)


if __name__ == '__main__':
    main()
