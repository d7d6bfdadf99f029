"""Times of messages in nanoseconds."""

from __future__ import annotations

from flex_planner.ros.messages.classes import Time


def time_ns(stamp: Time) -> int:
    """Return a time message in nanoseconds, 0 if it is none [ns]."""
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def time_message(nanoseconds: int) -> Time:
    """Return a time message, none before 0."""
    seconds, rest = divmod(max(int(nanoseconds), 0), 10**9)
    return Time(sec=seconds, nanosec=rest)
