"""The description of the command line."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from flex_planner.base.version import VERSION
from flex_planner.cli.command_parser import CommandParser
from flex_planner.cli.commands import (
    arm,
    cache,
    compare,
    excite,
    gains,
    identify,
    paper,
    plan,
    recordings,
    robustness,
)
from flex_planner.cli.commands import map as maps
from flex_planner.cli.options import join_lists


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command line; SystemExit after a message where it is wrong."""
    return build_parser().parse_args(join_lists(arguments))


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = CommandParser(
        prog='flex-planner', description='Motion planning for flexible-link manipulators.')
    parser.add_argument('--version', action='version', version=VERSION)
    commands = parser.add_subparsers(required=True, metavar='COMMAND')
    arm.add_command(commands)
    plan.add_commands(commands)
    compare.add_command(commands)
    robustness.add_command(commands)
    gains.add_command(commands)
    identify.add_command(commands)
    excite.add_command(commands)
    maps.add_command(commands)
    paper.add_command(commands)
    cache.add_command(commands)
    recordings.add_commands(commands)
    return parser
