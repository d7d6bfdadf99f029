"""The motions of a map as starts for plans and searches like them."""

from __future__ import annotations

from dataclasses import dataclass
import logging
from pathlib import Path

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import plain_arm
from flex_planner.base.text import printable
from flex_planner.base.yaml_text import format_yaml, parse_yaml, YamlTextError
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.kept_motions import distances, KeptMotion, signature
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.store_layout import MOTIONS, SIGNATURES
from flex_planner.maps.stored_map import MapStoreError, StoredMap
from flex_planner.optimal_control.task import Task
import numpy as np

_LOG = logging.getLogger(__name__)


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
        self._stored = StoredMap(path)
        group = self._stored.group
        if not self._stored.keeps_motions:
            raise MapStoreError(f'the map {path} keeps no motions to start from: compute one '
                                'with keep_motions: true')
        _check_arm(path, group.attrs['arm'], arm)
        self._path, self._coordinates = path, self._stored.coordinates()
        self._names: list[str] = list(group[MOTIONS].attrs[SIGNATURES])
        self._cells = np.argwhere(self._stored.read()['code'] == CellCode.SOLVED)
        with np.errstate(over='ignore'):  # damaged ones may be anything
            self._signatures = self._stored.signatures()[tuple(self._cells.T)].astype(np.float32)
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
        for nearest in np.argsort(apart):
            if not apart[nearest] <= 1:
                return None
            known = self._known(tuple(int(k) for k in self._cells[nearest]))
            if known is not None:
                return known
        return None

    def _known(self, index: tuple[int, ...]) -> KnownCell | None:
        """Return a cell with its motion; None if that is damaged, or was not kept."""
        sides = self._stored.block_shape
        found = self._stored.motions_of(tuple(
            slice(k - k % side, min(k - k % side + side, size))
            for k, side, size in zip(index, sides, self._stored.shape, strict=True)))
        inside = tuple(k % side for k, side in zip(index, sides, strict=True))
        if found is None:
            _LOG.warning('the map cannot be read at %s: its motions there are damaged, and '
                         'requests start without them', self._place(index))
        if found is None or not found[1][inside]:
            return None
        return KnownCell(place=self._place(index), motion=KeptMotion.unpack(
            found[0][inside], found[1][inside]))

    def _place(self, index: tuple[int, ...]) -> str:
        """Return a cell in words."""
        values = ', '.join(f'{name} = {self._value(name, k)}'
                           for name, k in zip(self._stored.axes, index, strict=True))
        return f'{values} of {printable(self._path.name)}'

    def _value(self, name: str, k: int) -> str:
        """Return a value of an axis with its unit."""
        unit = str(self._stored.group[name].attrs.get('units', '1'))
        return f'{self._coordinates[name][k]:.6g}' + ('' if unit == '1' else f' {unit}')


def _check_arm(path: Path, there: str, arm: Arm) -> None:
    """Refuse a map of another arm; its name and source do not matter."""
    try:
        found = parse_yaml(there)
    except YamlTextError:
        found = None
    if not isinstance(found, dict):
        raise MapStoreError(f'the map {path} is damaged, its arm cannot be read: restore it from '
                            'a copy, or compute the map anew with --reset')
    own = parse_yaml(format_yaml(plain_arm(arm)))
    differing = [name for name in own if name not in ('name', 'source')
                 and own[name] != found.get(name)]
    if differing:
        raise MapStoreError(f'the map {path} is of another arm ({found.get("name")}): '
                            f'{", ".join(differing)} differ from those of {arm.name}')
