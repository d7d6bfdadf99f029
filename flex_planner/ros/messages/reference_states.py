"""Samples of a plan as joint states in CDR, as recordings have them."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.validation import Array
from flex_planner.planning.plan import Samples
from flex_planner.ros.messages.classes import JointState, TYPES
import numpy as np
from numpy.typing import NDArray

_STAMP, _BEFORE_NUMBERS = 4, 8  # bytes before the stamp, and between sequences of numbers


def encode_states(samples: Samples, names: Sequence[str],
                  stamps_ns: NDArray[np.int64]) -> list[bytes]:
    """
    Return samples as messages of joints and modal coordinates, with the torques of the joints.

    One is encoded, and the others are copies of it with numbers of their own: that is twenty times
    as quick.

    Parameters
    ----------
    samples : Samples
        Of k times, n_t coordinates.
    names : sequence of str, length n_t
        Of the joints, then of the modal coordinates.
    stamps_ns : numpy.ndarray of int64, shape (k,)
        Times of the messages, not before 0 [ns].

    """
    count, size = len(stamps_ns), len(names)
    none = [0.0] * size
    template = TYPES.encode('sensor_msgs/msg/JointState', JointState(
        name=list(names), position=none, velocity=none, effort=none))
    rows = np.tile(np.frombuffer(template, dtype=np.uint8), (count, 1))
    seconds = np.stack(np.divmod(stamps_ns, 10**9), axis=1).astype('<u4')
    rows[:, _STAMP:_STAMP + 8] = seconds.view(np.uint8)
    end = len(template)
    for values in (_with_zeros(samples.torques, size), samples.rates, samples.coordinates):
        rows[:, end - 8 * size:end] = np.ascontiguousarray(values, dtype='<f8').view(np.uint8)
        end -= 8 * size + _BEFORE_NUMBERS
    return [row.tobytes() for row in rows]


def _with_zeros(torques: Array, size: int) -> Array:
    """Return torques of joints with zeros for modal coordinates."""
    return np.hstack([torques, np.zeros((len(torques), size - torques.shape[1]))])
