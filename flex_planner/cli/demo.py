"""Run the demonstration: ``python -m flex_planner.cli.demo``."""

from __future__ import annotations

import os
from pathlib import Path
import sys

from flex_planner.cli import run_command
from flex_planner.cli.signals import SIGNALS


def main() -> int:
    """Run the demonstration from the command line; return the exit code, as `cli.main`."""
    return run_command(_demonstrate)


def _demonstrate() -> int:
    with SIGNALS.starting():
        from flex_planner.cli.command_parser import CommandParser
        from flex_planner.cli.demo_motions import DEFAULT_ARM, demo_motion
        from flex_planner.cli.options import path_argument

    parser = CommandParser(
        description='Plan a motion over ROS 2, and let a simulated arm carry it out.')
    parser.add_argument('--output', type=path_argument, default=Path('output'), metavar='DIR',
                        help='folder for all that is written (default: %(default)s)')
    parser.add_argument('--arm', default=DEFAULT_ARM, metavar='ARM',
                        help='a preset with a motion to show (default: %(default)s)')
    options = parser.parse_args()
    demo_motion(options.arm)  # refuses others before anything is started
    folder = options.output.resolve()
    os.environ.setdefault('ROS_LOG_DIR', str(folder / 'log'))
    from flex_planner.cli.demonstration import demonstrate

    demonstrate(folder, options.arm)
    return 0


if __name__ == '__main__':
    sys.exit(main())
