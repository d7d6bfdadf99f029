"""
A double of the packages launch and launch_ros, where these are not installed.

Of what the launch files use it keeps what they were given; arguments have the values of a mapping.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
import sys
from types import ModuleType
from typing import Any
from unittest.mock import patch


class Given:
    """What a class was constructed with."""

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        self.arguments, self.keywords = arguments, keywords


class LaunchDescription(Given):
    """A list of entities."""


class LaunchContext(dict[str, str]):
    """The values of arguments."""


class DeclareLaunchArgument(Given):
    """An argument of a launch file."""


class OpaqueFunction(Given):
    """A function that returns entities."""


class Node(Given):
    """A node that is to be started."""


class IfCondition(Given):
    """A condition."""


class ParameterValue(Given):
    """A value with its type."""

    @property
    def value(self) -> Any:
        """Return the value as its type."""
        return self.keywords['value_type'](self.arguments[0])


class LaunchConfiguration(Given):
    """The value of an argument."""

    def perform(self, context: Mapping[str, str]) -> str:
        """Return it."""
        return context[self.arguments[0]]


@contextmanager
def doubled() -> Iterator[None]:
    """Let the launch files import the double."""
    modules = {
        'launch': [LaunchContext, LaunchDescription],
        'launch.actions': [DeclareLaunchArgument, OpaqueFunction],
        'launch.conditions': [IfCondition], 'launch.substitutions': [LaunchConfiguration],
        'launch_ros': [], 'launch_ros.actions': [Node],
        'launch_ros.parameter_descriptions': [ParameterValue]}
    found = {}
    for name, contents in modules.items():
        found[name] = ModuleType(name)
        for content in contents:
            setattr(found[name], content.__name__, content)
    found['launch'].SomeSubstitutionsType = object  # type: ignore[attr-defined]
    with patch.dict(sys.modules, found):
        sys.modules.pop('flex_planner.ros.launching', None)
        yield
        sys.modules.pop('flex_planner.ros.launching', None)
