"""All sections, computed by several processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed, ProcessPoolExecutor
from contextlib import contextmanager
import multiprocessing
import os
from pathlib import Path
from typing import Protocol

from flex_planner.paper import (
    beyond,
    effort_speed,
    hanging,
    max_payload,
    minimum_effort,
    minimum_vibration,
    slips,
)
from flex_planner.paper.evidence import Section


class Study(Protocol):
    """Computes a section; `reduced` leaves out what takes long."""

    def __call__(self, *, reduced: bool = False) -> Section:
        """Return the section."""


# in the order of the page
STUDIES: dict[str, Study] = {
    '5.1': hanging.study, '5.2': effort_speed.study, '5.3': max_payload.study,
    '5.4': minimum_effort.study, '5.5': minimum_vibration.study, '6.1': beyond.front,
    '6.2': beyond.clamped, '6.3': beyond.feedforward, '6.4': beyond.modes, '7': slips.study}
# begun first, as they take longest
_LONGEST = ('6.2', '6.1', '6.4')
Report = Callable[[str, int, int], None]


def computed(keys: Sequence[str], *, reduced: bool, processes: int, report: Report,
             pictures: Path | None = None) -> dict[str, Section]:
    """
    Return sections by their key, in the order of `STUDIES`.

    Parameters
    ----------
    keys : sequence of str
        Which.
    reduced : bool
        Whether to leave out what takes long.
    processes : int
        How many at a time.
    report : callable
        Told of every section that is done: its key, how many are, of how many.
    pictures : Path, optional
        Folder for the pictures; nothing is drawn without.

    Raises
    ------
    NoPlanError
        If a motion could not be planned.
    OSError
        If a picture cannot be written.

    """
    found: dict[str, Section] = {}
    for key, section in _finished(keys, reduced, processes, pictures):
        found[key] = section
        report(key, len(found), len(keys))
    return {key: found[key] for key in STUDIES if key in found}


def _finished(keys: Sequence[str], reduced: bool, processes: int,
              pictures: Path | None) -> Iterator[tuple[str, Section]]:
    """Yield sections as they are done."""
    order = sorted(keys, key=lambda key: key not in _LONGEST)
    context = multiprocessing.get_context('spawn')
    with _one_thread_each(), ProcessPoolExecutor(processes, context) as pool:
        try:
            jobs = {pool.submit(_one, key, reduced, pictures): key for key in order}
            for job in as_completed(jobs):
                yield jobs[job], job.result()
        except BaseException:
            # who waits for Ctrl-C does not wait for what is being computed
            for process in multiprocessing.active_children():
                process.terminate()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Keep new processes to one processor: they would only get into each other's way."""
    names = ('OPENBLAS_NUM_THREADS', 'OMP_NUM_THREADS')
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, '1'))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _one(key: str, reduced: bool, pictures: Path | None) -> Section:
    section = STUDIES[key](reduced=reduced)
    if pictures is not None:
        from flex_planner.plotting.panels import draw_picture

        for picture in section.pictures:
            draw_picture(pictures, picture)
    return section
