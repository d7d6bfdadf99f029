"""
Arm files: YAML in physical quantities, read strictly.

An unknown key is an error, so that a misspelt quantity is never silently left out. The presets
lie in ``config/arms``.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
import math
import os
from pathlib import Path
import re
import sys
from typing import Any

from flex_planner.arm import Arm, Joint, Link, Motor, Node
from flex_planner.errors import FlexPlannerError, InvalidValueError
from flex_planner.validation import number
import yaml

_MAX_BYTES = 1_000_000
_UNITS = {'length': 'm', 'mass': 'kg', 'linear_density': 'kg/m', 'density': 'kg/m^3',
          'flexural_rigidity': 'N m^2', 'youngs_modulus': 'N/m^2', 'width': 'm',
          'thickness': 'm', 'second_moment_of_area': 'm^4', 'shape_mass': 'kg',
          'shape_inertia': 'kg m^2'}


class ArmFileError(FlexPlannerError):
    """An arm file cannot be found, read or understood; the message names file and field."""


def config_folders() -> list[Path]:
    """Return where presets are looked for: ROS shares, the source tree, the Python prefix."""
    prefixes = [Path(entry) for entry in os.environ.get('AMENT_PREFIX_PATH', '').split(':')
                if entry]
    shares = [prefix / 'share' / 'flex_planner' / 'config'
              for prefix in (*prefixes, Path(sys.prefix))]
    return [Path(__file__).parents[1] / 'config', *shares]


def find_arm_file(name: str) -> Path:
    """
    Return the file of a preset or, if it is a path, the path.

    Raises
    ------
    ArmFileError
        If there is none; the message lists the presets.

    """
    if name.endswith(('.yaml', '.yml')) or os.sep in name:
        path = Path(name)
        if not path.is_file():
            raise ArmFileError(f'arm file {name!r} does not exist')
        return path
    found = preset_files()
    if name not in found:
        raise ArmFileError(f'arm {name!r} is neither a path ending in .yaml nor one of the '
                           f'presets {sorted(found)}')
    return found[name]


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
        Name of a preset in ``config/arms``, or path of a YAML file.

    Raises
    ------
    ArmFileError
        If the file is missing, is no YAML, or a field is unknown, missing or out of bounds.

    """
    path = find_arm_file(os.fspath(name))
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise ArmFileError(f'{path}: the file is larger than {_MAX_BYTES} bytes')
        content = yaml.load(path.read_text(encoding='utf-8'), _StrictLoader)
    except (OSError, ValueError, RecursionError, yaml.YAMLError) as error:
        raise ArmFileError(f'{path}: cannot be read: {error}') from None
    try:
        return arm_from_mapping(content)
    except InvalidValueError as error:
        raise ArmFileError(f'{path}: {error}') from error


def arm_from_mapping(content: object) -> Arm:
    """
    Return the arm described by the content of an arm file.

    Raises
    ------
    InvalidValueError
        Naming the field by its path in the file, e.g. ``links[1].length``.

    """
    top = _Section('', content)
    arm: Arm = top.build(
        Arm, name=top.text('name'), source=top.text('source', ''),
        links=tuple(_link(section) for section in top.sections('links')),
        joints=tuple(_joint(section) for section in top.sections('joints')),
        nodes=tuple(_node(section) for section in top.sections('nodes', optional=True)),
        gravity=top.take('gravity', (0.0, 0.0)))
    return arm


class _StrictLoader(yaml.SafeLoader):
    """YAML in which a key may be given once only."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return a mapping; PyYAML itself would keep the last of equal keys silently."""
        keys = [key.value for key, _ in node.value]
        for key_node, _ in node.value:
            if keys.count(key_node.value) > 1:
                raise yaml.constructor.ConstructorError(
                    None, None, f'field {key_node.value!r} is given twice', key_node.start_mark)
        return super().construct_mapping(node, deep)


# YAML 1.1, which PyYAML reads, takes 7e10 and 7.0e10 for text
_StrictLoader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$'),
    list('-+.0123456789'))


class _Section:
    """A mapping of an arm file that knows its path and which keys were read."""

    def __init__(self, path: str, content: object) -> None:
        if not isinstance(content, Mapping):
            raise InvalidValueError(path or 'the file', content, 'a mapping of fields')
        self.path = path
        self._left: dict[Any, Any] = dict(content)

    def name(self, key: str) -> str:
        """Return the path of a field."""
        return f'{self.path}.{key}' if self.path else key

    def has(self, key: str) -> bool:
        """Return whether a field is given."""
        return key in self._left

    def take(self, key: str, default: Any = None) -> Any:
        """Return a field; without a default it must be there."""
        if key not in self._left and default is None:
            raise InvalidValueError(self.name(key), None, 'given')
        return self._left.pop(key, default)

    def number(self, key: str, *, above: float = -math.inf) -> float:
        """Return a number, checked here because others are computed from it."""
        return number(self.name(key), self.take(key), above=above, unit=_UNITS[key])

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text field."""
        value = self.take(key, default)
        if not isinstance(value, str):
            raise InvalidValueError(self.name(key), value, 'text')
        return value

    def sections(self, key: str, optional: bool = False) -> Iterator[_Section]:
        """Return the entries of a list of mappings."""
        entries = self.take(key, () if optional else None)
        if not isinstance(entries, Sequence) or isinstance(entries, str):
            raise InvalidValueError(self.name(key), entries, 'a list')
        return (_Section(f'{self.name(key)}[{i}]', entry) for i, entry in enumerate(entries))

    def finish(self) -> None:
        """Refuse fields that nobody read."""
        for key in self._left:
            raise InvalidValueError(self.name(str(key)), self._left[key],
                                    'left out: there is no such field')

    def build(self, kind: Any, **values: Any) -> Any:
        """Construct a part; its errors name the field by its path."""
        self.finish()
        try:
            return kind(**values)
        except InvalidValueError as error:
            raise type(error)(self.name(error.field), error.value, error.bound) from None


def _link(section: _Section) -> Link:
    length = section.number('length', above=0)
    area, second_moment = _cross_section(section)
    density = _one_of(section, {
        'linear_density': lambda value: value, 'mass': lambda value: value / length,
        'density': lambda value: value * area})
    modes = section.take('modes', 0)
    rigidity = math.inf
    if modes or section.has('flexural_rigidity') or section.has('youngs_modulus'):
        rigidity = _one_of(section, {
            'flexural_rigidity': lambda value: value,
            'youngs_modulus': lambda value: value * second_moment})
    family = section.take('mode_family', 'pinned_pinned')
    shape = {name: section.number(name) for name in ('shape_mass', 'shape_inertia')
             if family == 'clamped_mass'}
    link: Link = section.build(
        Link, length=length, linear_density=density, modes=modes, flexural_rigidity=rigidity,
        mode_family=family, damping_ratio=section.take('damping_ratio', 0.0), **shape)
    return link


def _cross_section(section: _Section) -> tuple[float, float]:
    """Return area [m^2] and second moment [m^4] of the section; NaN where they are not given."""
    if section.has('section'):
        part = _Section(section.name('section'), section.take('section'))
        width, thickness = part.number('width', above=0), part.number('thickness', above=0)
        part.finish()
        return width * thickness, width * thickness**3 / 12
    if section.has('second_moment_of_area'):
        return math.nan, section.number('second_moment_of_area', above=0)
    return math.nan, math.nan


def _one_of(section: _Section, ways: Mapping[str, Callable[[float], float]]) -> float:
    """Return a quantity that may be given in several ways, but has to be given in one."""
    given = [name for name in ways if section.has(name)]
    if len(given) != 1:
        raise InvalidValueError(section.name(' or '.join(ways)),
                                ' and '.join(given) or None, 'given, one of them')
    result = ways[given[0]](section.number(given[0], above=0))
    if math.isnan(result):
        needs = 'section' if given[0] == 'density' else 'section or second_moment_of_area'
        raise InvalidValueError(section.name(needs), None, f'given with {given[0]}')
    return result


def _joint(section: _Section) -> Joint:
    motor = Motor()
    if section.has('motor'):
        part = _Section(section.name('motor'), section.take('motor'))
        motor = part.build(Motor, stall_torque=part.take('stall_torque'),
                           no_load_speed=part.take('no_load_speed', math.inf))
    joint: Joint = section.build(
        Joint, motor=motor, viscous_friction=section.take('viscous_friction', 0.0),
        lower_limit=section.take('lower_limit', -math.inf),
        upper_limit=section.take('upper_limit', math.inf))
    return joint


def _node(section: _Section) -> Node:
    node: Node = section.build(Node, mass=section.take('mass', 0.0),
                               inertia=section.take('inertia', 0.0))
    return node
