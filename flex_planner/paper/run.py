"""All sections, computed by several processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
import logging
import multiprocessing
from pathlib import Path
import time
from typing import Protocol

from flex_planner.base.processes import deaf_to_interrupts, one_thread_each
from flex_planner.base.progress import StoppedError, StopReason
from flex_planner.paper.evidence import Section
from flex_planner.paper.sections import (
    beyond,
    effort_speed,
    hanging,
    max_payload,
    minimum_effort,
    minimum_vibration,
    slips,
)


class SectionStudy(Protocol):
    """Computes a section; `reduced` leaves out what takes long."""

    def __call__(self, *, reduced: bool = False) -> Section:
        """Return the section."""


# in the order of the page
STUDIES: dict[str, SectionStudy] = {
    '5.1': hanging.study, '5.2': effort_speed.study, '5.3': max_payload.study,
    '5.4': minimum_effort.study, '5.5': minimum_vibration.study, '6.1': beyond.front,
    '6.2': beyond.clamped_links, '6.3': beyond.feedforward, '6.4': beyond.modes, '7': slips.study}
# begun first, as they take longest
_LONGEST = ('6.2', '6.1', '6.4')
_OFTEN, _PATIENCE = 0.1, 2.0  # [s], between two looks at Ctrl-C; until a process is killed
Report = Callable[[str, int, int], None]
_LOG = logging.getLogger(__name__)


def compute_sections(keys: Sequence[str], *, reduced: bool, processes: int, report: Report,
                     pictures: Path | None = None,
                     canceled: Callable[[], bool] = lambda: False) -> dict[str, Section]:
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
        Receives the key of each finished section, the number of finished ones, and of all.
    pictures : Path, optional
        Folder for the pictures; nothing is drawn without.
    canceled : callable
        Returns True once the work should stop, which it does at once.

    Raises
    ------
    NoPlanError
        If a motion could not be planned.
    StoppedError
        If it was canceled.
    OSError
        If a picture cannot be written.

    """
    found: dict[str, Section] = {}
    for key, section in _compute_each(keys, reduced, processes, pictures, canceled):
        found[key] = section
        report(key, len(found), len(keys))
    return {key: found[key] for key in STUDIES if key in found}


def _compute_each(keys: Sequence[str], reduced: bool, processes: int, pictures: Path | None,
                  canceled: Callable[[], bool]) -> Iterator[tuple[str, Section]]:
    """Yield sections as they are done."""
    order = sorted(keys, key=lambda key: key not in _LONGEST)
    context = multiprocessing.get_context('spawn')
    pool = ProcessPoolExecutor(processes, context)
    with one_thread_each(), pool:
        with deaf_to_interrupts(pool=True):
            jobs = {pool.submit(_compute_section, key, reduced, pictures): key for key in order}
        try:
            left: set[Future[Section]] = set(jobs)
            while left:
                done, left = wait(left, _OFTEN, FIRST_COMPLETED)
                for job in done:
                    yield jobs[job], job.result()
                if canceled():
                    raise StoppedError(StopReason.CANCELED)
        except BaseException:
            _end_children()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _end_children() -> None:
    """End what is being computed, without waiting for its result."""
    children = multiprocessing.active_children()
    for process in children:
        process.terminate()
    until = time.monotonic() + _PATIENCE
    for process in children:
        process.join(max(0.0, until - time.monotonic()))
        process.kill()


def _compute_section(key: str, reduced: bool, pictures: Path | None) -> Section:
    section = STUDIES[key](reduced=reduced)
    if pictures is not None:
        try:
            from flex_planner.plotting.figures import save
            from flex_planner.plotting.panels import draw_picture

            for picture in section.pictures:
                save(draw_picture(picture), pictures / f'{picture.name}.png')
        except Exception as error:  # the numbers are there
            _LOG.warning('section %s has no pictures: %s', key, error)
    return section
