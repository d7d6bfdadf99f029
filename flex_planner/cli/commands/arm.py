"""The command that describes an arm."""

from __future__ import annotations

import argparse
from pathlib import Path

from flex_planner.arms.arm_files import ArmFileError, load_arm, read_arm_template
from flex_planner.base.paths import expand_path, file_stem, STANDARD_INPUT
from flex_planner.base.text_files import say_file
from flex_planner.base.validation import number
from flex_planner.cli.options import (
    add_arm,
    add_folder,
    Commands,
    number_argument,
    path_argument,
    positions,
)
from flex_planner.cli.pictures import drawn, print_files
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.reports.arm import describe_arm, standard_postures


def add_command(commands: Commands) -> None:
    """Add ``flex-planner arm``."""
    parser = commands.add_parser(
        'arm', help='print the properties of an arm, and draw it',
        description='Print masses, limits, natural frequencies and deflections of an arm, and '
        'draw it with the shapes that its links bend in.')
    add_arm(parser, optional=True)
    parser.add_argument('--template', nargs='?', const='-', metavar='FILE',
                        help='write an arm file with comments to start from, into a new file or '
                        'to the standard output')
    parser.add_argument('--payload', type=number_argument, default=0.0, metavar='KG',
                        help='mass at the tip (default: 0)')
    parser.add_argument('--posture', action='append', metavar='DEG,DEG,...',
                        help='joint angles for frequencies and deflections; may be repeated '
                        '(default: stretched, and bent by 90 degrees)')
    parser.add_argument('--plot', type=path_argument, metavar='PNG',
                        help='picture of the arm and its modes (default: DIR/<arm>_arm.png)')
    add_folder(parser)
    parser.add_argument('--no-plot', action='store_true', help='draw no pictures')
    parser.set_defaults(run=lambda options: _run(parser, options))


def _write_template(options: argparse.Namespace) -> int:
    """Write a file to start from; never over another one."""
    if options.arm is not None:
        raise ArmFileError(f'--template describes no arm: leave out {options.arm}')
    text = read_arm_template()
    if options.template == STANDARD_INPUT:
        print(text, end='', flush=True)
        return 0
    path = expand_path(options.template)
    try:
        with path.open('x', encoding='utf-8') as file:
            file.write(text)
    except OSError as error:
        raise ArmFileError(f'{say_file(path)} cannot be written: {error.strerror}') from None
    print(f'wrote {say_file(path)}: see what it says with flex-planner arm {say_file(path)}')
    return 0


def _run(parser: argparse.ArgumentParser, options: argparse.Namespace) -> int:
    """Print an arm's properties and draw it, or write a template."""
    if options.template is not None:
        return _write_template(options)
    if options.arm is None:
        parser.error('the following arguments are required: ARM, or --template')
    arm = load_arm(options.arm)
    payload = number('--payload', options.payload, at_least=0, at_most=MAX_PAYLOAD, unit='kg')
    postures = ([positions('--posture', text, arm) for text in options.posture]
                if options.posture else standard_postures(arm))
    model = ArmModel(arm)
    text = describe_arm(model, postures, payload)
    print(text, flush=True)
    if options.no_plot:
        return 0

    def draw(path: Path) -> None:
        from flex_planner.plotting import draw_arm, save

        save(draw_arm(model, postures, payload), path)

    print()
    path = options.plot or options.output / f'{file_stem(options.arm)}_arm.png'
    count = print_files(drawn('picture of the arm', path, draw))
    return 1 if options.plot and not count else 0
