"""Pictures of results: a picture that cannot be drawn is a warning, for the results are there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
import sys

from flex_planner.base.text import printable
from flex_planner.cli.signals import SIGNALS
from flex_planner.reports.motion import Row, table


def drawn(name: str, path: Path, draw: Callable[[Path], object]) -> Iterator[Row]:
    """
    Draw a picture.

    Parameters
    ----------
    name : str
        What it is a picture of.
    path : Path
        Where to.
    draw : callable
        Writes it to a path; may raise anything, also while it loads Matplotlib.

    Yields
    ------
    pair of str
        Name and path; nothing where it fails, which is said on standard error.

    """
    try:
        with SIGNALS.hasty():
            draw(path)
    except Exception as error:
        SIGNALS.check()  # libraries make other exceptions of an interruption
        reason = ' '.join(str(error).split()) or type(error).__name__
        print(f'flex-planner: warning: no {name}: {printable(reason)}',
              file=sys.stderr)
    else:
        yield name, str(path)


def print_files(files: Iterator[Row]) -> int:
    """
    Have files written, print the name of each as it is written, and return their number.

    A recording that is being written when Ctrl-C is pressed is finished, a picture is left out.

    """
    count = 0
    with SIGNALS.patient():
        for row in files:
            count += 1
            print(table([row]), flush=True)
            SIGNALS.check()
    return count
