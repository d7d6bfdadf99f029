"""The command that recomputes the paper."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import platform
import sys

from flex_planner.base.text_files import write_text
from flex_planner.base.validation import integer
from flex_planner.base.version import VERSION
from flex_planner.cli.options import Commands, integer_argument, path_argument
from flex_planner.cli.outputs import check_folder
from flex_planner.cli.progress_line import Display
from flex_planner.cli.signals import SIGNALS
from flex_planner.reports.motion import table

_PAGE, _PICTURES = 'paper.md', 'images/paper'


def add_command(commands: Commands) -> None:
    """Add ``flex-planner paper``."""
    parser = commands.add_parser(
        'paper', help='recompute every simulation of Korayem et al. 2009',
        description='Compute every simulation of Korayem et al. 2009, compare it with what the '
        'paper says, and write a page with tables and pictures.')
    add = parser.add_argument
    add('--output', type=path_argument, default=Path('output/paper'), metavar='DIR',
        help=f'folder for {_PAGE} and {_PICTURES} (default: %(default)s)')
    add('--section', action='append', metavar='N.N', help='compute this section only; may be '
        'repeated')
    add('--reduced', action='store_true', help='leave out the parts that take long')
    add('--processes', type=integer_argument, default=os.cpu_count() or 1, metavar='N',
        help='sections computed at a time (default: one per processor, %(default)s)')
    add('--no-plot', action='store_true', help='draw no pictures')
    parser.set_defaults(run=_paper)


def _paper(options: argparse.Namespace) -> int:
    """Compute the sections, write the page, print a summary."""
    from flex_planner.paper.document import document, summary
    from flex_planner.paper.run import compute_sections, STUDIES

    processes = integer('--processes', options.processes, at_least=1, at_most=256)
    keys = options.section or list(STUDIES)
    unknown = sorted(set(keys) - set(STUDIES))
    if unknown:
        print(f'flex-planner: --section is {unknown[0]}, but must be one of '
              f'{", ".join(STUDIES)}', file=sys.stderr)
        return 1
    check_folder(options.output)
    display = Display(sys.stderr)
    display.begin(f'{len(keys)} sections in {processes} processes')
    page, pictures = options.output / _PAGE, options.output / _PICTURES
    try:
        with SIGNALS.patient() as canceled:
            sections = list(compute_sections(
                keys, reduced=options.reduced, processes=processes, canceled=canceled,
                pictures=None if options.no_plot else pictures,
                report=lambda key, done, count: display.begin(
                    f'section {key} is done, {done} of {count}')).values())
    finally:
        display.close()
    remark = (f'Computed in {display.elapsed:.0f} s by flex_planner {VERSION} on '
              f'{processes} processors ({platform.machine()}).')
    SIGNALS.check()
    page.parent.mkdir(parents=True, exist_ok=True)
    write_text(page, document(sections, _PICTURES, remark))
    print(summary(sections))
    shown = '' if options.no_plot else f', pictures in {pictures}'
    print(f'\nwritten: {page}{shown}, in {display.elapsed:.0f} s')
    print(table([('output folder', str(options.output))]))
    return 0
