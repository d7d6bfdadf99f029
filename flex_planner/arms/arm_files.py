"""Arm files: YAML in physical quantities, read strictly; the presets lie in ``config/arms``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
import math
import os
from pathlib import Path
import sys
from typing import Any, NoReturn

from flex_planner.arms.arm import Arm, Joint, Link, Motor, Node
from flex_planner.arms.quantities import check_quantity
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.base.paths import expand_path, PathError, STANDARD_INPUT
from flex_planner.base.text_files import say_file
from flex_planner.base.yaml_files import read_yaml, YamlFileError, YamlSection

_KINDS = {'shape_mass': 'mass', 'shape_inertia': 'inertia'}


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
    raise ArmFileError(f'arm {name!r} is neither a file nor one of the presets '
                       f'{sorted(presets)}')


def preset_files() -> dict[str, Path]:
    """Return the arm files shipped with flex_planner, by name."""
    files = [path for folder in config_folders() for path in (folder / 'arms').glob('*.yaml')]
    return {path.stem: path for path in reversed(files)}


def load_arm(name: str | os.PathLike[str]) -> Arm:
    """
    Return the arm described by a preset or a file.

    Parameters
    ----------
    name : str or path
        Name of a preset in ``config/arms``, or path of a YAML file; ``-`` is the standard input.

    Raises
    ------
    ArmFileError
        If the file is missing, is no YAML, or a field is unknown, missing or out of bounds.

    """
    path = find_arm_file(os.fspath(name))
    try:
        return arm_from_mapping(read_yaml(path)[1])
    except YamlFileError as error:
        raise ArmFileError(str(error)) from None
    except InvalidValueError as error:
        raise ArmFileError(f'{say_file(path)}: {error}') from error


def arm_from_mapping(content: object, path: str = '') -> Arm:
    """
    Return the arm described by the content of an arm file.

    Parameters
    ----------
    content : object
        As YAML has it.
    path : str
        Where it stands in another file, for messages.

    Raises
    ------
    InvalidValueError
        Naming the field by its path in the file, e.g. ``links[1].length``.

    """
    top = YamlSection(path, content)
    arm: Arm = top.build(
        Arm, name=top.text('name'), source=top.text('source', ''),
        links=tuple(_link(section) for section in top.sections('links')),
        joints=tuple(_joint(section) for section in top.sections('joints')),
        nodes=tuple(_node(section) for section in top.sections('nodes', optional=True)),
        gravity=top.take('gravity', (0.0, 0.0)))
    return arm


def plain_arm(arm: Arm) -> dict[str, Any]:
    """
    Return all values of an arm as YAML can write them.

    They are the fields of `Arm` and its parts in SI units, which keep an arm in the metadata of
    recordings and maps; an arm file may say the same in other quantities.

    """
    return {**asdict(arm), 'gravity': arm.gravity.tolist()}


def _link(section: YamlSection) -> Link:
    length = _number(section, 'length')
    area, second_moment = _cross_section(section)
    density = _one_of(section, {
        'linear_density': lambda value: value, 'mass': lambda value: value / length,
        'density': lambda value: value * area}, {'mass': 'length', 'density': 'section'})
    modes = section.take('modes', 0)
    rigidity = math.inf
    if modes or section.has('flexural_rigidity') or section.has('youngs_modulus'):
        rigidity = _one_of(section, {
            'flexural_rigidity': lambda value: value,
            'youngs_modulus': lambda value: value * second_moment},
            {'youngs_modulus': 'second moment of area'})
    family = section.take('mode_family', 'pinned_pinned')
    shape = {name: _number(section, name, above=-math.inf)
             for name in ('shape_mass', 'shape_inertia') if family == 'clamped_mass'}
    link: Link = section.build(
        Link, length=length, linear_density=density, modes=modes, flexural_rigidity=rigidity,
        mode_family=family, damping_ratio=section.take('damping_ratio', 0.0), **shape)
    return link


def _number(section: YamlSection, key: str, above: float = 0.0) -> float:
    """Return a quantity within its range."""
    return check_quantity(section.name(key), section.take(key), _KINDS.get(key, key), above=above)


def _cross_section(section: YamlSection) -> tuple[float, float]:
    """Return area [m^2] and second moment [m^4] of the section; NaN where they are not given."""
    if section.has('section'):
        part = section.section('section')
        width, thickness = _number(part, 'width'), _number(part, 'thickness')
        part.finish()
        return width * thickness, width * thickness**3 / 12
    if section.has('second_moment_of_area'):
        return math.nan, _number(section, 'second_moment_of_area')
    return math.nan, math.nan


def _one_of(section: YamlSection, conversions: Mapping[str, Callable[[float], float]],
            others: Mapping[str, str]) -> float:
    """
    Return a quantity that a file may give by several fields, but must give by one.

    It is the first of `conversions`; `others` are what it is computed from besides the given.

    """
    given = [name for name in conversions if section.has(name)]
    if len(given) != 1:
        raise InvalidValueError(section.name(' or '.join(conversions)),
                                ' and '.join(given) or None, 'given, exactly one of them')
    result = conversions[given[0]](_number(section, given[0]))
    if math.isnan(result):
        needs = 'section' if given[0] == 'density' else 'section or second_moment_of_area'
        raise InvalidValueError(section.name(needs), None, f'given with {given[0]}')
    kind = next(iter(conversions))
    name = f'{kind} (of {given[0]} and {others[given[0]]})' if given[0] in others else kind
    return check_quantity(section.name(name), result, kind, above=0)


def _joint(section: YamlSection) -> Joint:
    motor = Motor()
    if section.has('motor'):
        part = section.section('motor')
        # a motor may have a largest speed alone
        torque = (part.take('stall_torque', math.inf) if part.has('max_speed')
                  else part.take('stall_torque'))
        motor = part.build(Motor, stall_torque=torque,
                           no_load_speed=part.take('no_load_speed', math.inf),
                           max_speed=part.take('max_speed', math.inf))
    joint: Joint = section.build(
        Joint, motor=motor, viscous_friction=section.take('viscous_friction', 0.0),
        lower_limit=section.take('lower_limit', -math.inf),
        upper_limit=section.take('upper_limit', math.inf))
    return joint


def _node(section: YamlSection) -> Node:
    node: Node = section.build(Node, mass=section.take('mass', 0.0),
                               inertia=section.take('inertia', 0.0))
    return node
