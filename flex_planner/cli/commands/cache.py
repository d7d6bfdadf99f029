"""The command that shows and clears the compiled functions."""

from __future__ import annotations

import argparse

from flex_planner.base.library_cache import (
    cache_folder,
    clear_cache,
    find_entries,
    largest_size,
    SIZE_VARIABLE,
)
from flex_planner.cli.options import Commands
from flex_planner.reports.motion import table

_MB = 1e6


def add_command(commands: Commands) -> None:
    """Add ``flex-planner cache``."""
    parser = commands.add_parser(
        'cache', help='show or clear the compiled functions of arms',
        description='The equations of an arm are compiled when it is first used, and kept in a '
        'folder. It may be cleared at any time; what is needed again is compiled again.')
    parser.add_argument('--clear', action='store_true', help='remove all of them')
    parser.set_defaults(run=_cache)


def _cache(options: argparse.Namespace) -> int:
    """Print what is kept; remove it if that is wanted."""
    folder = cache_folder()
    if options.clear:
        count, size = clear_cache()
        print(table([('folder', str(folder)),
                     ('removed', f'{count} entries, {size / _MB:.1f} MB')]))
        return 0
    entries = list(find_entries(folder))
    size = sum(entry.size for entry in entries)
    print(table([('folder', str(folder)), ('entries', str(len(entries))),
                 ('size', f'{size / _MB:.1f} MB, at most {largest_size() / _MB:g} MB '
                          f'({SIZE_VARIABLE})')]))
    return 0
