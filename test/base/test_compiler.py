"""The compiler: it ends with the work that wanted it."""

from __future__ import annotations

import os
from pathlib import Path
import time

from flex_planner.base.compiler import compile_library, CompilerError, find_compiler
from flex_planner.base.progress import Monitor, StoppedError
import pytest

# starts a process of its own as compilers do, and never ends
SLOW = """\
#!/bin/sh
sleep 600 &
echo $! > "$0.part"
mv "$0.part" "$0.process"
wait
"""


def is_alive(process: int) -> bool:
    """Return whether a process runs; one that has ended may wait to be buried."""
    try:
        return Path(f'/proc/{process}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


def test_a_monitor_ends_the_compiler_and_its_parts(tmp_path: Path) -> None:
    compiler, started = tmp_path / 'slow', tmp_path / 'slow.process'
    compiler.write_text(SLOW)
    compiler.chmod(0o700)
    with pytest.raises(StoppedError):
        compile_library([str(compiler)], '', tmp_path, monitor=Monitor(canceled=started.exists))
    process = int(started.read_text())
    while is_alive(process):  # the signal is on its way; pytest ends a test that hangs
        time.sleep(0.01)


def test_what_a_compiler_says_is_told(tmp_path: Path) -> None:
    with pytest.raises(CompilerError, match='error'):
        compile_library(find_compiler(), 'int f(', tmp_path, monitor=Monitor())
    assert os.listdir(tmp_path) == ['functions.c']
