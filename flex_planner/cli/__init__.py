"""Console script ``flex-planner``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import sys

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import StoppedError, StopReason
from flex_planner.base.sentences import say_os_error
from flex_planner.base.version import VERSION
from flex_planner.cli.commands import arm, cache, compare, paper, plan, recordings
from flex_planner.cli.commands import map as maps
from flex_planner.cli.options import join_lists
from flex_planner.cli.progress_line import CanceledError

_CANCELED = 130  # what a shell makes of a process that SIGINT ended


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run the console script.

    Returns
    -------
    int
        Exit code: 0; 1 after a message on standard error; 130 if Ctrl-C was pressed.

    """
    given = sys.argv[1:] if arguments is None else arguments
    options = _parser().parse_args(join_lists(given))
    try:
        return int(options.run(options))
    except FlexPlannerError as error:
        print(f'flex-planner: {error}', file=sys.stderr)
        return 1
    except OSError as error:
        print(f'flex-planner: {say_os_error(error)}', file=sys.stderr)
        return 1
    except StoppedError as error:
        print(f'flex-planner: {error}', file=sys.stderr)
        return _CANCELED if error.reason is StopReason.CANCELED else 1
    except (CanceledError, KeyboardInterrupt) as error:
        print(f'flex-planner: {str(error) or "canceled"}', file=sys.stderr)
        return _CANCELED


def _parser() -> argparse.ArgumentParser:
    """Return the description of the command line."""
    parser = argparse.ArgumentParser(
        prog='flex-planner', description='Motion planning for flexible-link manipulators.')
    parser.add_argument('--version', action='version', version=VERSION)
    commands = parser.add_subparsers(required=True, metavar='COMMAND')
    arm.add_command(commands)
    plan.add_commands(commands)
    compare.add_command(commands)
    maps.add_command(commands)
    paper.add_command(commands)
    cache.add_command(commands)
    recordings.add_commands(commands)
    return parser
