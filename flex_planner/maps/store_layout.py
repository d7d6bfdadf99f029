"""The layout of a map in its store: variables, chunks and metadata."""

from __future__ import annotations

from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path
import reprlib
from typing import Any, TYPE_CHECKING

from dask import array
from flex_planner.arms.arm_files import plain_arm
from flex_planner.base.version import VERSION
from flex_planner.base.yaml_text import format_yaml, parse_yaml, YamlTextError
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.checksums import checksum
from flex_planner.maps.kept_motions import signature_fields
from flex_planner.maps.zarr_groups import add_array, add_bytes, open_folder, summarize
from flex_planner.optimal_control.task import Task
import numpy as np
import xarray as xr

if TYPE_CHECKING:
    from flex_planner.maps.study import Study

_CONVENTIONS = 'CF-1.11'
_LIBRARIES = ('casadi', 'numpy', 'scipy', 'xarray', 'zarr')
_TEXT = np.dtype('O', metadata={'element_type': str})  # how xarray marks text of any length
LAYOUT = 2  # of stores; 1 had no checksums
# groups of their own, which xarray leaves alone
MOTIONS, SIGNATURES = 'motions', 'signature'
SUMS = 'blocks/checksum'
TEXTS = ('message',)
# type, what stands where nothing is written, metadata; the quantity itself comes first
BESIDE: dict[str, tuple[Any, float | None, dict[str, str]]] = {
    'bound': (float, np.nan, {'long_name': 'bound of the true value'}),
    'cost': (float, np.nan, {'long_name': 'cost J', 'units': 'N^2 m^2 s'}),
    'tip_error': (float, np.nan, {'long_name': 'tip error of the re-simulation', 'units': 'm'}),
    'iterations': (np.int32, -1, {'long_name': 'Newton iterations', 'units': '1'}),
    'seconds': (float, np.nan, {'long_name': 'computing time', 'units': 's'}),
    'warm': (np.int8, -1, {'long_name': 'started from a neighbor: 1, otherwise 0'}),
    'message': (_TEXT, None, {'long_name': 'what became of the cell'}),
    # what is lost is not computed yet; xarray shows it as NaN
    'code': (np.int8, CellCode.PENDING, {'long_name': 'kind of outcome'}),
}


def write_empty(path: Path, study: Study) -> None:
    """Write a store without any result."""
    names, chunks = [axis.name for axis in study.axes], {'chunks': study.block_shape}
    key, unit = study.quantity.key, {'units': study.quantity.unit}
    kinds: dict[str, tuple[Any, float | None, dict[str, Any]]] = {
        key: (float, np.nan, {'long_name': study.quantity.value, **unit}), **BESIDE}
    variables = {
        # a single lazy block, so that nothing but metadata is written
        name: (names, array.zeros(study.shape, chunks=study.shape, dtype=kind), attributes)
        for name, (kind, _, attributes) in kinds.items()}
    coordinates = {axis.name: (axis.name, np.asarray(axis.values, dtype=float),
                               {'long_name': axis.title, 'units': axis.unit or '1'})
                   for axis in study.axes}
    encoding: dict[str, dict[str, Any]] = {
        name: {'_FillValue': filler, **chunks} for name, (_, filler, _) in kinds.items()}
    encoding['message'] = chunks  # text has no filler
    about = {**metadata(study), 'layout': LAYOUT,
             'axes_checksum': checksum(axis.values for axis in study.axes)}
    dataset = xr.Dataset(variables, coordinates, about)
    dataset['bound'].attrs |= unit
    dataset['code'].attrs |= _flags()
    dataset.to_zarr(path, mode='w-', compute=False, consolidated=False, zarr_format=2,
                    safe_chunks=False,
                    encoding={**encoding, **{name: {'_FillValue': np.nan} for name in names}})
    group = open_folder(path, 'r+')
    _add_sums(group, study)
    if study.keeps_motions:
        _add_motions(group, study)
    summarize(path)


def _add_sums(group: Any, study: Study) -> None:
    """Make room for the checksums of the blocks."""
    name, names = SUMS.split('/')
    blocks = tuple(-(-size // side)
                   for size, side in zip(study.shape, study.block_shape, strict=True))
    sums = group.create_group(name)
    sums.attrs['comment'] = ('CRC-32 of the values of each block, written last: of the variables, '
                             'of the motions; -1 where there is none')
    add_array(sums, names, [*(f'{axis.name}_block' for axis in study.axes), 'part'],
              shape=(*blocks, 2), chunks=(*(1 for _ in blocks), 2), dtype='<i8', fill=-1)


def _add_motions(group: Any, study: Study) -> None:
    """Make room for what other motions may start from."""
    arm = study.arm
    names = signature_fields(Task(arm=arm, start_positions=np.zeros(arm.n_joints),
                                  goal_positions=np.zeros(arm.n_joints), duration=1.0))
    motions = group.create_group(MOTIONS)
    motions.attrs.update({SIGNATURES: names, 'comment': (
        'motion: 4-byte floats, least byte first: payload [kg], price dJ/dm_p [1/kg], number of '
        'nodes, their times [s], and z = (q, dq/dt, psi_1, psi_2) at each of them; signature: '
        'what it solves')})
    axes = [axis.name for axis in study.axes]
    add_array(motions, 'signature', [*axes, 'quantity'], shape=(*study.shape, len(names)),
              chunks=(*study.block_shape, len(names)), dtype='<f8', fill=np.nan)
    add_bytes(motions, 'motion', axes, shape=study.shape, chunks=study.block_shape)


def _flags() -> dict[str, Any]:
    """Return the meanings of the codes, as CF flags and in words."""
    return {'flag_values': [int(code) for code in CellCode],
            'flag_meanings': ' '.join(code.name.lower() for code in CellCode),
            'comment': '; '.join(f'{code.value}: {code.meaning}' for code in CellCode)}


def metadata(study: Study) -> dict[str, str]:
    """Return the metadata of a study's store."""
    return {'title': study.name, 'quantity': study.quantity.key, 'study': study.text,
            'arm': format_yaml(plain_arm(study.arm)),
            'Conventions': _CONVENTIONS,
            'date_created': datetime.now(timezone.utc).isoformat(timespec='seconds'),
            'flex_planner_version': VERSION,
            **{f'{name}_version': version(name) for name in _LIBRARIES}}


def differences(there: dict[str, Any], wanted: dict[str, str]) -> list[str]:
    """Return the differences of two maps' metadata that change the numbers."""
    found = [f'{name.replace("_", " ")}: {wanted[name]}, there {there.get(name)}'
             for name in ('flex_planner_version', 'quantity') if wanted[name] != there.get(name)]
    for name in ('study', 'arm'):
        old, new = _loaded(there.get(name)), parse_yaml(wanted[name])
        if old == new:
            continue
        if not isinstance(old, dict) or not isinstance(new, dict):
            found.append(name)
            continue
        found += [f'{name}, {key}: {reprlib.repr(new.get(key))}, there '
                  f'{reprlib.repr(old.get(key))}'
                  for key in dict.fromkeys([*new, *old]) if new.get(key) != old.get(key)]
    return found


def _loaded(text: object) -> object:
    """Return what a text of YAML says, None if it is damaged."""
    try:
        return parse_yaml(str(text))
    except YamlTextError:
        return None
