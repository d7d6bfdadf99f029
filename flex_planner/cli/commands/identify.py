"""The command that finds an arm's parameters from logs."""

from __future__ import annotations

import argparse
from dataclasses import replace
from datetime import date
import sys

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.progress import Monitor
from flex_planner.base.text_files import say_file, write_text
from flex_planner.base.validation import integer, number
from flex_planner.base.yaml_text import format_yaml
from flex_planner.cli.options import (
    add_arm,
    Commands,
    integer_argument,
    number_argument,
    path_argument,
)
from flex_planner.cli.progress_line import Display
from flex_planner.cli.signals import CanceledError, SIGNALS
from flex_planner.identification.drive import Drive
from flex_planner.identification.experiments import Method
from flex_planner.identification.identification import Identification
from flex_planner.identification.identify import ALL, identify
from flex_planner.identification.joint_log import JointLog
from flex_planner.identification.plan_residuals import find_plan_residuals, PlanResiduals
from flex_planner.identification.plant_parameters import check_identifiable, Quantity
from flex_planner.logs.csv_log import read_csv_log
from flex_planner.logs.drive_file import load_drive
from flex_planner.logs.identified_uncertainty import identification_file
from flex_planner.logs.recorded_log import read_recorded_logs
from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.reports.arm_file import format_arm_file
from flex_planner.reports.identification import (
    estimate_table,
    identification_rows,
    plain_identification,
    plan_residual_rows,
)
from flex_planner.reports.motion import table

_METHODS = {one.name.lower().replace('_', '-'): one for one in Method}
_KINDS = ', '.join(kind.value for kind in Quantity)


def add_command(commands: Commands) -> None:
    """Add ``flex-planner identify``."""
    parser = commands.add_parser(
        'identify', help='find the parameters of an arm from logs of its motions',
        description='Fit stiffness, damping, friction, rotors, payload, delay and offsets of '
        'encoders to recorded motions, and write an arm file with them. Two plans, there and '
        'back, are the best motions to record.')
    add_arm(parser)
    add = parser.add_argument
    add('logs', nargs='+', type=path_argument, metavar='LOG',
        help='recording (folder or .mcap) with joint states, and the trajectory if the drive is '
        'given, or CSV with the columns t, q1, ..., tau1, ... and, for the drive, qd1, ..., '
        'ff1, ...')
    add('-o', '--output', type=path_argument, required=True, metavar='YAML',
        help='arm file to write; <name>_identification.yaml beside it says how sure each value '
        'is')
    add('--drive', type=path_argument, metavar='YAML',
        help='law of the drive: with it angles are enough, at 100 Hz')
    add('--payload', type=number_argument, default=0.0, metavar='KG',
        help='mass at the tip, as assumed (default: 0)')
    add('--free', metavar='KIND,KIND,...', help=f'what to find, of {_KINDS} (default: all)')
    add('--modes', type=integer_argument, metavar='N',
        help='modes of each flexible link (default: as the arm file has them)')
    add('--more-modes', type=integer_argument, default=1, metavar='N',
        help='modes more per link in a second fit, 0 for none (default: %(default)s)')
    add('--method', choices=sorted(_METHODS),
        help='way to fit (default: closed-loop with a drive and trajectories, else input-error '
        'and, if that explains the angles, output-error)')
    add('--topic', default='', metavar='NAME',
        help='topic of the joint states in recordings (default: the one named joint_states)')
    add('--joints', metavar='NAME,NAME,...',
        help='names of the joints in recordings, from the base outwards')
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    """Identify; print and write the result."""
    arm = load_arm(options.arm)
    check_identifiable(arm)
    format_arm_file(arm)  # what cannot be written is refused before the work
    if options.modes is not None:
        arm = _with_modes(arm, options.modes)
    mass = number('--payload', options.payload, at_least=0, at_most=MAX_PAYLOAD, unit='kg')
    drive = load_drive(options.drive, arm.n_joints) if options.drive else None
    free = ALL if options.free is None else Quantity.named(
        name.strip() for name in options.free.split(','))
    logs = _read_logs(options, arm)
    found, residuals = _identify(options, arm, logs, drive, mass, free)
    note = (f'Identified on {date.today()} from {", ".join(found.logs)}, which it fits to '
            f'{found.best.fit_percent.min():.4g} %, with a payload of {found.payload_mass:.4g} '
            'kg.')
    print(table([*identification_rows(found),
                 *(plan_residual_rows(residuals) if residuals else [])]))
    print(f'\n{estimate_table(found)}\n')
    details = identification_file(options.output)
    write_text(options.output, format_arm_file(found.identified_arm(note)))
    write_text(details, format_yaml(plain_identification(found, residuals)))
    print(table([('arm file', say_file(options.output)), ('details', say_file(details))]))
    return 0


def _with_modes(arm: Arm, count: int) -> Arm:
    """Return an arm with another number of modes in its flexible links."""
    integer('--modes', count, at_least=1, at_most=8)
    return replace(arm, links=tuple(link.with_modes(count) if link.modes else link
                                    for link in arm.links))


def _read_logs(options: argparse.Namespace, arm: Arm) -> list[JointLog]:
    """Return the logs of all files."""
    logs: list[JointLog] = []
    names = options.joints.split(',') if options.joints else ()
    for path in options.logs:
        if path.suffix.lower() == '.csv':
            logs.append(read_csv_log(path, arm.n_joints))
        else:
            logs += read_recorded_logs(path, arm.n_joints, topic=options.topic, names=names)
    return logs


def _identify(options: argparse.Namespace, arm: Arm, logs: list[JointLog], drive: Drive | None,
              mass: float, free: frozenset[Quantity],
              ) -> tuple[Identification, PlanResiduals | None]:
    """Return the result and what plans leave, showing where the work is; Ctrl-C ends it."""
    display = Display(sys.stderr)
    try:
        display.begin(f'fitting {arm.name} to {len(logs)} motions')
        with SIGNALS.patient() as canceled:
            def stopping() -> bool:
                display.remind()
                return canceled()

            found = identify(arm, logs, payload_mass=mass, drive=drive, free=free,
                             method=_METHODS.get(options.method), more_modes=options.more_modes,
                             monitor=Monitor(canceled=stopping))
            residuals = None
            if drive is not None and not canceled():
                display.begin('planning again with the arm that was found')
                residuals = find_plan_residuals(found, logs[0], drive,
                                                Monitor(canceled=stopping))
    finally:
        display.close()
    if canceled():
        raise CanceledError(f'{SIGNALS.word}; nothing was written')
    return found, residuals
