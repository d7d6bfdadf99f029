"""Paths that an exploration starts from: their ends, derivatives, shapes and order."""

from __future__ import annotations

from itertools import islice

from flex_planner.base.validation import Array
from flex_planner.planning.kinds.paths import fixed_paths, JointPath, random_paths
import numpy as np
import pytest

T = 1.7
START, GOAL = np.array([0.4, -1.0, 2.0, 0.1]), np.array([1.9, -2.2, 1.0, 0.6])
# a straight one, and detours; and how many more there are under gravity
COUNTS = {1: 3, 2: 8, 3: 8, 4: 8}
SWINGS = {1: 1, 2: 2, 3: 2, 4: 2}
links = pytest.mark.parametrize('n', COUNTS)


def first_paths(n: int, *, gravity: bool = True, more: int = 8) -> list[JointPath]:
    """Return all fixed paths of an arm with n joints, and some random ones."""
    start, goal = START[:n], GOAL[:n]
    return [*fixed_paths(start, goal, gravity=gravity), *islice(random_paths(start, goal), more)]


def at(path: JointPath, share: float) -> Array:
    """Return the angles at a share of the duration."""
    return path(np.array([share]), T)[0][0]


@links
def test_every_path_leads_from_start_to_goal(n: int) -> None:
    for path in first_paths(n):
        q, v, a = path(np.linspace(0, 1, 5), T)
        assert q.shape == v.shape == a.shape == (5, n)
        np.testing.assert_allclose(q[[0, -1]], [START[:n], GOAL[:n]], atol=1e-12)


@links
def test_speeds_and_accelerations_are_the_derivatives(n: int) -> None:
    share, h = np.linspace(0.01, 0.99, 23), 1e-4
    for path in first_paths(n):
        (before, *_), (_, v, a), (after, *_) = (path(share + k * h, T) for k in (-1, 0, 1))
        here = path(share, T)[0]
        # what is left of a central difference goes with h^2, and rounding with 1 / h^2
        np.testing.assert_allclose(v, (after - before) / (2 * h * T), atol=1e-4)
        np.testing.assert_allclose(a, (after - 2 * here + before) / (h * T)**2, atol=1e-4)


@links
def test_first_path_is_straight_and_no_two_are_alike(n: int) -> None:
    paths = first_paths(n)
    assert not paths[0].detours.any()
    share = np.linspace(0, 1, 17)
    curves = [path(share, T)[0] for path in paths]
    for i, curve in enumerate(curves):
        assert all(np.abs(curve - other).max() > 0.1 for other in curves[:i])


@links
def test_gravity_adds_swings_of_the_first_joint(n: int) -> None:
    level, hanging = (first_paths(n, gravity=gravity, more=0) for gravity in (False, True))
    assert (len(level), len(hanging)) == (COUNTS[n], COUNTS[n] + SWINGS[n])
    for path in hanging[-SWINGS[n]:]:
        away = np.abs(at(path, 0.25) - at(level[0], 0.25))
        assert away[0] > 2
        assert not away[1:].any()


@links
def test_bows_go_with_the_stroke_of_their_joint(n: int) -> None:
    # a joint that turns the other way bows the other way
    forth, back = (list(fixed_paths(*ends, gravity=True)) for ends in (
        (START[:n], GOAL[:n]), (-START[:n], -GOAL[:n])))
    mirrored = [one for one, other in zip(forth, back, strict=True)
                if np.allclose(at(one, 0.3), -at(other, 0.3))]
    # all but those via a given side of an elbow
    assert len(mirrored) == {1: 4, 2: 8, 3: 8, 4: 8}[n]


@pytest.mark.parametrize('elbow', [0.0, 2.5, -2.5])
def test_two_links_pass_stretched_and_folded_to_either_side(elbow: float) -> None:
    paths = first_paths(2, gravity=False, more=0)
    assert sum(at(path, 0.5)[1] == pytest.approx(elbow) for path in paths) == 1


def test_random_paths_are_the_same_for_every_task() -> None:
    one, again = (islice(random_paths(START[:2], GOAL[:2]), 12) for _ in range(2))
    other = islice(random_paths(GOAL[:2], START[:2]), 12)
    for first, second, third in zip(one, again, other, strict=True):
        assert (first.detours == second.detours).all()
        assert (first.detours == third.detours).all()


def test_random_paths_stray_less_and_more() -> None:
    detours = np.array([path.detours for path in islice(random_paths(START, GOAL), 400)])
    spread = detours.reshape(100, 4, 3, 4).std(axis=(0, 3))
    # deviations in turn, and the j-th sine term j times as small; of 400 numbers each
    np.testing.assert_allclose(spread, np.outer([0.7, 1.5, 2.5, 3.5], [1, 1 / 2, 1 / 3]),
                               rtol=0.15)
