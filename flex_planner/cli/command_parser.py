"""A command line that asks whether a name that it does not know is a misspelt one."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import takewhile
import sys
from typing import Any

from flex_planner.base.suggestions import did_you_mean, one_of
from flex_planner.base.text import printable, shown_value


class _Absent(list[Any]):
    """Stands for what is not given; a list, so that options that are repeated can be added."""


class CommandParser(argparse.ArgumentParser):
    """
    Parser of a command, or of one of its subcommands: those are of the same class.

    What a subcommand's parser returns says in `given` which options there are, also those with the
    value that they have by default.

    """

    def parse_known_args(self, args: Sequence[str] | None = None,  # type: ignore[override]
                         namespace: Any = None) -> tuple[Any, list[str]]:
        """Refuse here what is left over: who called a subcommand's parser has other options."""
        if self._subparsers is None:
            self._refuse_unknown(sys.argv[1:] if args is None else args)
        found, left = super().parse_known_args(args, namespace)
        if left:
            self.error(f'{printable(left[0])} is an argument too many for {self.prog}')
        if self._subparsers is None:
            found.given = self._find_given(args)
        return found, left

    def _find_given(self, args: Sequence[str] | None) -> frozenset[str]:
        """Return the names of the options among arguments that can be parsed."""
        absent = _Absent()
        names = {action.dest for action in self._actions if action.option_strings}
        # what is there already is left alone by argparse, unless it is given
        found, _ = super().parse_known_args(args, argparse.Namespace(
            **dict.fromkeys(names, absent)))
        return frozenset(name for name in names if getattr(found, name) is not absent)

    def _refuse_unknown(self, arguments: Sequence[str]) -> None:
        """Refuse unknown options, before others are missed that they may be meant for."""
        known = list(self._option_string_actions)
        for argument in takewhile(lambda one: one != '--', arguments):
            name = argument.partition('=')[0]
            if name.startswith('--') and not any(one.startswith(name) for one in known):
                self.error(f'{printable(name)} is no option of {self.prog}'
                           f'{did_you_mean(name, known)}')

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Refuse a choice that there is not."""
        if action.choices is not None and value not in action.choices:
            names = list(map(str, action.choices))
            raise argparse.ArgumentError(
                action, f'{shown_value(value)} must be {one_of(value, names)}')
