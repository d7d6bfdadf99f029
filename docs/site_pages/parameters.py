"""The page of the nodes' parameters, from the dataclasses that declare them."""

from __future__ import annotations

from dataclasses import Field, fields, MISSING
import json
from typing import Any

from flex_planner.ros.settings.fields import Description
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner.ros.settings.replay import ReplaySettings
from flex_planner.ros.settings.simulator import SimulatorSettings

from site_pages.markdown import code, definition, escape

NODES: dict[str, type[Any]] = {'flex_planner': PlannerSettings,
                               'arm_simulator': SimulatorSettings,
                               'replay': ReplaySettings}
_HEAD = """\
# Parameters of the nodes

Made from the dataclasses that declare them. `config/planner.yaml` has all of them with their
defaults, and `ros2 param describe` says the same of a running node. Those that are fixed can only
be set when the node starts. Lists with one entry per joint follow the arm where they are not
given: names are `joint1`, `joint2` and so on, or those of the URDF, whose base is `base_frame`
then; gains suit the inertia of each joint ([execution.md](../execution.md)).

The planner and the simulated arm have `arm` besides, the path of an [arm file](../arm_files.md) or
the name of a preset. `robot_description` is the text of a URDF file in place of the one that the
arm file names, `robot_description_topic` the topic on which it comes
([spatial_arms.md](../spatial_arms.md)). They are fixed.
"""


def parameters_page() -> str:
    """Return the page."""
    lines = [_HEAD]
    for node, settings in NODES.items():
        lines += [f'## {node}', '']
        for entry in fields(settings):
            lines += _parameter_lines(node, entry)
    return '\n'.join(lines)


def _parameter_lines(node: str, entry: Field[Any]) -> list[str]:
    """Return the entry of a parameter in a definition list."""
    description: Description = entry.metadata['description']
    default = entry.default if entry.default is not MISSING else _made(entry)
    facts = [f'{_type_name(default)}, default {code(json.dumps(default))}',
             *_range(description), *(['fixed'] if description.read_only else [])]
    return definition(f'{code(entry.name)}{{#{anchor(node, entry.name)}}}',
                      [escape(description.text), f'*{"; ".join(facts)}*'])


def anchor(node: str, name: str) -> str:
    """Return the anchor of a parameter, in letters that HTML keeps."""
    return f'{node}-{name}'.replace('_', '-')


def _made(entry: Field[Any]) -> Any:
    """Return a default that is made."""
    assert entry.default_factory is not MISSING
    return entry.default_factory()


def _type_name(value: object) -> str:
    """Return the type of a parameter in ROS."""
    if isinstance(value, list):
        return f'{_type_name(value[0])}[]'
    return {bool: 'bool', int: 'integer', float: 'double', str: 'string'}[type(value)]


def _range(description: Description) -> list[str]:
    """Return what a value may be, if there are bounds."""
    lowest, highest = description.lowest, description.highest
    if lowest is None and highest is None:
        return []
    if highest is None:
        return [f'at least {lowest:g}']
    return [f'{lowest:g} to {highest:g}' if lowest is not None else f'at most {highest:g}']
