"""Options that commands share, and lists of numbers in them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import re
from typing import TypeAlias

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import preset_files
from flex_planner.arms.spatial_joint import slides
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.number_texts import AMBIGUOUS, NumberTextError, read_number
from flex_planner.base.paths import expand_path, PathError
from flex_planner.base.validation import Array, vector
from flex_planner.cli.command_parser import CommandParser
from flex_planner.optimal_control.task import MAX_JOINT_ANGLE
import numpy as np

Commands: TypeAlias = 'argparse._SubParsersAction[CommandParser]'

# argparse takes them for options
_NEGATIVE = re.compile(r'-[\d.].*[,eE]')


def join_lists(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with ``--to -1,2`` as ``--to=-1,2``: argparse would see an option."""
    joined: list[str] = []
    for argument in arguments:
        if joined and joined[-1].startswith('--') and _NEGATIVE.match(argument):
            joined[-1] += f'={argument}'
        else:
            joined.append(argument)
    return joined


def path_argument(text: str) -> Path:
    """Return a path of the command line, see `expand_path`; for argparse."""
    try:
        return expand_path(text)
    except PathError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def number_argument(text: str) -> float:
    """Return a number of the command line, see `read_number`; for argparse."""
    try:
        return float(read_number(text.strip()))
    except NumberTextError as error:
        raise argparse.ArgumentTypeError(f'{text!r} must be {error}') from None


def integer_argument(text: str) -> int:
    """Return an integer of the command line; for argparse."""
    value = number_argument(text)
    if not value.is_integer():
        raise argparse.ArgumentTypeError(f'{text!r} must be an integer')
    return int(value)


_RECORDED = ('; or the recording of a plan, of the node or of a command, which is carried out as '
             'it was published: without options of a motion')


def add_arm(parser: argparse.ArgumentParser, *, optional: bool = False,
            recorded: bool = False) -> None:
    """Add the arm, which every command needs unless it says otherwise, or a recording of it."""
    parser.add_argument('arm', metavar='ARM', nargs='?' if optional else None,
                        help='arm file, - for standard input, or a preset: '
                        f'{", ".join(sorted(preset_files()))}'
                        + (_RECORDED if recorded else ''))


def add_folder(parser: argparse.ArgumentParser, default: str = 'output') -> None:
    """Add the folder that everything is written into."""
    parser.add_argument('--output', type=path_argument, default=Path(default), metavar='DIR',
                        help='folder for all that is written (default: %(default)s)')


def numbers(option: str, text: str, sizes: int | Sequence[int] = (), unit: str = '', *,
            finite: bool = True) -> Array:
    """
    Return comma-separated numbers, unless `finite` infinite ones too and of any count.

    Raises
    ------
    InvalidValueError
        Naming the option, if they are no numbers or not as many as one of `sizes`.

    """
    values = [_entry(option, part.strip(), text) for part in text.split(',')]
    return vector(option, values, sizes, unit=unit) if finite else np.array(values)


def _entry(option: str, part: str, text: str) -> float:
    """Return a number of a list."""
    try:
        return float(read_number(part))
    except NumberTextError as error:
        if AMBIGUOUS.fullmatch(part):
            raise InvalidValueError(option, part, str(error)) from None
        raise InvalidValueError(option, text, 'numbers separated by commas') from None


def positions(option: str, text: str, arm: Arm) -> Array:
    """Return joint positions: angles [rad] from degrees, ways [m] of joints that slide."""
    turned = angles(option, text, arm.n_joints)
    return np.where(list(map(slides, arm.joints)), np.degrees(turned), turned)


def angles(option: str, text: str, count: int) -> Array:
    """Return joint angles [rad] from comma-separated degrees; errors as in `numbers`."""
    most = float(np.degrees(MAX_JOINT_ANGLE))
    degrees = vector(option, numbers(option, text, count, 'deg'), count, at_least=-most,
                     at_most=most, unit='deg')
    return np.radians(degrees)
