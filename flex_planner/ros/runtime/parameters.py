"""Node parameters declared from a dataclass, see `flex_planner.ros.settings.fields`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import arm_from_mapping, load_arm
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.base.suggestions import nearest_name
from flex_planner.ros.runtime.descriptions import hear_description
from flex_planner.ros.settings.fields import Description
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter
import yaml

Settings = TypeVar('Settings')

ARM_PARAMETERS = ('arm', 'robot_description', 'robot_description_topic')
_DEFAULT_ARM = 'korayem_ei50'
# of ROS itself: none of a node's own, and not declared before they are used
_OF_ROS = 'qos_overrides', 'use_sim_time', 'start_type_description_service'


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
        given, descriptor = _given(node), _descriptor(entry.metadata['description'], default)
        floats = _as_floats(given[entry.name].value, default) if entry.name in given else None
        value = node.declare_parameter(
            entry.name, default if floats is None else floats, descriptor,
            ignore_override=floats is not None).value
        if value is None:  # what rcl makes of an empty list in YAML
            raise InvalidValueError(entry.name, value, 'a value, or left out')
        values[entry.name] = _plain(value)
    node.add_pre_set_parameters_callback(
        lambda changes: [_with_floats(change, values) for change in changes])
    return replace(settings, **values)  # type: ignore[type-var]


def warn_of_unknown(node: Node, settings: type, others: Sequence[str] = ()) -> None:
    """
    Log the parameters that a node is given but does not know, each with the name that is nearest.

    Parameters
    ----------
    node : Node
        Before its parameters are declared.
    settings : type
        Dataclass of its parameters.
    others : sequence of str
        Further parameters.

    """
    known = [*others, *(entry.name for entry in fields(settings))]
    unknown = [name for name in _given(node)
               if name not in known and name.partition('.')[0] not in _OF_ROS]
    if unknown:
        node.get_logger().warning(
            f'there is no parameter {"; no ".join(_with_nearest(name, known) for name in unknown)}'
            ': what is given for it is not used')


def _with_nearest(name: str, known: Sequence[str]) -> str:
    """Return an unknown name, with the known one that is meant."""
    nearest = nearest_name(name, known)
    return f'{name} (did you mean {nearest}?)' if nearest else name


def _given(node: Node) -> Mapping[str, Parameter]:
    """Return the parameters of files and command line, which rclpy offers in no other way."""
    given: Mapping[str, Parameter] = node._parameter_overrides
    return given


def _with_floats(change: Parameter, values: Mapping[str, Any]) -> Parameter:
    """Return a change of a parameter, as floats where the parameter has them."""
    floats = _as_floats(change.value, values.get(change.name))
    return change if floats is None else Parameter(change.name, value=floats)


def _as_floats(value: Any, like: Any) -> float | list[float] | None:
    """Return whole numbers, or a list as text, as floats where a parameter has those, or None."""
    if isinstance(like, float):
        return float(value) if isinstance(value, int) and not isinstance(value, bool) else None
    if not isinstance(like, list) or not like or not isinstance(like[0], float):
        return None
    entries = _list(value) if isinstance(value, str) else _plain(value)
    if not isinstance(entries, list) or not entries or not all(
            isinstance(entry, (int, float)) and not isinstance(entry, bool) for entry in entries):
        return None
    try:
        return [float(entry) for entry in entries]
    except OverflowError:
        return None


def _list(text: str) -> object:
    """Return what ros2 param set takes for a text: a list of whole and of other numbers."""
    try:
        content: object = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        return None
    return content


def declare_arm(node: Node) -> Arm:
    """
    Declare the read-only parameters `ARM_PARAMETERS` and return the arm that they describe.

    Raises
    ------
    FlexPlannerError
        If there is no such arm, its file or its URDF is wrong, or no URDF comes in time.

    """
    description = Description(
        text='Name of a preset in config/arms, or path of an arm file.', read_only=True)
    node.declare_parameter('arm', _DEFAULT_ARM, _descriptor(description, ''))
    text = declare_description(node)
    name = name_arm_file(node)
    return load_arm(name, text) if name else arm_from_mapping({}, description=text)


def name_arm_file(node: Node) -> str:
    """Return preset or path of the arm that was declared; empty if it is a URDF without one."""
    described = any(node.get_parameter(name).value for name in ARM_PARAMETERS[1:])
    return '' if described and 'arm' not in _given(node) else str(node.get_parameter('arm').value)


def declare_description(node: Node) -> str:
    """
    Declare the parameters of a robot's description and return it, empty if there is none.

    Raises
    ------
    FlexPlannerError
        If both are given, or nothing comes on the topic.

    """
    texts = ('Text of a URDF file, in place of the one that the arm file names; without an arm '
             'file every link is rigid.', 'Topic on which such a text comes, of a '
             'robot_state_publisher for example; empty: none.')
    text, topic = (str(node.declare_parameter(
        name, '', _descriptor(Description(text=about, read_only=True), '')).value)
        for name, about in zip(ARM_PARAMETERS[1:], texts, strict=True))
    if text and topic:
        raise InvalidValueError(ARM_PARAMETERS[2], topic, f'empty where {ARM_PARAMETERS[1]} is '
                                'given')
    return hear_description(node, topic) if topic else text


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
