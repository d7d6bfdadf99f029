"""Node parameters declared from a dataclass, see `flex_planner.ros.settings.fields`."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, TypeVar

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.ros.settings.fields import Description
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

Settings = TypeVar('Settings')

_DEFAULT_ARM = 'korayem_ei50'


def declare(node: Node, settings: Settings) -> Settings:
    """
    Declare every field of a settings dataclass as a parameter.

    Parameters
    ----------
    node : Node
        Where.
    settings : dataclass
        Its values are the defaults.

    Returns
    -------
    dataclass
        With the values that the node was started with.

    Raises
    ------
    FlexPlannerError
        If a value is empty or breaks a bound; what rclpy itself checks is a ParameterException.

    """
    values = {}
    for entry in fields(settings):  # type: ignore[arg-type]
        default = getattr(settings, entry.name)
        description = entry.metadata['description']
        value = node.declare_parameter(
            entry.name, default, _descriptor(description, default)).value
        if value is None:  # what rcl makes of an empty list in YAML
            raise InvalidValueError(entry.name, value, 'a value, or left out')
        values[entry.name] = _plain(value)
    return replace(settings, **values)  # type: ignore[type-var]


def declare_arm(node: Node) -> Arm:
    """
    Declare the read-only parameter ``arm`` and return the arm that it names.

    Raises
    ------
    ArmFileError
        If there is no such arm, or its file is wrong.

    """
    description = Description(
        text='Name of a preset in config/arms, or path of an arm file.', read_only=True)
    name = str(node.declare_parameter('arm', _DEFAULT_ARM, _descriptor(description, '')).value)
    return load_arm(name)


def apply_changes(settings: Settings, changes: list[Parameter]) -> Settings:
    """
    Return the settings with changed parameters; those of others (use_sim_time) are ignored.

    Raises
    ------
    FlexPlannerError
        If the new values do not fit together.

    """
    known = {entry.name for entry in fields(settings)}  # type: ignore[arg-type]
    values = {change.name: _plain(change.value) for change in changes if change.name in known}
    return replace(settings, **values)  # type: ignore[type-var]


def judge_changes(settings: Any, changes: list[Parameter]) -> SetParametersResult:
    """Return whether changed parameters are acceptable, with the reason if not."""
    try:
        apply_changes(settings, changes)
    except FlexPlannerError as error:
        return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)


def _descriptor(description: Description, value: object) -> ParameterDescriptor:
    """Return the descriptor of a parameter with such a value."""
    descriptor = ParameterDescriptor(description=description.text,
                                     read_only=description.read_only)
    lowest, highest = description.lowest, description.highest
    if lowest is None or highest is None:
        return descriptor
    if isinstance(value, int):
        descriptor.integer_range = [IntegerRange(
            from_value=int(lowest), to_value=int(highest), step=0)]
    else:
        descriptor.floating_point_range = [FloatingPointRange(
            from_value=float(lowest), to_value=float(highest), step=0.0)]
    return descriptor


def _plain(value: Any) -> Any:
    """Return a parameter value with arrays as lists."""
    return list(value) if hasattr(value, 'tolist') or isinstance(value, tuple) else value
