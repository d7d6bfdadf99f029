"""Trajectories in CDR, as recordings have them: the bytes of `MessageTypes.encode`, quicker."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
import struct
from typing import Any

from flex_planner.base.validation import Array
from flex_planner.ros.messages.classes import FlexibleTrajectory, JointTrajectory, TYPES
import numpy as np
from numpy.typing import NDArray

JOINT_TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'
FLEXIBLE_TRAJECTORY = 'flex_planner_interfaces/msg/FlexibleTrajectory'

_TIME = 'time_from_start'
# fields of points, in the order of their definitions
_JOINTS = 'positions', 'velocities', 'accelerations', 'effort', _TIME
_FLEXIBLE = (_TIME, 'modal_displacements', 'modal_rates', 'position_costates',
             'velocity_costates', 'torque_costates')
_PLACE = 'x', 'y', 'z'


class _UnevenError(ValueError):
    """Points whose fields are not of the same lengths, or values that do not fit."""


def encode_joint_trajectory(message: JointTrajectory) -> bytes:
    """
    Return a trajectory in CDR.

    Raises
    ------
    InvalidValueError
        See `MessageTypes.encode`.

    """
    try:
        data = _Data()
        data.add_trajectory(message)
        return data.padded()
    except _UnevenError:
        return TYPES.encode(JOINT_TRAJECTORY, message)


def encode_flexible_trajectory(message: FlexibleTrajectory) -> bytes:
    """Return a trajectory as `encode_joint_trajectory`."""
    try:
        data = _Data()
        data.add_header(message.header)
        data.add_trajectory(message.joint_trajectory)
        data.add_texts(message.modal_names)
        data.add_points(message.points, _FLEXIBLE)
        data.add_places(message.tip_path)
        data.add('d', message.payload_mass)
        return data.padded()
    except _UnevenError:
        return TYPES.encode(FLEXIBLE_TRAJECTORY, message)


def encode_joint_points(empty: JointTrajectory, times_ns: NDArray[np.int64], positions: Array,
                        velocities: Array, accelerations: Array, efforts: Array) -> bytes:
    """Return a trajectory in CDR with points, at least one, of `joint_points` of these arrays."""
    times = np.stack(np.divmod(times_ns, 10**9), axis=1)
    data = _Data()
    data.add_joints(empty, dict(zip(
        _JOINTS, (positions, velocities, accelerations, efforts, times), strict=True)))
    return data.padded()


class _Data:
    """A message as it grows: little endian, numbers at multiples of their sizes after 4 bytes."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def padded(self) -> bytes:
        """Return it with its first 4 bytes, padded with zeros."""
        self._align(4)
        return b'\0\1\0\0' + bytes(self._bytes)

    def add(self, kind: str, value: float) -> None:
        """Add a number of a kind of `struct`."""
        self._align(struct.calcsize(kind))
        try:
            self._bytes += struct.pack(f'<{kind}', value)
        except struct.error as error:
            raise _UnevenError(str(error)) from error

    def add_texts(self, texts: Sequence[str]) -> None:
        """Add a sequence of texts."""
        self.add('I', len(texts))
        for text in texts:
            self._add_text(text)

    def add_header(self, header: Any) -> None:
        """Add a std_msgs/Header."""
        self.add('i', header.stamp.sec)
        self.add('I', header.stamp.nanosec)
        self._add_text(header.frame_id)

    def add_trajectory(self, message: JointTrajectory) -> None:
        """Add a joint trajectory."""
        self.add_header(message.header)
        self.add_texts(message.joint_names)
        self.add_points(message.points, _JOINTS)

    def add_places(self, places: Sequence[Any]) -> None:
        """Add a sequence of geometry_msgs/Point."""
        self.add('I', len(places))
        if len(places):
            self._align(8)
            rows = [[getattr(place, name) for name in _PLACE] for place in places]
            self._bytes += np.array(rows, dtype='<f8').tobytes()

    def add_points(self, points: Sequence[Any], fields: tuple[str, ...]) -> None:
        """Add points, whose fields are sequences of numbers but for the time."""
        self.add('I', len(points))
        if not len(points):
            return
        self._add_rows({name: _times(points) if name == _TIME else _column(points, name)
                        for name in fields})

    def add_joints(self, empty: JointTrajectory, columns: dict[str, Any]) -> None:
        """Add a joint trajectory with fields of its points, and the rest of another one."""
        self.add_header(empty.header)
        self.add_texts(empty.joint_names)
        self.add('I', len(columns[_TIME]))
        self._add_rows(columns)

    def _add_rows(self, columns: dict[str, Any]) -> None:
        """Add at least one point, from fields (k, size) and times (k, 2) in their order."""
        sizes = tuple((name, -1 if name == _TIME else values.shape[1])
                      for name, values in columns.items())
        count = len(columns[_TIME])
        self._bytes += b''.join(_rows(columns, sizes, len(self._bytes) % 8, count))

    def _add_text(self, text: str) -> None:
        encoded = text.encode()
        self.add('I', len(encoded) + 1)
        self._bytes += encoded + b'\0'

    def _align(self, size: int) -> None:
        self._bytes += bytes(-len(self._bytes) % size)


def _column(points: Sequence[Any], name: str) -> Array:
    """Return a field of all points, shape (k, its length)."""
    rows = [getattr(point, name) for point in points]
    size = len(rows[0])
    if any(getattr(row, 'typecode', '') != 'd' or len(row) != size for row in rows):
        raise _UnevenError(name)
    return np.frombuffer(b''.join(rows)).reshape(len(rows), size)


def _times(points: Sequence[Any]) -> NDArray[np.int64]:
    """Return seconds and nanoseconds of all points, shape (k, 2)."""
    return np.array([(point.time_from_start.sec, point.time_from_start.nanosec)
                     for point in points], dtype=np.int64)


def _rows(columns: dict[str, Any], sizes: tuple[tuple[str, int], ...], at: int,
          count: int) -> list[bytes]:
    """Return points one by one, of which the first begins so far after a multiple of 8 bytes."""
    begins = []
    for _ in range(count):
        begins.append(at)
        at = (at + _layout(sizes, at).itemsize) % 8
    encoded = {}
    for begin in set(begins):
        layout = _layout(sizes, begin)
        rows = np.zeros(count, dtype=layout)
        for name, size in sizes:
            if size > 0:
                rows[name] = columns[name]
            if size >= 0:
                rows[f'{name} count'] = size
            else:
                rows['sec'], rows['nanosec'] = columns[name].T
        data, step = rows.tobytes(), layout.itemsize
        encoded[begin] = [data[k * step:(k + 1) * step] for k in range(count)]
    return [encoded[begin][k] for k, begin in enumerate(begins)]


@lru_cache(maxsize=64)
def _layout(sizes: tuple[tuple[str, int], ...], begin: int) -> np.dtype[Any]:
    """Return where the fields of a point lie that begins so far after a multiple of 8 bytes."""
    names, formats, offsets, at = list[str](), list[Any](), list[int](), begin
    for name, size in sizes:
        parts: list[tuple[str, Any, int]] = [('sec', '<i4', 4), ('nanosec', '<u4', 4)]
        if size >= 0:
            parts = [(f'{name} count', '<u4', 4), (name, ('<f8', (size,)), 8)][:1 + (size > 0)]
        for part, kind, multiple in parts:
            at += -at % multiple
            names.append(part)
            formats.append(kind)
            offsets.append(at - begin)
            at += np.dtype(kind).itemsize
    return np.dtype({'names': names, 'formats': formats, 'offsets': offsets,
                     'itemsize': at - begin})
