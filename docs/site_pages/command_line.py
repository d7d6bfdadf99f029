"""The page of the command line, from the parser that reads it."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import textwrap

from flex_planner.cli.parser import build_parser

from site_pages.markdown import code, definition, escape

_HEAD = """\
# The command line

Made from the program itself; `flex-planner COMMAND --help` prints the same. In a checkout, write
`tools/run` in front. Streams, signals and exit codes are told in [terminal.md](../terminal.md).
"""
_WIDTH = 90


def command_line_page() -> str:
    """Return the page."""
    lines = [_HEAD]
    for name, summary, parser in commands():
        lines += [f'## flex-planner {name}', '', escape(parser.description or summary), '',
                  '```text', usage(parser), '```', '']
        for action in _shown(parser):
            lines += _option_lines(parser, action)
    return '\n'.join(lines)


def commands() -> Iterator[tuple[str, str, argparse.ArgumentParser]]:
    """Return name, summary and parser of every command."""
    for action in build_parser()._actions:
        if isinstance(action, argparse._SubParsersAction):
            summaries = {entry.dest: entry.help or '' for entry in action._choices_actions}
            for name, parser in action.choices.items():
                yield name, summaries[name], parser


def usage(parser: argparse.ArgumentParser) -> str:
    """Return one line of usage, broken where it is too long."""
    parts = [_spelling(action) for action in _shown(parser) if action.option_strings]
    names = [_value(action) for action in _shown(parser) if not action.option_strings]
    text = ' '.join([parser.prog, *names, *(f'[{part}]' for part in parts)])
    kept = text.replace('] [', ']\0[').replace(' ', '\u00a0').replace('\0', ' ')
    lines = textwrap.wrap(kept, _WIDTH, subsequent_indent='    ', break_long_words=False,
                          break_on_hyphens=False)
    return '\n'.join(lines).replace('\u00a0', ' ')


def _shown(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """Return the options but for --help, which every command has."""
    return [action for action in parser._actions if action.dest != 'help'
            and action.help != argparse.SUPPRESS]


def _option_lines(parser: argparse.ArgumentParser, action: argparse.Action) -> list[str]:
    """Return the entry of an option in a definition list."""
    said = (action.help or '') % {**vars(action), 'prog': parser.prog}
    required = ['*required*'] if action.option_strings and action.required else []
    return definition(code(_spelling(action)), [escape(said), *required])


def _spelling(action: argparse.Action) -> str:
    """Return an option with its value."""
    names = ', '.join(action.option_strings)
    return f'{names} {_value(action)}'.strip() if names else _value(action)


def _value(action: argparse.Action) -> str:
    """Return the placeholder of a value; empty for a flag."""
    if action.nargs == 0:
        return ''
    if action.metavar is None and action.choices:
        shown = '{' + ','.join(map(str, action.choices)) + '}'
    else:
        shown = str(action.metavar or action.dest.upper())
    return f'[{shown}]' if action.nargs == '?' else shown
