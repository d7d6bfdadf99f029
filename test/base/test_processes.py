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


LEAKING = """
from multiprocessing import get_context
import os
from flex_planner.base.processes import deaf_to_interrupts
with deaf_to_interrupts(pool=True):
    left = get_context('spawn').Semaphore()
os._exit(0)
"""


def test_nobody_is_told_what_processes_that_were_ended_by_force_have_left() -> None:
    done = subprocess.run([sys.executable, '-c', LEAKING], capture_output=True, text=True,
                          timeout=60)  # its tracker holds standard error open until it is done
    assert (done.returncode, done.stderr) == (0, '')
