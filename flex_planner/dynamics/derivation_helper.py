"""What a process does that derives functions for another one."""

from __future__ import annotations

from multiprocessing.connection import Connection

from flex_planner.base.helper_process import ending_with_caller
from flex_planner.dynamics.function_source import Builder, FunctionSource, write_source


def serve(requests: Connection, replies: Connection) -> None:
    """Answer requests with the source of their functions, or None."""
    while True:
        build: Builder = requests.recv()
        with ending_with_caller(requests):
            answer = _derive(build)
        replies.send(answer)


def _derive(build: Builder) -> FunctionSource | None:
    """Return the source of functions; None where it fails, as it will where that is told."""
    try:
        return write_source(build())
    except Exception:
        return None
