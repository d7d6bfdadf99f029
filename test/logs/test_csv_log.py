"""Tables are read as logs, and what is wrong with one is said by line and column."""

from __future__ import annotations

from pathlib import Path

from flex_planner.identification.experiments import LogError
from flex_planner.logs.csv_log import read_csv_log
import numpy as np
import pytest

TIMES = np.arange(60) * 1e-2


def write(path: Path, columns: dict[str, np.ndarray]) -> Path:
    """Write a table."""
    lines = [','.join(columns), *(','.join(map(repr, map(float, row)))
                                  for row in zip(*columns.values(), strict=True))]
    path.write_text('\n'.join(lines))
    return path


def test_columns_are_found_by_their_names(tmp_path: Path) -> None:
    path = write(tmp_path / 'log.csv', {
        'tau1': 3 * TIMES, 'note': np.zeros(60), 'q1': TIMES**2, 't': 5 + TIMES})
    log = read_csv_log(path, 1)
    assert log.angles[:, 0] == pytest.approx(TIMES**2)
    assert log.torques[:, 0] == pytest.approx(3 * TIMES)
    assert log.times[0] == 5 and log.reference is None and log.name == 'log.csv'


def test_reference_begins_with_the_table(tmp_path: Path) -> None:
    path = write(tmp_path / 'log.csv', {
        't': 5 + TIMES, 'q1': TIMES, 'qd1': TIMES**2, 'ff1': TIMES})
    log = read_csv_log(path, 1)
    assert log.reference is not None and log.reference_start == 5 and not log.has_torques
    position, speed = log.reference.motion(0.3)
    assert (position[0], speed[0]) == pytest.approx((0.09, 0.6), abs=1e-3)
    assert log.reference.torque(0.3)[0] == pytest.approx(0.3)


@pytest.mark.parametrize(('text', 'message'), [
    ('t,q1\n0,1\n', 'no column q2'),
    ('x,q1,q2\n0,1,2\n', 'no column t'),
    ('t,q1,q2\n0,1\n', 'line 2: 2 cells'),
    ('t,q1,q2\n0,1,2\n0.1,1,two\n', "line 3: 'two' in column q2"),
    ('t,q1,q1\n0,1,2\n', 'two columns of one name'),
    ('', 'no column t')])
def test_mistakes_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / 'log.csv'
    path.write_text(text)
    with pytest.raises(LogError, match=message):
        read_csv_log(path, 2)
