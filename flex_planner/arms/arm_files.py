"""
Arm files: YAML in physical quantities, read strictly; the presets lie in ``config/arms``.

They describe planar arms; spatial ones where they say ``kind: spatial`` or name a URDF file.

"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
import math
import os
from pathlib import Path
import sys
from typing import Any, NoReturn

from flex_planner.arms.arm import Arm, BeamSection, Joint, Link, Node
from flex_planner.arms.arm_fields import read_joint, read_link, read_node, read_payload
from flex_planner.arms.plain_spatial_arm import (
    is_plain_spatial,
    joint_values,
    plain_spatial_arm,
    spatial_arm_from_plain,
)
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_files import is_spatial, read_spatial_arm
from flex_planner.arms.urdf_files import UrdfError
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.base.paths import expand_path, PathError, STANDARD_INPUT
from flex_planner.base.suggestions import did_you_mean
from flex_planner.base.text_files import say_file
from flex_planner.base.yaml_files import read_yaml, YamlFileError, YamlSection


class ArmFileError(FlexPlannerError):
    """An arm file cannot be found, read or understood; the message names file and field."""


def config_folders() -> list[Path]:
    """Return the folders that may hold presets: source tree, package, ROS shares, prefix."""
    prefixes = [Path(entry) for entry in os.environ.get('AMENT_PREFIX_PATH', '').split(':')
                if entry]
    shares = [prefix / 'share' / 'flex_planner' / 'config'
              for prefix in (*prefixes, Path(sys.prefix))]
    here = Path(__file__)
    return [here.parents[2] / 'config', here.parents[1] / 'config', *shares]


def find_arm_file(name: str) -> Path:
    """
    Return the file of a preset or, if it is a path, the path.

    Raises
    ------
    ArmFileError
        If there is none; the message lists the presets.

    """
    if is_arm_path(name):
        return _existing(name)
    found = preset_files()
    if name not in found:
        # a file needs no suffix, but a preset of its name comes first
        return _existing(name) if os.path.lexists(name) else _no_arm(name, found)
    return found[name]


def is_arm_path(name: str) -> bool:
    """Return whether a name is a path, of a file or of a pipe, and no name of a preset."""
    return (name == STANDARD_INPUT or os.sep in name or name.startswith('~')
            or name.lower().endswith(('.yaml', '.yml')))


def _existing(name: str) -> Path:
    """Return the path of what is there."""
    try:
        path = expand_path(name)
    except PathError as error:
        raise ArmFileError(f'arm file {error}') from None
    if name != STANDARD_INPUT and not _exists(path):
        raise ArmFileError(f'arm file {name!r} does not exist')
    return path


def _exists(path: Path) -> bool:
    """Return whether there is something, if need be something that cannot be read."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError:
        pass  # reading it will say why
    return True


def _no_arm(name: str, presets: Iterable[str]) -> NoReturn:
    names = sorted(presets)
    raise ArmFileError(f'arm {name!r} is neither a file nor one of the presets '
                       f'{", ".join(names)}{did_you_mean(name, names)}')


def preset_files() -> dict[str, Path]:
    """Return the arm files shipped with flex_planner, by name."""
    files = [path for folder in config_folders() for path in (folder / 'arms').glob('*.yaml')]
    return {path.stem: path for path in reversed(files)}


def read_arm_template() -> str:
    """
    Return the text of an arm file to start from.

    Raises
    ------
    ArmFileError
        If it is not installed.

    """
    for folder in config_folders():
        path = folder / 'arm_template.yaml'
        if path.is_file():
            return path.read_text(encoding='utf-8')
    raise ArmFileError('arm_template.yaml is not installed')


def load_arm(name: str | os.PathLike[str], description: str = '') -> Arm:
    """
    Return the arm described by a preset or a file.

    Parameters
    ----------
    name : str or path
        Name of a preset in ``config/arms``, or path of a YAML file; ``-`` is the standard input.
    description : str
        Text of a URDF file, a ``robot_description``: it stands for the one that the arm file
        names, which need not name any then.

    Raises
    ------
    ArmFileError
        If the file is missing, is no YAML, or a field is unknown, missing or out of bounds.

    """
    path = find_arm_file(os.fspath(name))
    try:
        return arm_from_mapping(read_yaml(path)[1], folder=path.parent,
                                description=description)
    except YamlFileError as error:
        raise ArmFileError(str(error)) from None
    except UrdfError as error:
        raise ArmFileError(f'{say_file(path)}: urdf: {error}') from None
    except InvalidValueError as error:
        raise ArmFileError(f'{say_file(path)}: {error}') from error


def arm_from_mapping(content: object, path: str = '', folder: Path = Path(),
                     description: str = '') -> Arm:
    """
    Return the arm described by the content of an arm file.

    Parameters
    ----------
    content : object
        As YAML has it.
    path : str
        Where it stands in another file, for messages.
    folder : pathlib.Path
        In which the path of a URDF file begins.
    description : str
        As of `load_arm`.

    Raises
    ------
    InvalidValueError
        Naming the field by its path in the file, e.g. ``links[1].length``.
    UrdfError
        If a URDF file that it names is missing or wrong.

    """
    top = YamlSection(path, content)
    if is_spatial(top) or description:
        return read_spatial_arm(top, folder, description)
    arm: Arm = top.build(
        Arm, name=top.text('name'), source=top.text('source', ''),
        links=tuple(read_link(section) for section in top.sections('links')),
        joints=tuple(read_joint(section) for section in top.sections('joints')),
        nodes=tuple(read_node(section) for section in top.sections('nodes', optional=True)),
        gravity=top.take('gravity', (0.0, 0.0)),
        **(read_payload(top.section('payload')) if top.has('payload') else {}))
    return arm


def plain_arm(arm: Arm) -> dict[str, Any]:
    """
    Return all values of an arm as YAML can write them.

    They are the fields of `Arm` or `SpatialArm` and its parts in SI units, which keep an arm in
    the metadata of recordings and maps; an arm file may say the same in other quantities.

    """
    if isinstance(arm, SpatialArm):
        return plain_spatial_arm(arm)
    return {**asdict(arm), 'gravity': arm.gravity.tolist(),
            'payload_com': arm.payload_com.tolist()}


def arm_from_plain(fields: Mapping[str, Any]) -> Arm:
    """
    Return the arm whose values `plain_arm` has written.

    Those of before motors had a largest torque say nothing of one: the line was the only limit.

    Raises
    ------
    FlexPlannerError
        If a value breaks its bound.
    KeyError, TypeError
        If a field is unknown or missing.

    """
    if is_plain_spatial(fields):
        return spatial_arm_from_plain(fields)
    return Arm(**{**fields, 'links': tuple(_link(entry) for entry in fields['links']),
                  'joints': tuple(_joint(entry) for entry in fields['joints']),
                  'nodes': tuple(Node(**entry) for entry in fields['nodes'])})


def _link(fields: Mapping[str, Any]) -> Link:
    """Return a link of its plain values."""
    sections = tuple(BeamSection(**entry) for entry in fields.get('sections', ()))
    return Link(**{**fields, 'sections': sections})


def _joint(fields: Mapping[str, Any]) -> Joint:
    """Return a joint of its plain values."""
    motor = {'max_torque': math.inf, **fields['motor']}
    return Joint(**joint_values({**fields, 'motor': motor}))
