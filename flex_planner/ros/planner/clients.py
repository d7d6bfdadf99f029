"""Whether somebody still waits for an answer, as far as the discovery of DDS can tell."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import time
from typing import Any

from rclpy.node import Node

Readers = frozenset[bytes]

# [s], in which whoever sent a request is discovered, if he was not before
_DISCOVERY = 2.0


def action_readers(node: Node, name: str) -> Callable[[], Readers]:
    """Return a function that returns who reads the feedback of an action, as its clients do."""
    topic = f'{node.resolve_service_name(name)}/_action/feedback'
    return lambda: _gids(node.get_subscriptions_info_by_topic(topic))


def service_readers(node: Node, name: str) -> Callable[[], Readers]:
    """Return a function that returns who reads the answers of a service."""
    topic = f'rr{node.resolve_service_name(name)}Reply'  # as ROS names it in DDS
    return lambda: _gids(node.get_subscriptions_info_by_topic(topic, no_mangle=True))


class Audience:
    """
    Those who may wait for the answer to one request.

    rclpy does not tell whose request it is: it may be that of anybody who was there when it came.
    Once all of them are gone, nobody waits. Where none is seen at all, nothing is known.

    Parameters
    ----------
    present : frozenset of bytes
        Who reads answers when the request comes.

    """

    def __init__(self, present: Readers) -> None:
        self._began, self._known, self._absent = time.monotonic(), present, False

    def is_gone(self, present: Readers) -> bool:
        """Return whether all are gone, given who reads answers, and were when last asked."""
        if time.monotonic() - self._began < _DISCOVERY:
            self._known |= present
            return False
        before, self._absent = self._absent, bool(self._known) and not self._known & present
        return before and self._absent


def _gids(endpoints: Iterable[Any]) -> Readers:
    return frozenset(bytes(endpoint.endpoint_gid) for endpoint in endpoints)
