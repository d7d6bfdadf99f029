"""
The colours of pictures and pages, and which curves are dashed.

A coordinate, a way to carry out a plan, and a result keep their colour from picture to page.

"""

from __future__ import annotations

from flex_planner.base.validation import Array
import numpy as np

# of the height of a diagram: nearer curves cannot be told apart; of the points, for them to hide
_NEAR, _MOST = 0.01, 0.7
# of joints, then modes, in the order of the coordinates; told apart in grey and by most eyes
COORDINATES = ('#0b62a4', '#d95f02', '#2a8a3e', '#8e44ad', '#b8860b', '#137a7f', '#a3195b',
               '#7a5230', '#555555', '#4b6cc1')
# plans of an arm with flexible links and of one with rigid links, and feedback without torques
FLEXIBLE, RIGID, FEEDBACK = '#0b62a4', '#d95f02', '#8e44ad'
# the tip as planned, and as the arm carries it
PLANNED, CARRIED_OUT = '#222222', '#c2185b'
# results of a search, and what is too much
CARRIED, REFUSED = '#2a8a3e', '#b3261e'
# what is only there to compare with: limits, arrivals, the arm on its way
ASIDE, ARM = '#777777', '#b9b9b9'
# points that a motion passes on its way
VIA = '#b8860b'


def coordinate_colour(index: int) -> str:
    """Return the colour of a joint or a mode, by its place among the coordinates."""
    return COORDINATES[index % len(COORDINATES)]


def hides_another(values: Array, index: int) -> bool:
    """Return whether a column of values (k, m) lies upon one before it, at most of its points."""
    height = float(np.ptp(values)) if values.size else 0.0
    gaps = np.abs(values[:, :index] - values[:, index:index + 1])
    return bool(values.size and ((gaps <= _NEAR * height).mean(axis=0) >= _MOST).any())
