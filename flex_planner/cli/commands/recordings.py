"""The commands that use recordings: play one back, report and check, recover."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
import sys

from flex_planner.base.errors import RecordingError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import number
from flex_planner.cli.options import Commands
from flex_planner.cli.progress_line import run_with_progress
from flex_planner.cli.signals import SIGNALS
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.recording import (
    definition_folder,
    MessageTypes,
    read_metadata,
    recover_recording,
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


def add_commands(commands: Commands) -> None:
    """Add ``flex-planner replay``, ``report`` and ``recover``."""
    _add_replay(commands)
    _add_report(commands)
    _add_recover(commands)


def _add_replay(commands: Commands) -> None:
    parser = _add_command(
        commands, 'replay', _replay, 'publish a recording again (needs ROS 2)',
        'Publish a recording on its topics, at its times and with its quality of service, then '
        'end; Ctrl-C ends it earlier.')
    parser.add_argument('--rate', type=float, default=1.0, metavar='FACTOR',
                        help='speed of the playback, 2 is twice as fast (default: 1)')
    parser.add_argument('--start', type=float, default=0.0, metavar='S',
                        help='time to leave out at the beginning (default: 0); latched messages '
                        'from before it are sent all the same')
    parser.add_argument('--delay', type=float, default=1.0, metavar='S',
                        help='time before the first message, in which subscribers find the '
                        'publishers (default: 1)')
    parser.add_argument('--loop', action='store_true', help='begin again at the end')


def _add_report(commands: Commands) -> None:
    parser = _add_command(
        commands, 'report', _report,
        'make an HTML page of a recorded plan, check it against the model',
        'Make one HTML file of a recorded request: task, outcome, certificate, and plots to zoom '
        'into. It needs neither ROS nor a network.')
    parser.add_argument('--output', type=Path, metavar='HTML',
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
                 summary: str, description: str) -> argparse.ArgumentParser:
    """Add a command that is about one recording."""
    parser = commands.add_parser(name, help=summary, description=description)
    parser.add_argument('recording', type=Path, metavar='RECORDING',
                        help='folder of a recording, or its .mcap file')
    parser.set_defaults(run=run)
    return parser


def _replay(options: argparse.Namespace) -> int:
    """Play a recording back."""
    rate = number('--rate', options.rate, at_least=1e-3, at_most=1e3)
    longest = read_metadata(options.recording).duration_ns * 1e-9
    start = number('--start', options.start, at_least=0, at_most=longest, unit='s')
    delay = number('--delay', options.delay, at_least=0.01, at_most=60, unit='s')
    try:
        from flex_planner.ros.replay import replay, ReplaySettings
    except ImportError as error:
        print(f'flex-planner: a replay needs ROS 2: {error}', file=sys.stderr)
        return 1
    replay(ReplaySettings(recording=str(options.recording), rate=rate, start=start, delay=delay,
                          loop=options.loop), [])
    return 0


def _report(options: argparse.Namespace) -> int:
    """Make a page of a recording; check its plan if that is wanted."""
    request = RecordedRequest.read(options.recording)
    check = _check(request) if options.check else None
    name = options.recording.resolve().name.removesuffix('.mcap')
    if options.output is None:
        _FOLDER.mkdir(exist_ok=True)
    output = options.output or _FOLDER / f'{name}.html'
    with SIGNALS.patient():
        write_report(output, request, check)
    rows = [(finding.name, str(finding)) for finding in check.findings] if check else []
    print(table([('recording', str(request.path)), ('outcome', verdict(request, check)), *rows,
                 ('report', str(output)), ('output folder', str(output.parent))]))
    return 0 if check is None or check.passed else 1


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
    path = recover_recording(options.recording, types)
    print(table([('recovered', f'{read_metadata(path).message_count} messages'),
                 ('recording', str(path))]))
    return 0
