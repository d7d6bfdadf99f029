"""Logs as CSV: a header that names the columns, then a line per sample."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from pathlib import Path

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.text_files import say_file
from flex_planner.base.validation import Array
from flex_planner.control.joint_reference import JointReference
from flex_planner.identification.experiments import LogError
from flex_planner.identification.joint_log import JointLog, MOST_SAMPLES
import numpy as np

_MOST_BYTES = 200_000_000


def read_csv_log(path: Path, joints: int) -> JointLog:
    """
    Return a log.

    Parameters
    ----------
    path : pathlib.Path
        Of a table with the columns ``t`` [s], ``q1`` ... ``qn`` [rad], and, so far as they are
        known, ``tau1`` ... [N m] held from the sample on, and what the drive followed: ``qd1``
        ... [rad], ``vd1`` ... [rad/s] (else derived from them) and ``ff1`` ... [N m] (else none).
        Others are left alone.
    joints : int
        n.

    Raises
    ------
    LogError
        If it cannot be read, or lacks columns; the message names the line.
    InvalidValueError
        If the values are no log, see `JointLog`.

    """
    columns = _read_columns(path)

    def group(letters: str, *, needed: bool = False) -> Array | None:
        names = [f'{letters}{i}' for i in range(1, joints + 1)]
        lacking = [name for name in names if name not in columns]
        if lacking and (needed or len(lacking) < joints):
            raise LogError(f'{say_file(path)} has no column {lacking[0]}')
        return None if lacking else np.stack([columns[name] for name in names], axis=1)

    if 't' not in columns:
        raise LogError(f'{say_file(path)} has no column t, the time [s]')
    angles, torques, goals = group('q', needed=True), group('tau'), group('qd')
    assert angles is not None
    times = columns['t']
    log = JointLog(name=path.name, times=times, angles=angles,
                   torques=np.zeros((0, joints)) if torques is None else torques)
    if goals is None:
        return log
    return JointLog(name=log.name, times=times, angles=angles, torques=log.torques,
                    reference=_reference(times, goals, group('vd'), group('ff')),
                    reference_start=float(times[0]))


def _reference(times: Array, goals: Array, speeds: Array | None,
               efforts: Array | None) -> JointReference:
    """Return what the drive followed, with derivatives where they are not given."""
    speeds = np.gradient(goals, times, axis=0) if speeds is None else speeds
    return JointReference(
        times=times - times[0], positions=goals, velocities=speeds,
        accelerations=np.gradient(speeds, times, axis=0),
        torques=np.zeros_like(goals) if efforts is None else efforts)


def _read_columns(path: Path) -> dict[str, Array]:
    """Return the columns of a table by their names."""
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise LogError(f'{say_file(path)} is larger than {_MOST_BYTES:g} bytes')
        with path.open(newline='', encoding='utf-8-sig') as file:
            lines = csv.reader(file)
            names = [name.strip() for name in next(lines, [])]
            rows = [_numbers(path, lines.line_num, names, line) for line in lines if line]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise LogError(f'{say_file(path)} cannot be read: {error}') from None
    if len(set(names)) != len(names):
        raise LogError(f'{say_file(path)} has two columns of one name')
    if len(rows) > MOST_SAMPLES:
        raise InvalidValueError(f'samples of {path.name}', len(rows), f'at most {MOST_SAMPLES}')
    table = np.array(rows, dtype=float).reshape(len(rows), len(names))
    return dict(zip(names, table.T, strict=True))


def _numbers(path: Path, line: int, names: Sequence[str], cells: Sequence[str]) -> list[float]:
    """Return the numbers of a line; columns that nobody asks for may hold anything."""
    if len(cells) != len(names):
        raise LogError(f'{say_file(path)}, line {line}: {len(cells)} cells, but the header has '
                       f'{len(names)}')
    return [_number(path, line, name, cell) for name, cell in zip(names, cells, strict=True)]


def _number(path: Path, line: int, name: str, cell: str) -> float:
    """Return a number; text in other columns is none, and does no harm."""
    try:
        return float(cell)
    except ValueError:
        if name.rstrip('0123456789') not in ('t', 'q', 'tau', 'qd', 'vd', 'ff'):
            return np.nan
        raise LogError(f'{say_file(path)}, line {line}: {cell!r} in column {name} must be a '
                       'number') from None
