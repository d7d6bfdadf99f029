"""An arm in motion as SVG: where it starts, passes and ends, links as they bend."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points
from flex_planner.base.colours import ARM, FLEXIBLE, PLANNED
from flex_planner.base.validation import Array
import numpy as np

_STATIONS, _BETWEEN = 13, 4
_MARGIN = 0.06
_SIDE = 320  # [px], the longer one
_DIGITS = 4


def motion_svg(arm: Arm, coordinates: Array) -> str:
    """
    Return a picture of a motion.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.
    coordinates : numpy.ndarray, shape (k, n_t)
        q at some instants, the first at the start and the last at the goal.

    """
    points = link_points(arm, coordinates, _STATIONS)
    tip = points[:, -1, -1]
    everything = np.concatenate([points.reshape(-1, 2), np.zeros((1, 2))])
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = _MARGIN * max(arm.reach, 1e-9)
    (left, bottom), (width, height) = low - margin, high - low + 2 * margin
    unit = max(width, height) / 100
    ways = np.linspace(0, len(points) - 1, _BETWEEN + 2).astype(int)
    shapes = [_line(points[k].reshape(-1, 2), ARM, 0.4 * unit) for k in ways[1:-1]]
    shapes.append(_line(tip, PLANNED, 0.4 * unit, f'{unit:.3g}'))
    shapes += [_line(points[k].reshape(-1, 2), FLEXIBLE, 1.2 * unit, opacity=opacity)
               for k, opacity in ((0, 0.4), (-1, 1.0))]
    shapes += [_dot(place, colour, size * unit) for place, colour, size in (
        (np.zeros(2), '#444', 2.0), (tip[0], PLANNED, 1.4), (tip[-1], PLANNED, 1.8))]
    scale = _SIDE / max(width, height)
    return (f'<svg width="{width * scale:.0f}" height="{height * scale:.0f}" viewBox="{left:.5g} '
            f'{-bottom - height:.5g} {width:.5g} {height:.5g}" role="img" aria-label="the arm in '
            f'motion"><g transform="scale(1, -1)" fill="none">{"".join(shapes)}</g></svg>')


def _line(points: Array, colour: str, width: float, dashes: str = '',
          opacity: float = 1.0) -> str:
    """Return a line through points (k, 2) [m]."""
    path = ' '.join(f'{x:.{_DIGITS}f},{y:.{_DIGITS}f}' for x, y in points)
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ''
    return (f'<polyline points="{path}" stroke="{colour}" stroke-width="{width:.3g}" '
            f'opacity="{opacity:g}" stroke-linejoin="round"{dashed}/>')


def _dot(place: Array, colour: str, size: float) -> str:
    """Return a dot at a point [m]."""
    x, y = place
    return f'<circle cx="{x:.{_DIGITS}f}" cy="{y:.{_DIGITS}f}" r="{size:.3g}" fill="{colour}"/>'
