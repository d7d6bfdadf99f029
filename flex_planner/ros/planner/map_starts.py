"""Starts for requests from the map that the planner was given, if it was given one."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.paths import expand_path
from flex_planner.optimal_control.task import Task

if TYPE_CHECKING:
    from flex_planner.maps.map_starts import KnownCell, MapStarts

_LOG = logging.getLogger(__name__)


class Starts:
    """
    Motions that requests near them start from.

    Parameters
    ----------
    store : str
        Path of the map's store; empty for none.
    arm : Arm
        Of the planner.

    Raises
    ------
    FlexPlannerError
        If it is no map of this arm, or what reads maps is not installed.

    """

    def __init__(self, store: str, arm: Arm) -> None:
        self._map = _load_map(store, arm) if store else None

    def __len__(self) -> int:
        """Return the number of motions."""
        return len(self._map) if self._map else 0

    def near(self, task: Task, *, searched: bool) -> KnownCell | None:
        """Return the cell that a task is near, None without one, see `MapStarts.near`."""
        if self._map is None:
            return None
        try:
            return self._map.near(task, searched=searched)
        except Exception:  # a map that was damaged meanwhile must not cost the plan
            _LOG.exception('the map cannot be read')
            return None


def _load_map(store: str, arm: Arm) -> MapStarts:
    try:
        from flex_planner.maps.map_starts import MapStarts
    except ImportError as error:
        raise FlexPlannerError(f'map_store is {store!r}, but the packages that read maps are '
                               f"missing: pip install 'flex_planner[maps]' ({error})") from error
    try:
        return MapStarts(expand_path(store), arm)
    except FlexPlannerError as error:
        raise FlexPlannerError(f'map_store is {store!r}, but {error}') from error
