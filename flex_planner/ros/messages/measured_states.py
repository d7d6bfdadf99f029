"""States of the moving arm in messages: estimates with their bending, and tracks of angles."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
import threading

from flex_planner.base.text import shown_value
from flex_planner.base.validation import Array
from flex_planner.ros.messages.classes import JointState, PlanReport
from flex_planner.ros.messages.request_error import RequestError
from flex_planner.ros.messages.times import time_ns
import numpy as np
from numpy.typing import NDArray

# how far back angles are kept, and how close they are [ns]
WINDOW_NS = 250_000_000
_SPACING_NS = 4_000_000


def state_from_estimate(message: JointState, names: Sequence[str], topic: str) -> Array:
    """
    Return the state x = (q, q') of an estimate, shape (2 n_t,).

    Parameters
    ----------
    message : JointState
        With positions and velocities of all joints and modal coordinates, in any order.
    names : sequence of str
        Of the coordinates, in the order of the arm.
    topic : str
        Where it came, for sentences.

    Raises
    ------
    RequestError
        ARM_STATE_UNKNOWN if it lacks something, naming what.

    """
    given = {name: k for k, name in enumerate(message.name)}
    missing = [name for name in names if name not in given]
    sizes = {len(message.position), len(message.velocity), len(message.name)}
    problem = ''
    if missing:
        problem = f'does not name {", ".join(missing)}; it names {shown_value(list(given))}'
    elif len(sizes) > 1:
        problem = 'has not one position and one velocity per name'
    else:
        order = [given[name] for name in names]
        state: Array = np.concatenate([np.asarray(message.position)[order],
                                       np.asarray(message.velocity)[order]])
        if np.isfinite(state).all():
            return state
        problem = f'has {state[~np.isfinite(state)][0]} among its numbers'
    raise RequestError(PlanReport.ARM_STATE_UNKNOWN, f'the estimate on {topic} {problem}')


class AngleTrack:
    """
    The last angles of all joints by their stamps; may be used from several threads.

    Messages that lack a joint or a stamp are left out.

    Parameters
    ----------
    names : sequence of str
        Of the joints.

    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names, self._lock = list(names), threading.Lock()
        self._track: deque[tuple[int, list[float]]] = deque()

    def hear(self, message: JointState) -> None:
        """Take a message."""
        stamp, given = time_ns(message.header.stamp), dict(zip(message.name, message.position,
                                                               strict=False))
        angles = [given.get(name, np.nan) for name in self._names]
        if not stamp or not np.isfinite(angles).all():
            return
        with self._lock:
            if self._track and stamp < self._track[-1][0]:  # the clock was set back
                self._track.clear()
            if not self._track or stamp - self._track[-1][0] >= _SPACING_NS:
                self._track.append((stamp, angles))
            while self._track[0][0] < stamp - WINDOW_NS:
                self._track.popleft()

    def since(self, first_ns: int) -> tuple[NDArray[np.int64], Array]:
        """Return stamps (k,) [ns] and angles (k, n) [rad] from a time on."""
        with self._lock:
            kept = [entry for entry in self._track if entry[0] >= first_ns]
        return (np.array([stamp for stamp, _ in kept], dtype=np.int64),
                np.array([angles for _, angles in kept]).reshape(len(kept), len(self._names)))
