"""The commands that use recordings: play one back, report and check, recover."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import re
import sys

from flex_planner.base.errors import FlexPlannerError, RecordingError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import number
from flex_planner.cli.options import Commands, number_argument, path_argument
from flex_planner.cli.progress_line import run_with_progress
from flex_planner.cli.signals import SIGNALS
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.recording import (
    definition_folder,
    find_recordings,
    ForeignChannel,
    MessageTypes,
    read_metadata,
    recover_recording,
    shown_path,
)
from flex_planner.reports.motion import table
from flex_planner.reports.recording import (
    check_motion,
    MotionCheck,
    RecordedRequest,
    verdict,
    write_report,
)

_MOST_SECONDS, _FOLDER = 3600.0, Path('output')
# of what nodes and commands record of requests
_NAME = re.compile(r'(?!motion_).+_(\d{8}T\d{6}_\d{9})_(\d{4,})')
_NEWEST = ', or a folder of recordings, of which it takes the newest'


def add_commands(commands: Commands) -> None:
    """Add ``flex-planner replay``, ``report`` and ``recover``."""
    _add_replay(commands)
    _add_report(commands)
    _add_recover(commands)


def _add_replay(commands: Commands) -> None:
    parser = _add_command(
        commands, 'replay', _replay, 'publish a recording again (needs ROS 2)',
        'Publish a recording on its topics, at its times and with its quality of service, then '
        'end; Ctrl-C ends it earlier.', _NEWEST)
    parser.add_argument('--rate', type=number_argument, default=1.0, metavar='FACTOR',
                        help='speed of the playback, 2 is twice as fast (default: 1)')
    parser.add_argument('--start', type=number_argument, default=0.0, metavar='S',
                        help='time to leave out at the beginning (default: 0); latched messages '
                        'from before it are sent all the same')
    parser.add_argument('--delay', type=number_argument, default=1.0, metavar='S',
                        help='time before the first message, in which subscribers find the '
                        'publishers (default: 1)')
    parser.add_argument('--loop', action='store_true', help='begin again at the end')


def _add_report(commands: Commands) -> None:
    parser = _add_command(
        commands, 'report', _report,
        'make an HTML page of a recorded plan, and check it',
        'Make one HTML file of a recorded request: task, outcome, certificate, and plots to zoom '
        'into. It needs neither ROS nor a network.', _NEWEST)
    parser.add_argument('--output', type=path_argument, metavar='HTML',
                        help='the file (default: output/<recording>.html)')
    parser.add_argument('--check', action='store_true',
                        help='apply the recorded torques to the recorded arm, compare with the '
                        'recorded plan, and fail where they differ')


def _add_recover(commands: Commands) -> None:
    _add_command(
        commands, 'recover', _recover, 'save the complete part of a recording that broke off',
        'Make a recording of the complete part of one that is damaged, or whose writer was killed '
        '(the hidden folder .<name>.<hex>). The original stays as it is.')


def _add_command(commands: Commands, name: str, run: Callable[[argparse.Namespace], int],
                 summary: str, description: str, newest: str = '') -> argparse.ArgumentParser:
    """Add a command that is about one recording."""
    parser = commands.add_parser(name, help=summary, description=description)
    parser.add_argument('recording', type=path_argument, metavar='RECORDING',
                        help=f'folder of a recording, or its .mcap file{newest}')
    parser.set_defaults(run=run)
    return parser


def _newest(path: Path) -> Path:
    """Return the newest recording of a folder that holds some, else the path itself."""
    if not path.is_dir() or any(path.glob('*.mcap')):
        return path
    found = find_recordings(path, _NAME)
    return found[-1].path if found else path


def _replay(options: argparse.Namespace) -> int:
    """Play a recording back."""
    options.recording = _newest(options.recording)
    rate = number('--rate', options.rate, at_least=1e-3, at_most=1e3)
    longest = read_metadata(options.recording).duration_ns * 1e-9
    start = number('--start', options.start, at_least=0, at_most=longest, unit='s')
    delay = number('--delay', options.delay, at_least=0.01, at_most=60, unit='s')
    if shown_path(options.recording) != str(options.recording):
        raise RecordingError(f'{shown_path(options.recording)} cannot be replayed: its name is '
                             'not UTF-8, which ROS needs: rename it')
    try:
        from flex_planner.ros.replay import replay
        from flex_planner.ros.settings.replay import ReplaySettings
    except ImportError as error:
        print(f'flex-planner: a replay needs ROS 2: {error}', file=sys.stderr)
        return 1
    replay(ReplaySettings(recording=str(options.recording), rate=rate, start=start, delay=delay,
                          loop=options.loop), [])
    return 0


def _report(options: argparse.Namespace) -> int:
    """Make a page of a recording; check its plan if that is wanted."""
    options.recording = _newest(options.recording)
    request = RecordedRequest.read(options.recording)
    name = options.recording.resolve().name.removesuffix('.mcap')
    output = options.output or _FOLDER / f'{name}.html'
    with _contradictions(request):
        check = _check(request) if options.check else None
        if options.output is None:
            _FOLDER.mkdir(exist_ok=True)
        with SIGNALS.patient():
            write_report(output, request, check)
    rows = [(finding.name, str(finding)) for finding in check.findings] if check else []
    print(table([('recording', shown_path(request.path)), ('outcome', verdict(request, check)),
                 *rows, *(('not read', str(channel)) for channel in request.left_out),
                 ('report', shown_path(output)), ('output folder', shown_path(output.parent))]))
    return 0 if check is None or check.passed else 1


@contextmanager
def _contradictions(request: RecordedRequest) -> Iterator[None]:
    """Turn what values raise that do not go together into RecordingError."""
    try:
        yield
    except (FlexPlannerError, StoppedError, OSError):
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise RecordingError(f'{request.path} contradicts itself: {error}') from error


def _check(request: RecordedRequest) -> MotionCheck:
    """Check the motion of a recording."""
    if request.motion is None:
        raise RecordingError(f'{request.path} has no motion to check: '
                             f'{request.report.error_msg or "the request failed"}')

    def work(model: ArmModel, monitor: Monitor) -> MotionCheck:
        return check_motion(request, model, monitor)

    return run_with_progress(request.arm, _MOST_SECONDS, work)


def _recover(options: argparse.Namespace) -> int:
    """Save the complete part of a recording."""
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    left_out: list[ForeignChannel] = []
    path = recover_recording(options.recording, types, left_out.append)
    print(table([('recovered', f'{read_metadata(path).message_count} messages'),
                 *(('left out', str(channel)) for channel in left_out),
                 ('recording', shown_path(path))]))
    return 0
