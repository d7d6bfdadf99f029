"""Links that cross or fold, of postures that are drawn by hand."""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.arms.kinematics import link_points
from flex_planner.planning.link_overlaps import find_overlap, Overlap
import numpy as np
import pytest


def overlap(*degrees: list[float]) -> Overlap | None:
    """Return the overlap among postures of an arm with links of half a metre."""
    link = Link(length=0.5, linear_density=1.0)
    n = len(degrees[0])
    arm = Arm(name='chain', links=(link,) * n, joints=(Joint(),) * n)
    angles = np.radians(degrees)
    return find_overlap(link_points(arm, angles), angles)


def test_single_link_overlaps_nothing() -> None:
    assert overlap([0.0], [200.0]) is None


@pytest.mark.parametrize(('elbow', 'left'), [
    (180, 0), (171, 9), (-175, 5), (189, 9), (540, 0), (-531, 9)])
def test_link_folds_onto_the_one_before_from_either_side(elbow: float, left: float) -> None:
    found = overlap([30, 0], [30, elbow])
    assert found is not None
    assert (found.moment, found.links) == (1, (0, 1))
    assert found.angle == pytest.approx(np.radians(left), abs=1e-12)


@pytest.mark.parametrize('elbow', [0, 90, 169, -169, 191, 360])
def test_link_that_is_open_does_not_overlap(elbow: float) -> None:
    assert overlap([30, elbow]) is None


def test_links_that_are_no_neighbours_cross() -> None:
    # the fourth side of a square ends on the first; turned further, it crosses it
    assert overlap([0, 90, 90, 89]) is None
    found = overlap([0, 90, 90, 80], [0, 100, 100, 100], [0, 110, 110, 110])
    assert found == Overlap(moment=1, links=(0, 3))
    assert str(found) == 'links 1 and 4 cross'


def test_moment_that_is_told_is_the_most_folded_one() -> None:
    found = overlap([0, 10, 172], [0, 10, 178], [0, 10, 175])
    assert found is not None
    assert (found.moment, str(found)) == (1, 'links 2 and 3 lie within 2 deg over one another')
