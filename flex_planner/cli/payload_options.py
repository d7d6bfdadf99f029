"""The options that say what a payload is like, besides its mass."""

from __future__ import annotations

import argparse
from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_body import as_matrix, Matrix, NO_INERTIA
from flex_planner.base.validation import Array
from flex_planner.cli.options import numbers
import numpy as np

# of the entries xx, yy, zz, xy, xz, yz
_ROWS = ((0, 3, 4), (3, 1, 5), (4, 5, 2))


def add_payload_shape(parser: argparse.ArgumentParser) -> None:
    """Add ``--payload-inertia`` and ``--payload-com``."""
    parser.add_argument(
        '--payload-inertia', metavar='KG_M2', help='moment of inertia of the payload about its '
        'centre of mass (default: that of the arm file, or 0); of a spatial arm also three, '
        'about the axes of the tip, or six: xx,yy,zz,xy,xz,yz')
    parser.add_argument(
        '--payload-com', metavar='X,Y', help='centre of mass of the payload in the frame of the '
        'tip [m]; X,Y,Z of a spatial arm (default: that of the arm file, or the tip)')


def take_payload_shape(options: argparse.Namespace, arm: Arm) -> tuple[Arm, float | None]:
    """
    Return the arm with the payload's shape that is given, and the inertia of `Task`.

    Raises
    ------
    InvalidValueError
        Naming the option.

    """
    if options.payload_com is not None:
        place = numbers('--payload-com', options.payload_com, arm.dimension, 'm')
        arm = replace(arm, payload_com=place)
    if options.payload_inertia is None:
        return arm, None
    sizes = (1, 3, 6) if isinstance(arm, SpatialArm) else (1,)
    given = numbers('--payload-inertia', options.payload_inertia, sizes, 'kg m^2')
    if isinstance(arm, SpatialArm):  # instead of what the file says
        arm = replace(arm, payload_tensor=_tensor(given))
    return arm, float(given[0]) if given.size == 1 else 0.0


def _tensor(given: Array) -> Matrix:
    """Return the matrix of three principal moments or six entries; zeros of one number."""
    if given.size == 1:
        return NO_INERTIA
    return as_matrix(np.diag(given) if given.size == 3 else given[np.array(_ROWS)])
