"""The command that plans a task with flexible and with rigid links, and compares."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
import sys

from flex_planner.base.paths import file_stem
from flex_planner.base.progress import Monitor
from flex_planner.cli.options import (
    add_folder,
    Commands,
    integer_argument,
    number_argument,
    numbers,
)
from flex_planner.cli.outputs import check_folder
from flex_planner.cli.pictures import drawn, print_files
from flex_planner.cli.progress_line import run_with_progress
from flex_planner.cli.request import add_task, Request, say_failure, translate_errors
from flex_planner.control.joint_controller import Gains
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.reports.comparison import comparison_rows, comparison_table
from flex_planner.reports.motion import Row, table
from flex_planner.simulation.comparison import compare, Comparison
from flex_planner.simulation.mismatch import Mismatch
import numpy as np

_STIFFNESS, _DAMPING = 100.0, 10.0


def add_command(commands: Commands) -> None:
    """Add ``flex-planner compare``."""
    parser = commands.add_parser(
        'compare', help='compare planning with flexible and with rigid links',
        description='Plan a motion with flexible and with rigid links, and carry out both on a '
        'simulated flexible arm, with and without a joint controller.')
    add_task(parser, payload='mass at the tip (default: 0)')
    add = parser.add_argument
    add('--plant-payload', type=number_argument, metavar='KG',
        help='mass at the tip of the simulated arm (default: that of the task)')
    add('--plant-modes', type=integer_argument, default=-1, metavar='N',
        help='modes of each link of the simulated arm (default: as planned)')
    add('--rigidity-scale', type=number_argument, default=1.0, metavar='FACTOR',
        help='factor on the rigidity of its links (default: 1)')
    add('--added-friction', metavar='D,D,...',
        help='viscous friction added to its joints [N m s/rad] (default: none)')
    add('--stiffness', type=number_argument, default=_STIFFNESS, metavar='P',
        help='proportional gain of the joint controller [N m/rad] (default: %(default)g)')
    add('--damping', type=number_argument, default=_DAMPING, metavar='D',
        help='derivative gain of the joint controller [N m s/rad] (default: %(default)g)')
    add('--rate', type=number_argument, default=1000.0, metavar='HZ',
        help='rate of the joint controller (default: %(default)g)')
    add('--settling', type=number_argument, default=1.0, metavar='S',
        help='time to watch the arm after its arrival (default: %(default)g)')
    add_folder(parser)
    add('--no-plot', action='store_true', help='draw no pictures')
    parser.set_defaults(run=_compare)


def _compare(options: argparse.Namespace) -> int:
    """Compare the modes of execution; print and draw the results."""
    request = Request.of(options)
    if not options.no_plot:
        check_folder(options.output)

    def work(model: ArmModel, monitor: Monitor) -> Comparison:
        with translate_errors():
            return compare(
                request.task, model=model, monitor=monitor, mismatch=_mismatch(options),
                payload_mass=options.plant_payload, rate=options.rate,
                settling=options.settling,
                gains=Gains.of(request.task.arm.n_joints, options.stiffness, options.damping))

    found = run_with_progress(request.task.arm, request.time_limit, work)
    print(table([('motion', f'{request} with {request.task.payload_mass:g} kg'),
                 *comparison_rows(found)]))
    print(f'\n{comparison_table(found)}\n')
    if not options.no_plot and found.results:
        print_files(_draw(options, found))
    if not found.solved:
        failed = found.rigid if found.flexible.solved else found.flexible
        print(f'flex-planner: {failed.arm.name}: '
              f'{say_failure(failed, request.time_limit)}', file=sys.stderr)
    return 0 if found.solved else 1


def _draw(options: argparse.Namespace, found: Comparison) -> Iterator[Row]:
    """Draw the results."""
    def draw(path: Path) -> None:
        from flex_planner.plotting import draw_comparison, save

        save(draw_comparison(found), path)

    yield from drawn('picture', options.output / f'{file_stem(options.arm)}_comparison.png', draw)
    yield 'output folder', str(options.output)


def _mismatch(options: argparse.Namespace) -> Mismatch:
    """Return the differences of the simulated arm."""
    given = options.added_friction
    friction = np.zeros(0) if given is None else numbers('--added-friction', given, finite=False)
    return Mismatch(modes=options.plant_modes, rigidity_scale=options.rigidity_scale,
                    added_friction=friction)
