"""
Decoding by the definition that a message was recorded with.

Where that is not the one known here, as in recordings of older planners, the recording carries
it as a text.

"""

from __future__ import annotations

from typing import Any, Final

from flex_planner.base.errors import RecordingError
from flex_planner.recording.definitions import MessageTypes
from flex_planner.recording.topics import Definition

HASH: Final = 'RIHS01_'  # REP-2016; hashes of another kind cannot be compared
CDR: Final = (b'\x00\x00', b'\x00\x01')
ZSTD: Final = b'\x28\xb5\x2f\xfd'


class Decoder:
    """
    Decodes the messages of recordings.

    Parameters
    ----------
    types : MessageTypes
        The definitions known here.

    """

    def __init__(self, types: MessageTypes) -> None:
        self._types = types
        self._found: dict[Definition, MessageTypes | RecordingError] = {}

    def types_of(self, definition: Definition) -> MessageTypes:
        """
        Return the types by which a definition is decoded: those known here where they agree.

        Raises
        ------
        RecordingError
            If there is no definition, or it cannot be trusted.

        """
        if definition not in self._found:
            try:
                self._found[definition] = self._find(definition)
            except RecordingError as error:
                self._found[definition] = error
        found = self._found[definition]
        if isinstance(found, RecordingError):
            raise found
        return found

    def decode(self, definition: Definition, data: bytes) -> Any:
        """
        Return a message.

        Raises
        ------
        RecordingError
            If its definition cannot be used, or the bytes are not such a message.

        """
        check_encoding(data)
        types = self.types_of(definition)
        # a text without a hash may be that of another type, which would leave most bytes over
        doubtful = types is not self._types and not definition.type_hash.startswith(HASH)
        return types.decode(definition.type_name, data, exact=doubtful)

    def _find(self, definition: Definition) -> MessageTypes:
        """Return the types of a definition, see `types_of`."""
        name, recorded = definition.type_name, definition.type_hash
        known = self._types.type_hash(name) if name in self._types else ''
        comparable = recorded.startswith(HASH)
        if known and (recorded == known or not (comparable or definition.text)):
            return self._types
        if not definition.text:
            raise RecordingError(
                f'its type {name} was recorded with the type hash {recorded}, but its definition '
                f'here has {known}' if known else f'its type {name} is unknown')
        own = self._types.parse(definition)
        found = own.type_hash(name)
        if comparable and found != recorded:
            raise RecordingError(f'the recorded definition of its type {name} contradicts the '
                                 'recorded type hash')
        return self._types if found == known else own


def check_encoding(data: bytes) -> None:
    """Raise RecordingError unless bytes begin like a message of ROS 2."""
    if data[:4] == ZSTD:
        raise RecordingError('its messages are compressed one by one: unpack them with '
                             'ros2 bag convert first')
    if data[:2] not in CDR:
        raise RecordingError(f'a message starts with {data[:4]!r}, which is not CDR')
