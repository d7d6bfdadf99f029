"""How near to its limit a search ends, and how far from it another may start."""

from __future__ import annotations

from factories import SearchFactory
from flex_planner.capacity.max_payload import find_max_payload
from known_limits import HEAVIEST, one_link
import numpy as np
import pytest

every_arm = pytest.mark.parametrize('name', HEAVIEST)


@pytest.mark.parametrize('accuracy', [3e-6, 1e-4, 1.0])
def test_bracket_is_as_narrow_as_asked(accuracy: float) -> None:
    found = find_max_payload(one_link(2.0), accuracy=accuracy)
    assert found.solved, found.message
    # the motion at the lower end is as exact as the bracket is narrow
    assert found.payload - accuracy / 10 <= 3 <= found.local_upper + accuracy / 10
    assert 0 < found.local_upper - found.payload <= accuracy


def test_accuracy_of_ten_kilograms_needs_no_step() -> None:
    found = find_max_payload(one_link(20.0), accuracy=10.0)
    assert found.payload <= 399 <= found.local_upper


@every_arm
def test_gap_bounds_the_limit_at_every_extremal(search_of: SearchFactory, name: str) -> None:
    extremals = search_of(name).extremals
    assert all(one.value < HEAVIEST[name] < one.value + one.gap for one in extremals)
    assert all(np.diff([one.gap for one in extremals]) < 0)


@pytest.mark.parametrize('duration', [1.05, 2.0, 10.0])
def test_gap_bounds_the_limit_of_one_link(duration: float) -> None:
    extremals = find_max_payload(one_link(duration), accuracy=1e-4).extremals
    assert len(extremals) > 1
    assert all(one.value < duration**2 - 1 < one.value + one.gap for one in extremals)


def test_start_for_others_leaves_a_gap(search_of: SearchFactory) -> None:
    middle = search_of('ei5').restart_point
    assert middle is not None
    assert 0.01 < middle.gap / middle.value < 0.1
