"""The command that computes a map."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.paths import file_stem
from flex_planner.base.validation import integer
from flex_planner.cli.map_progress import MapDisplay, outcome_rows
from flex_planner.cli.options import Commands, integer_argument, path_argument
from flex_planner.cli.pictures import drawn, print_files
from flex_planner.cli.signals import CanceledError, SIGNALS
from flex_planner.maps.addresses import check_address
from flex_planner.maps.cell_results import CellCode
from flex_planner.reports.motion import Row, table

if TYPE_CHECKING:
    from flex_planner.maps.store import MapStore
    from flex_planner.maps.study import Study
    from flex_planner.maps.tally import Tally

_SUFFIX = '.zarr'
_NEEDED = ('dask', 'distributed', 'xarray', 'zarr')


def add_command(commands: Commands) -> None:
    """Add ``flex-planner map``."""
    parser = commands.add_parser(
        'map', help='compute a quantity over a grid of motions',
        description='Compute the maximum payload, or another quantity, for every cell of a grid, '
        'and draw it. Cells that are computed already are kept.')
    add = parser.add_argument
    add('study', type=path_argument, metavar='STUDY', help='study file; with --draw also a store')
    add('--output', type=path_argument, default=Path('output/maps'), metavar='PATH',
        help='folder for store and pictures, or a store that ends in .zarr (default: %(default)s)')
    add('--workers', type=integer_argument, metavar='N',
        help='worker processes (default: one per processor)')
    add('--scheduler', metavar='ADDRESS',
        help='compute on the Dask cluster with this scheduler, such as tcp://host:8786')
    add('--draw', action='store_true', help='draw the stored cells, compute nothing')
    add('--reset', action='store_true', help='remove the existing map, and start anew')
    add('--no-plot', action='store_true', help='draw no pictures')
    parser.set_defaults(run=_map)


def _map(options: argparse.Namespace) -> int:
    """Compute and draw a map, or say what is missing to do so."""
    try:
        return _draw(_place(options)) if options.draw else _compute(options)
    except ImportError as error:
        if (error.name or '').split('.')[0] not in _NEEDED:
            raise
        print(f"flex-planner: maps need {', '.join(_NEEDED)}: pip install 'flex_planner[maps]' "
              f'({error})', file=sys.stderr)
        return 1


def _place(options: argparse.Namespace) -> Path:
    """Return the path of the store."""
    study, output = options.study, options.output
    if options.draw and study.suffix == _SUFFIX:
        return Path(study)
    return Path(output if output.suffix == _SUFFIX else output / f'{file_stem(study)}{_SUFFIX}')


def _draw(path: Path) -> int:
    """Draw a map in a folder beside its store."""
    from flex_planner.maps.draw_map import save_map

    with SIGNALS.patient():
        pictures = save_map(path, path.with_suffix(''))
    print(table([('picture', str(picture)) for picture in pictures]))
    return 0


def _compute(options: argparse.Namespace) -> int:
    """Compute the missing cells, print a summary and draw the map."""
    _check(options)
    from flex_planner.maps.store import MapStore
    from flex_planner.maps.study import load_study

    study, path = load_study(options.study), _place(options)
    with MapStore.of(path, study, reset=options.reset) as store:
        tally = _run(options, study, store)
        print(table([*outcome_rows(tally, store.dataset()), ('store', str(path))]))
    if not options.no_plot:
        print_files(_pictures(path))
    print(table([('output folder', str(path.parent))]))
    failed = tally.of(CellCode.FAILED)
    if failed:
        print(f'flex-planner: {failed} cells failed by an error of the program; the variable '
              '"message" in the store says why', file=sys.stderr)
    return 1 if failed else 0


def _pictures(path: Path) -> Iterator[Row]:
    """Draw a map that is just computed."""
    pictures: list[Path] = []

    def draw(folder: Path) -> None:
        from flex_planner.maps.draw_map import save_map

        pictures.extend(save_map(path, folder))

    for _ in drawn('pictures', path.with_suffix(''), draw):
        yield from (('picture', str(picture)) for picture in pictures)


def _check(options: argparse.Namespace) -> None:
    """Refuse options that contradict each other, and what is no address."""
    if options.scheduler is not None:
        check_address(options.scheduler)
    if options.workers is not None:
        integer('--workers', options.workers, at_least=1, at_most=1024)
        if options.scheduler:
            raise InvalidValueError('--workers', options.workers,
                                    'left out: --scheduler gives the workers')


def _run(options: argparse.Namespace, study: Study, store: MapStore) -> Tally:
    """Compute the missing cells, showing progress; CanceledError after Ctrl-C."""
    from flex_planner.maps.run_map import run_map

    done = int((store.codes != CellCode.PENDING).sum())
    display = MapDisplay(sys.stderr)
    if store.damaged:
        blocks = 'block is' if store.damaged == 1 else 'blocks are'
        print(f'{store.path}: {store.damaged} {blocks} not whole and computed again')
    if done:
        print(f'{store.path}: {done} of {store.codes.size} cells are computed already')
    try:
        with SIGNALS.patient() as canceled:
            tally = run_map(study, store, workers=options.workers or 0,
                            scheduler=options.scheduler or '', begin=display.begin,
                            report=display.show, canceled=canceled)
    finally:
        display.close()
    if canceled() and tally.done < tally.cells:
        again = ' without --reset' if options.reset else ''
        raise CanceledError(f'{SIGNALS.word}: {tally.done} of {tally.cells} cells are kept in '
                            f'{store.path}; run the same command{again} to go on')
    return tally
