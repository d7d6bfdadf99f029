"""
Definitions of message types, and the encoding of messages that follows from them.

The standard types of ROS 2 Jazzy come with rosbags; our own are read from their .msg files. CDR
is produced here because rclpy's ``serialize_message`` leaves the padding uninitialised.

"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
import struct
from typing import Any, cast, Final

from flex_planner.base.errors import RecordingError
from flex_planner.recording.conversion import convert_message
from flex_planner.recording.definition_files import read_texts
from flex_planner.recording.topics import Definition
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc, Typesdict
from rosbags.serde import SerdeError
from rosbags.typesys import (
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
    Stores,
    TypesysError,
)
from rosbags.typesys.store import Typestore

SEPARATOR: Final = 80 * '='
SPARE_BYTES: Final = 16  # as rclpy leaves behind a small message
LONGEST_REASON: Final = 200  # characters
# What rosbags raises at bytes that are not a message of the type.
DAMAGED_MESSAGE: Final = (SerdeError, struct.error, ValueError, LookupError, MemoryError,
                          OverflowError)


class MessageTypes:
    """
    The message types that a recording can hold.

    Parameters
    ----------
    store : Typestore
        Definitions and classes.
    texts : mapping of str to str
        Text of the .msg file of a type, where known: it goes into the schema with its comments,
        so that a recording explains its units.

    """

    def __init__(self, store: Typestore, texts: Mapping[str, str]) -> None:
        self._store = store
        self._texts = dict(texts)
        self._definitions: dict[str, Definition] = {}  # put together so far

    @classmethod
    def load(cls, definition_folders: Iterable[Path | str] = ()) -> MessageTypes:
        """
        Return the standard types together with those of interface packages.

        Parameters
        ----------
        definition_folders : iterable of path
            Folders ``<package>/`` that contain ``msg/*.msg``, e.g. ``share/<package>``. Services
            and actions are not topics and are left out.

        Raises
        ------
        RecordingError
            If a folder has no definitions, or one is malformed, contradicts a standard type or
            uses an unknown one.

        """
        store = get_typestore(Stores.ROS2_JAZZY)
        texts: dict[str, str] = {}
        for folder in definition_folders:
            texts.update(read_texts(Path(folder)))
        _register(store, texts)
        _unify_char(store)
        types = cls(store, texts)
        for name in texts:
            list(types._dependencies(name))
        return types

    def __contains__(self, type_name: str) -> bool:
        """Return whether a type is known."""
        return type_name in self._store.fielddefs

    def message_class(self, type_name: str) -> type:
        """Return a dataclass for messages of a type, for use without ROS."""
        self._require(type_name)
        return self._store.types[type_name]

    def type_hash(self, type_name: str) -> str:
        """Return the RIHS01 hash of a type (REP-2016)."""
        self._require(type_name)
        return self._store.hash_rihs01(type_name)

    def definition(self, type_name: str) -> Definition:
        """Return what a recording carries of a type."""
        if type_name not in self._definitions:
            self._definitions[type_name] = Definition(
                type_name, 'ros2msg', self.schema(type_name).encode(), self.type_hash(type_name))
        return self._definitions[type_name]

    def schema(self, type_name: str) -> str:
        """Return the definition of a type and of all types within it, encoding ``ros2msg``."""
        parts = [self._text(type_name)]
        for name in dict.fromkeys(self._dependencies(type_name)):
            parts.append(f'{SEPARATOR}\nMSG: {name.replace("/msg/", "/")}\n{self._text(name)}')
        return ''.join(parts)

    def encode(self, type_name: str, message: object) -> bytes:
        """
        Return a message in CDR, little endian, padded with zeros.

        Raises
        ------
        InvalidValueError
            If a field is missing or its value does not fit its type.

        """
        self._require(type_name)
        path = type_name.rpartition('/')[2]
        converted = convert_message(self._store, type_name, message, path)
        return bytes(self._store.serialize_cdr(converted, type_name, little_endian=True))

    def decode(self, type_name: str, data: bytes, *, exact: bool = False) -> Any:
        """
        Return the message that CDR bytes stand for.

        Spare bytes at the end are tolerated: rclpy leaves them behind empty sequences, and
        ``ros2 bag record`` keeps them. They may not be most of the bytes, if `exact`.

        Raises
        ------
        RecordingError
            If the bytes are not a message of this type.

        """
        self._require(type_name)
        definition = self._store.get_msgdef(type_name)
        if data[:2] not in (b'\x00\x00', b'\x00\x01'):
            raise RecordingError(f'a {type_name} starts with {data[:4]!r}, which is not CDR')
        little = definition.deserialize_cdr_le
        decoder = little if data[1] else definition.deserialize_cdr_be
        try:
            message, end = decoder(data[4:], 0, definition.cls, self._store)
        except DAMAGED_MESSAGE as error:
            raise RecordingError(f'{len(data)} bytes are not a {type_name}: {error}') from error
        if exact and len(data) - 4 - end > max(end, SPARE_BYTES):
            raise RecordingError(f'{len(data)} bytes are not a {type_name}, which takes {end}')
        return message

    def parse(self, definition: Definition) -> MessageTypes:
        """
        Return the types of a definition that a recording carries.

        Types that its text uses and does not define are those known here.

        Raises
        ------
        RecordingError
            If the text is no such definition.

        """
        name = definition.type_name
        read = {'ros2msg': lambda text: get_types_from_msg(text, name),
                'ros2idl': get_types_from_idl}.get(definition.encoding)
        if read is None:
            raise RecordingError(f'the definition of its type {name} is '
                                 f'of the unknown encoding {definition.encoding!r}')
        store = Typestore()
        try:
            store.register(read(definition.text.decode().replace('\r', '')))
            types = MessageTypes(store, {})
            types._complete(self)
            types.type_hash(name)
            store.get_msgdef(name)
        except Exception as error:  # parser and compiler of rosbags raise anything at any text
            reason = ' '.join(str(error).split())[:LONGEST_REASON] or type(error).__name__
            raise RecordingError(f'the recorded definition of its type {name} cannot be used: '
                                 f'{reason}') from error
        return types

    def fields(self, type_name: str) -> dict[str, FieldDesc]:
        """Return the description of each field of a type."""
        self._require(type_name)
        return dict(self._store.fielddefs[type_name][1])

    def constants(self, type_name: str) -> dict[str, Any]:
        """Return the constants of a type."""
        self._require(type_name)
        return {name: value for name, _, value in self._store.fielddefs[type_name][0]}

    def _complete(self, others: MessageTypes) -> None:
        """Add the types within these types that only others know."""
        _unify_char(self._store)
        left = list(self._store.fielddefs)
        while left:
            for _, description in self._store.fielddefs[left.pop()][1]:
                nested = nested_type(description)
                if nested is not None and nested not in self and nested in others:
                    self._store.fielddefs[nested] = others._store.fielddefs[nested]
                    self._store.types[nested] = others._store.types[nested]
                    left.append(nested)

    def _require(self, type_name: str) -> None:
        """Raise if a type is unknown."""
        if type_name not in self:
            raise RecordingError(f'unknown message type {type_name}')

    def _text(self, type_name: str) -> str:
        """Return the definition of one type, ending in a newline."""
        self._require(type_name)
        if type_name in self._texts:
            return self._texts[type_name]
        return self._store.gendefhash(type_name, {}, ros_version=2)[0]

    def _dependencies(self, type_name: str) -> Iterator[str]:
        """Yield the types within a type, depth first; some of them more than once."""
        self._require(type_name)
        for _, description in self._store.fielddefs[type_name][1]:
            nested = nested_type(description)
            if nested is not None:
                yield nested
                yield from self._dependencies(nested)


def _register(store: Typestore, texts: Mapping[str, str]) -> None:
    """Add types to a store."""
    definitions: Typesdict = {}
    for name, text in texts.items():
        try:
            definitions.update(get_types_from_msg(text, name))
            store.register({name: definitions[name]})
        except TypesysError as error:
            raise RecordingError(f'cannot use the definition of {name}: {error}') from error


def _unify_char(store: Typestore) -> None:
    """Make uint8 of char: in ROS 2 they are one type, also in the hash."""
    for name, (constants, fields) in store.fielddefs.items():
        store.fielddefs[name] = (constants, [(f, _without_char(d)) for f, d in fields])


def nested_type(description: FieldDesc) -> str | None:
    """Return the message type of a field, if it is one or a sequence of one."""
    kind, detail = description
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        kind, detail = cast(FieldDesc, detail[0])
    return cast(str, detail) if kind == Nodetype.NAME else None


def _without_char(description: FieldDesc) -> FieldDesc:
    """Return a description with uint8 for char."""
    kind, detail = description
    if kind == Nodetype.BASE and detail[0] == 'char':
        return cast(FieldDesc, (kind, ('uint8', 0)))
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return cast(FieldDesc, (kind, (_without_char(cast(FieldDesc, detail[0])), detail[1])))
    return description
