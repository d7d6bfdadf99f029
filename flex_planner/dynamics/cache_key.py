"""
Under which name the compiled functions of an arm are kept.

All sources that may enter them count, and all fields of the arm but a few that are known not to:
a new file or a new field makes a new name, so that stale machine code is never read.

"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from functools import cache
import json
from pathlib import Path

from flex_planner.arms.arm import Arm
from flex_planner.base.compiled_library import content_key
import numpy as np

# symbols in the functions, or nothing that they contain
FREE_FIELDS = frozenset({'Arm.name', 'Arm.source', 'Arm.payload_inertia',
                         'Link.flexural_rigidity', 'Link.family_assumed', 'Link.allowable_moment',
                         'Motor.stall_torque',
                         'Motor.no_load_speed', 'Motor.max_torque', 'Motor.max_speed',
                         'Joint.lower_limit', 'Joint.upper_limit', 'SpatialArm.name',
                         'SpatialArm.source', 'SpatialArm.notes', 'SpatialArm.payload_inertia',
                         'SpatialArm.joint_names', 'SpatialArm.frame_names',
                         'SpatialJoint.lower_limit', 'SpatialJoint.upper_limit'})
_PACKAGES = Path(__file__).parents[1]


def cache_key(arm: Arm, *packages: str) -> str:
    """
    Return the name of an arm's library.

    Parameters
    ----------
    arm : Arm
        Its fields enter, except for `FREE_FIELDS`.
    packages : str
        Folders of flex_planner whose sources the functions are derived by, besides ``arms``.

    """
    return content_key(describe_fields(arm, FREE_FIELDS), *packages,
                       *map(_sources, ('arms', *packages)))


def describe_fields(value: object, left_out: frozenset[str] = frozenset()) -> str:
    """
    Return nested dataclasses as text: equal for equal fields, whatever objects they share.

    Parameters
    ----------
    value : object
        A dataclass of numbers, strings, arrays, tuples and dataclasses.
    left_out : frozenset of str
        Fields that do not count, such as ``Arm.name``.

    """
    return json.dumps(_structure(value, left_out))


def _structure(value: object, left_out: frozenset[str]) -> object:
    """Return the fields of nested dataclasses by name, as JSON can hold them."""
    if is_dataclass(value):
        own = type(value).__name__
        return {field.name: _structure(getattr(value, field.name), left_out)
                for field in fields(value) if f'{own}.{field.name}' not in left_out}
    if isinstance(value, tuple):
        return [_structure(entry, left_out) for entry in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


@cache
def _sources(package: str) -> bytes:
    """Return the names and contents of all modules of a folder."""
    paths = sorted((_PACKAGES / package).rglob('*.py'))
    return b''.join(str(path.relative_to(_PACKAGES)).encode() + b'\0' + path.read_bytes()
                    for path in paths)
