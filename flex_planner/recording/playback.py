"""The messages of a playback that starts in the middle of a recording."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator

from flex_planner.recording.reader import SerializedMessage
from flex_planner.recording.topics import Durability


def from_time(messages: Iterable[SerializedMessage], start_ns: int) -> Iterator[SerializedMessage]:
    """
    Yield the messages from a log time on.

    In front of them, and as of that time, come what latched topics would still hold then: a
    subscriber that asks for it late gets what it would have got from the original publisher.

    """
    held: dict[str, deque[SerializedMessage]] = {}
    for message in messages:
        if message.log_time_ns >= start_ns:
            yield from _release(held, start_ns)
            yield message
        elif message.topic.qos.durability is Durability.TRANSIENT_LOCAL:
            kept = deque[SerializedMessage](maxlen=message.topic.qos.depth)
            held.setdefault(message.topic.name, kept).append(message)
    yield from _release(held, start_ns)


def _release(held: dict[str, deque[SerializedMessage]],
             time_ns: int) -> Iterator[SerializedMessage]:
    """Yield the held messages once, stamped with a time."""
    for messages in held.values():
        yield from (message._replace(log_time_ns=time_ns) for message in messages)
    held.clear()
