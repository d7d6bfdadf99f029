"""Nodes take planar arms, and say so."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from flex_planner.arms.planar_only import PlanarOnlyError
from flex_planner.ros.runtime.parameters import declare_arm
import pytest


class OneParameter:
    """A node of which only the parameter ``arm`` is asked for."""

    def declare_parameter(self, name: str, default: str, descriptor: Any) -> SimpleNamespace:
        assert name == 'arm'
        assert descriptor.read_only
        return SimpleNamespace(value='spatial_3r')


def test_node_refuses_a_spatial_arm() -> None:
    with pytest.raises(PlanarOnlyError, match='must be a planar one: the nodes do not know'):
        declare_arm(OneParameter())  # type: ignore[arg-type]
