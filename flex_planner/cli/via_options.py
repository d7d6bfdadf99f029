"""Options that name via points."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.number_texts import NumberTextError, read_number
from flex_planner.base.validation import Array
from flex_planner.cli.options import angles, numbers
from flex_planner.optimal_control.via_points import ViaPoint
import numpy as np

_POINT, _ANGLES, _ANY = '--via', '--via-angles', 'any'


def add_via_points(parser: argparse.ArgumentParser) -> None:
    """Add the options; both fill one list, so that their order is that of the motion."""
    add = parser.add_argument
    add(_POINT, dest='via_points', action='append', default=[], metavar='[S:]X,Y[,Z]',
        type=lambda text: (_POINT, text),
        help='point that the tip passes, at the time before the colon, or else at the best time; '
        'may be given several times, in the order of the motion [s, m]')
    add(_ANGLES, dest='via_points', action='append', metavar='[S:]DEG,DEG,...',
        type=lambda text: (_ANGLES, text),
        help=f'joint angles that are passed likewise; {_ANY} for a joint that may stand anywhere')


def via_points(given: Sequence[tuple[str, str]], arm: Arm) -> tuple[ViaPoint, ...]:
    """
    Return the via points of a command line.

    Raises
    ------
    InvalidValueError
        Naming option, value and bound.

    """
    return tuple(_via_point(option, text, arm) for option, text in given)


def _via_point(option: str, text: str, arm: Arm) -> ViaPoint:
    before, colon, place = text.rpartition(':')
    time = _time(option, before, text) if colon else None
    if option == _POINT:
        return ViaPoint(point=numbers(option, place, arm.dimension, 'm'), time=time)
    return ViaPoint(positions=_some_angles(place, arm.n_joints), time=time)


def _time(option: str, text: str, whole: str) -> float:
    """Return the time before a colon [s]."""
    try:
        time = float(read_number(text.strip()))
    except NumberTextError:
        raise InvalidValueError(option, whole, 'a time, a colon and numbers') from None
    if not 0 < time < np.inf:
        raise InvalidValueError(option, whole, 'a time > 0 s before the colon')
    return time


def _some_angles(text: str, count: int) -> Array:
    """Return angles (n,) [rad], NaN where one is not given."""
    parts = [part.strip() for part in text.split(',')]
    missing = np.array([part == _ANY for part in parts])
    found = angles(_ANGLES, ','.join('0' if gone else part
                                     for part, gone in zip(parts, missing, strict=True)), count)
    chosen: Array = np.where(missing, np.nan, found)
    return chosen
