"""The evidence on a section of the paper: tables, tested statements and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from flex_planner.plotting.diagrams import Picture


class Verdict(Enum):
    """Verdict on a statement of the paper; the value is shown to people."""

    CONFIRMED = 'confirmed'
    CORRECTED = 'corrected'
    NOT_REPRODUCIBLE = 'not reproducible'


def judge(holds: bool) -> Verdict:
    """Return the verdict on a statement, by whether it holds."""
    return Verdict.CONFIRMED if holds else Verdict.CORRECTED


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """
    A statement of the paper, put to the test.

    Attributes
    ----------
    said : str
        What the paper says, in our words.
    found : str
        The number that it turned into, and the reason for the verdict.
    verdict : Verdict
        By that number.

    """

    said: str
    found: str
    verdict: Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table as text, cell by cell."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Section:
    """
    The evidence on a section of the paper.

    Attributes
    ----------
    key, title : str
        Such as ``5.2`` and ``Minimum effort and speed``.
    text : str
        What was computed, as Markdown.
    tables, claims, pictures : tuple
        Its contents.
    values : dict of str to float
        The numbers behind the text, by name, in SI units.

    """

    key: str
    title: str
    text: str
    tables: Sequence[Table] = ()
    claims: Sequence[Claim] = ()
    pictures: Sequence[Picture] = ()
    values: dict[str, float] = field(default_factory=dict)
