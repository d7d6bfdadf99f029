"""Processes that are started by others."""

from __future__ import annotations

import signal
import subprocess
import sys

from flex_planner.base.processes import deaf_to_interrupts


def test_interrupt_never_reaches_a_process_that_begins() -> None:
    with deaf_to_interrupts():
        child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'],
                                 stderr=subprocess.PIPE)
    child.send_signal(signal.SIGINT)
    child.terminate()
    assert child.communicate(timeout=60) == (None, b'')
    assert child.returncode == -signal.SIGTERM
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
