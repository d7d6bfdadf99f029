"""The line that shows how far a command is."""

from __future__ import annotations

import io
import os
import pty

from flex_planner.base.progress import Progress
from flex_planner.cli.progress_line import Display
import pytest


def test_terminal_shows_one_line_that_is_removed_in_the_end(
        monkeypatch: pytest.MonkeyPatch) -> None:
    leader, follower = pty.openpty()
    shown = ''
    with open(follower, 'w') as stream:
        display = Display(stream)
        monkeypatch.setattr(Display, 'elapsed', 1.0)
        display.begin('some phase')
        monkeypatch.setattr(Display, 'elapsed', 1.2)
        for iteration in (7, 8):  # the second comes too soon to be shown
            display.report(Progress(phase='some phase', iteration=iteration, residual=0.5,
                                    intervals=20, payload=2.5))
        display.close()
        while shown.count('\r\x1b[K') < 3:
            shown += os.read(leader, 4096).decode()
    os.close(leader)
    assert '\n' not in shown
    assert [state.strip() for state in shown.split('\r\x1b[K')] == [
        '', '1.0 s  some phase',
        '1.2 s  some phase, payload 2.5 kg: iteration 7, correction 5.0e-01, 20 inter', '']


def test_file_gets_a_line_per_phase_and_every_few_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    text = io.StringIO()
    display = Display(text)
    for elapsed in range(20):
        monkeypatch.setattr(Display, 'elapsed', float(elapsed))
        display.report(Progress(phase='\x1b[2Jlong', iteration=elapsed, residual=0.5, intervals=9))
        if elapsed > 12:  # no iteration is reported
            display.remind()
    display.close()
    lines = text.getvalue().splitlines()
    assert [float(line.split(' s  ')[0]) for line in lines] == [0, 6, 12, 18]
    assert lines[0] == '    0.0 s  \\x1b[2Jlong'
    assert lines[1].endswith('long: iteration 6, correction 5.0e-01, 9 intervals')


def test_nothing_is_shown_where_there_is_no_stream() -> None:
    display = Display(None)
    display.begin('work')
    display.close()
    assert display.phase == 'work'
