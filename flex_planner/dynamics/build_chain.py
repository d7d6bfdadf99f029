"""Which derivation of the dynamics an arm takes: all that uses a `Chain` asks here."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.dynamics.chain import Chain
from flex_planner.dynamics.planar_chain import build_planar_chain


def build_chain(arm: Arm) -> Chain:
    """Return the symbolic dynamics of an arm: planar chains are the only kind so far."""
    return build_planar_chain(arm)
