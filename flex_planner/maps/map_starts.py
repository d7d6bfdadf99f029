"""The motions of a map as starts for plans and searches like them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import plain_arm
from flex_planner.base.text import printable
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.kept_motions import distances, KeptMotion, signature
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.store import MapStoreError, open_group
from flex_planner.optimal_control.task import Task
import numpy as np
import yaml


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownCell:
    """
    A cell of a map near a task.

    Attributes
    ----------
    place : str
        Which cell of which map, in words.
    motion : KeptMotion
        What was found there.

    """

    place: str
    motion: KeptMotion


class MapStarts:
    """
    The solved cells of a map as starts for others.

    A map of largest payloads serves searches for them, one of least effort or vibration plans.

    Only one vector per cell is kept in memory; motions are read on demand.

    Parameters
    ----------
    path : Path
        Of the store; cells that are solved later are not seen.
    arm : Arm
        Whose motions are wanted.

    Raises
    ------
    MapStoreError
        If there is no map, it keeps no motions, or it is of another arm.

    """

    def __init__(self, path: Path, arm: Arm) -> None:
        group = open_group(path, 'r')
        if 'motions' not in group:
            raise MapStoreError(f'the map {path} keeps no motions to start from: compute one '
                                'with keep_motions: true')
        _check_arm(path, group.attrs['arm'], arm)
        self._path, self._group = path, group
        self._names: list[str] = list(group['motions'].attrs['signature'])
        self._cells = np.argwhere(np.asarray(group['code'][:]) == CellCode.SOLVED)
        signatures = np.asarray(group['motions/signature'][:], dtype=np.float32)
        self._signatures = signatures[tuple(self._cells.T)]
        self._of_payloads = group.attrs['quantity'] == Quantity.MAX_PAYLOAD.key

    def __len__(self) -> int:
        """Return the number of cells."""
        return len(self._cells)

    def near(self, task: Task, *, searched: bool = False) -> KnownCell | None:
        """
        Return the cell nearest to a task, None if none is near.

        Parameters
        ----------
        task : Task
            From rest to rest.
        searched : bool
            Whether its largest payload is looked for, and not the motion with its payload.

        """
        if not len(self._cells) or searched is not self._of_payloads:
            return None
        own = signature(task)
        apart = distances(self._signatures, own, self._names, searched=searched)
        nearest = int(apart.argmin())
        if not apart[nearest] <= 1:
            return None
        index = tuple(int(k) for k in self._cells[nearest])
        there = np.asarray(self._group['motions/signature'][index])
        packed = self._group['motions/motion'][index]
        return KnownCell(place=self._place(index), motion=KeptMotion.unpack(there, packed))

    def _place(self, index: tuple[int, ...]) -> str:
        """Return a cell in words."""
        axes: list[str] = self._group['code'].attrs['_ARRAY_DIMENSIONS']
        values = ', '.join(f'{name} = {_value(self._group[name], k)}'
                           for name, k in zip(axes, index, strict=True))
        return f'{values} of {printable(self._path.name)}'


def _value(axis: Any, k: int) -> str:
    """Return a value of an axis with its unit."""
    unit = str(axis.attrs['units'])
    return f'{float(axis[k]):.6g}' + ('' if unit == '1' else f' {unit}')


def _check_arm(path: Path, there: str, arm: Arm) -> None:
    """Refuse a map of another arm; its name and source do not matter."""
    found = yaml.safe_load(there)
    own = yaml.safe_load(yaml.safe_dump(plain_arm(arm)))
    differing = [name for name in own if name not in ('name', 'source')
                 and own[name] != found.get(name)]
    if differing:
        raise MapStoreError(f'the map {path} is of another arm ({found.get("name")}): '
                            f'{", ".join(differing)} differ from those of {arm.name}')
