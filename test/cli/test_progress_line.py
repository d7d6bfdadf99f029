"""The line that shows how far a command is."""

from __future__ import annotations

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
