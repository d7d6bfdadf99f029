"""Pictures and recordings of a command's results."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
import os
from pathlib import Path
import sys
import tempfile
from typing import TYPE_CHECKING

from flex_planner.base.errors import FlexPlannerError, InvalidValueError, RecordingError
from flex_planner.base.paths import file_stem
from flex_planner.capacity.results import MaxPayload
from flex_planner.cli.options import add_folder
from flex_planner.cli.pictures import drawn
from flex_planner.cli.request import Request
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import SampledPlan
from flex_planner.reports.motion import Row

if TYPE_CHECKING:
    from flex_planner.cli.recorder import RequestRecorder


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """
    Writes pictures and recordings.

    Attributes
    ----------
    folder : Path
        Where to.
    stem : str
        What the names of pictures begin with.
    draws : bool
        Whether there are pictures.
    recorder : RequestRecorder or None
        None where nothing is recorded.

    """

    folder: Path
    stem: str
    draws: bool
    recorder: RequestRecorder | None

    @classmethod
    def of(cls, options: argparse.Namespace, request: Request) -> Outputs:
        """
        Return the outputs that a command line with the options of `add_outputs` wants.

        Raises
        ------
        InvalidValueError
            If the folder cannot be written.

        """
        draws, records = not options.no_plot, not options.no_recording
        if draws or records:
            check_folder(options.output)
        return cls(folder=options.output, stem=file_stem(options.arm), draws=draws,
                   recorder=_recorder(request, options.output) if records else None)

    def write_plan(self, plan: Plan, reference: SampledPlan | None) -> Iterator[Row]:
        """Write recording and picture of a plan; yield names and paths as they are written."""
        recorder = self.recorder
        yield from self._write(
            (lambda: recorder.record_plan(plan, reference)) if recorder else None,
            self._draw_motion(plan, 'motion') if plan.solved else iter(()))

    def write_search(self, found: MaxPayload, accuracy: float, step: float,
                     reference: SampledPlan | None) -> Iterator[Row]:
        """Write recording and pictures of a search, see `write_plan`."""
        recorder = self.recorder
        yield from self._write(
            (lambda: recorder.record_search(found, accuracy, step, reference)) if recorder
            else None, self._draw_search(found))

    def _write(self, record: Callable[[], Path] | None, pictures: Iterator[Row]) -> Iterator[Row]:
        """Record, then draw; a recording that fails is told when the pictures are drawn."""
        failure: Exception | None = None
        if record is not None:
            try:
                yield 'recording', str(record())
            except (FlexPlannerError, OSError) as error:
                failure = error
        if self.draws:
            yield from pictures
        if self.draws or record is not None:
            yield 'output folder', str(self.folder)
        if failure is not None:
            raise failure

    def _draw_search(self, found: MaxPayload) -> Iterator[Row]:
        """Draw a search and the motion with the largest payload."""
        solved = found.plan if found.plan is not None and found.plan.solved else None

        def draw(path: Path) -> None:
            from flex_planner.plotting import draw_max_payload, save

            save(draw_max_payload(found), path)

        if solved or found.front.payloads.size or found.trials:
            yield from drawn('picture of the search', self.folder / f'{self.stem}_max_payload.png',
                             draw)
        if solved:
            yield from self._draw_motion(solved, 'max_payload_motion')

    def _draw_motion(self, plan: Plan, name: str) -> Iterator[Row]:
        """Draw the motion of a plan."""
        def draw(path: Path) -> None:
            from flex_planner.plotting import draw_motion, save

            save(draw_motion(plan), path)

        yield from drawn('picture of the motion', self.folder / f'{self.stem}_{name}.png', draw)


def add_outputs(parser: argparse.ArgumentParser) -> None:
    """Add the options for what is written."""
    add_folder(parser)
    parser.add_argument('--no-plot', action='store_true', help='draw no pictures')
    parser.add_argument('--no-recording', action='store_true', help='write no recording')


def check_folder(folder: Path) -> None:
    """Raise InvalidValueError unless files can be made in a folder, or the folder itself."""
    there = folder.absolute()
    while not os.path.lexists(there):
        there = there.parent
    try:
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise InvalidValueError('--output', str(folder), 'a folder that can be written '
                                f'({there}: {error.strerror})') from None


def _recorder(request: Request, folder: Path) -> RequestRecorder | None:
    """Return the recorder; None, with a message, without definitions of messages."""
    try:
        from flex_planner.cli.recorder import RequestRecorder

        return RequestRecorder(request, folder / 'recordings')
    except RecordingError as error:
        print(f'flex-planner: no recording is written: {error}', file=sys.stderr)
        return None
