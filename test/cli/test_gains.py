"""The command that finds gains of feedback."""

from __future__ import annotations

from pathlib import Path

from flex_planner.cli import main
from flex_planner.reports.recording import RecordedRequest
from flex_planner.reports.recording.tables import tables
import numpy as np
import pytest
import yaml

MOTION = ['--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1', '--payload', '1']


def test_gains_are_printed_and_written(capsys: pytest.CaptureFixture[str],
                                       tmp_path: Path) -> None:
    assert main(['gains', 'korayem_ei5', *MOTION, '--output', str(tmp_path)]) == 0
    output = capsys.readouterr().out
    assert 'stable on 7 arms at 1000 Hz' in output and 'N m/rad' in output
    assert 'stiffness -10%, payload +10%, two more modes' in output
    written = yaml.safe_load((tmp_path / 'korayem_ei5_gains.yaml').read_text())
    assert np.shape(written['state']['state_gain']) == (2, 12)
    assert np.shape(written['state']['transition']) == (12, 12)
    assert len(written['joints']['p']) == len(written['joints']['d']) == 2
    assert len(written['coordinates']) == 6
    left = written['tip_motion_after_arrival']
    assert set(left) >= {'state', 'joints'} and {len(values) for values in left.values()} == {7}
    assert f'{1e3 * left["joints"][0]:.3g}' in output
    # and in the report
    recording, = (tmp_path / 'recordings').iterdir()
    request = RecordedRequest.read(recording)
    shown = {table.title: table for table in tables(request)}
    facts = dict(shown['Gains of feedback'].rows)
    assert 'N m/rad' in facts['p of the joints']
    assert facts['observer'] == '12 states from 2 encoders'
    # the observer follows faster than the arm would find back by itself, and without ringing up
    assert float(facts['  its errors die away with'].split()[0]) > 0
    box = next(table for title, table in shown.items() if title.startswith('Motion'))
    assert len(box.rows) == 7 and box.rows[0][0] == 'as modelled'
    assert float(box.rows[0][1]) == float(f'{1e3 * left["joints"][0]:.3g}')


@pytest.mark.parametrize(('options', 'message'), [
    (['--stiffness-error', '2'], '--stiffness-error is 2.0, but must be'),
    (['--encoder-resolution', '0'], '--encoder-resolution is 0.0, but must be')])
def test_wrong_options_are_named(capsys: pytest.CaptureFixture[str], tmp_path: Path,
                                 options: list[str], message: str) -> None:
    assert main(['gains', 'korayem_rigid', *MOTION, *options, '--output', str(tmp_path)]) == 1
    assert message in capsys.readouterr().err
