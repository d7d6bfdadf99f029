"""
Map the largest payload over the workspace, and start a search from the nearest cell.

A study describes the cells; they are computed on all processors and kept in a store that xarray
reads. The motions are kept too: a search near a cell starts from its motion.

    tools/run python examples/map_the_payload.py

"""

from __future__ import annotations

from pathlib import Path

from flex_planner import find_max_payload, Task
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.draw_map import save_map
from flex_planner.maps.map_starts import MapStarts
from flex_planner.maps.run_map import run_map
from flex_planner.maps.store import MapStore, open_map
from flex_planner.maps.study import load_study

STUDY = """\
name: Payload in 1 s
arm: korayem_rigid
quantity: max_payload
start: [0.5, 0.0]              # tip [m]
duration: 1.0                  # [s]
effort_weights: [0.125, 0.125]
axes:
  goal_x: {from: 0.1, to: 0.9, count: 9}    # [m]
  goal_y: {from: 0.2, to: 0.7, count: 6}
"""
FOLDER = Path('output') / 'map_the_payload'


def main() -> None:
    """Compute a small map, print it, draw it and start from it."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    file, place = FOLDER / 'study.yaml', FOLDER / 'study.zarr'
    file.write_text(STUDY)
    study = load_study(file)
    with MapStore.of(place, study, reset=True) as store:
        tally = run_map(study, store)
    print(f'{tally.done} cells in {tally.elapsed:.1f} s, {tally.of(CellCode.SOLVED)} solved')

    found = open_map(place).load()
    print('\npayload [kg] to y \\ x [m]' + ''.join(f'{x:8.2f}' for x in found.goal_x.values))
    for y in found.goal_y.values[::-1]:
        row = found.sel(goal_y=y)
        print(f'{y:24.2f}' + ''.join(
            f'{value:8.2f}' if code == CellCode.SOLVED else f'{CellCode(code).name[:7]:>8}'
            for value, code in zip(row.max_payload.values, row.code.values, strict=True)))

    arm = study.arm
    task = Task.between_points(arm, (0.5, 0.0), (0.53, 0.47), duration=1.0,
                               effort_weights=[1 / 8, 1 / 8])
    cell = MapStarts(place, arm).near(task, searched=True)
    known = cell.motion.start() if cell else None
    print()
    for name, motion in (('from nothing', None), ('from the map', known)):
        search = find_max_payload(task, start_from=motion)
        print(f'{name}: {search.payload:.3f} kg after {search.iterations} iterations')
    for picture in save_map(place, FOLDER):
        print(f'picture: {picture}')


if __name__ == '__main__':
    main()
