"""States at both ends of a motion: given, or at a price, and as the payload bends them."""

from __future__ import annotations

from collections.abc import Callable

from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.planning.plan import Plan
from free_problems import extended


def test_payload_bends_the_ends_under_gravity_only(saturated: Callable[[str], Plan]) -> None:
    for name, bends in (('rigid', False), ('ei5', False), ('crane', True)):
        made, solution = extended(saturated(name), FreePayloadProblem)
        for side, z in ((made.left, solution.nodes[0]), (made.right, solution.nodes[-1])):
            assert side(z)[1][:, -2].any() == bends
