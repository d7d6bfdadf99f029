"""
Classes of messages for use without ROS.

They have the fields, constants and defaults of the classes that ROS generates. Values are checked
where they are encoded, see `conversion`.

"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast, Final

from flex_planner.recording.definitions import MessageTypes, nested_type
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc

ZEROS: Final = {'string': '', 'bool': False, 'float32': 0.0, 'float64': 0.0, 'byte': b'\x00'}


class StandIns:
    """
    Makes a class of each type that is asked for.

    Parameters
    ----------
    types : MessageTypes
        Their definitions.

    """

    def __init__(self, types: MessageTypes) -> None:
        self._types = types
        self._classes: dict[str, Any] = {}

    def find(self, type_name: str) -> Any:
        """Return the class of a type, the same every time; RecordingError if it is unknown."""
        if type_name not in self._classes:
            defaults = {name: self._default(description)
                        for name, description in self._types.fields(type_name).items()}
            self._classes[type_name] = _make_class(
                type_name, defaults, self._types.constants(type_name))
        return self._classes[type_name]

    def complete(self, message: Any, types: MessageTypes, type_name: str) -> Any:
        """
        Return a message of another definition of a type as one of this one.

        What it lacks, or has of another type, has its default.

        Parameters
        ----------
        message : object
            The message.
        types : MessageTypes
            With its definition.
        type_name : str
            Its type.

        """
        others = types.fields(type_name)
        return self.find(type_name)(**{
            name: getattr(message, name)
            for name, description in self._types.fields(type_name).items()
            if others.get(name) == description})

    def _default(self, description: FieldDesc) -> Callable[[], Any]:
        """Return what makes the default of a field."""
        kind, detail = description
        if kind == Nodetype.BASE:
            zero = ZEROS.get(cast(str, detail[0]), 0)
            return lambda: zero
        if kind == Nodetype.NAME:
            return cast(Callable[[], Any], self.find(cast(str, nested_type(description))))
        if kind == Nodetype.SEQUENCE:
            return list
        item, count = self._default(cast(FieldDesc, detail[0])), cast(int, detail[1])
        return lambda: [item() for _ in range(count)]


def _make_class(type_name: str, defaults: dict[str, Callable[[], Any]],
                constants: dict[str, Any]) -> type:
    """Return a class with fields, their defaults, and constants."""

    def initialise(self: Any, **values: Any) -> None:
        for name, default in defaults.items():
            setattr(self, name, values.pop(name) if name in values else default())
        if values:
            raise AttributeError(f'{type_name} has no field {next(iter(values))}')

    def show(self: Any) -> str:
        fields = ', '.join(f'{name}={getattr(self, name)!r}' for name in defaults)
        return f'{type_name}({fields})'

    return type(type_name.rpartition('/')[2], (), {
        **constants, '__slots__': tuple(defaults), '__init__': initialise, '__repr__': show})
