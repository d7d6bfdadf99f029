"""A table as text, for the page and for the terminal."""

from __future__ import annotations

from dataclasses import dataclass

Cells = tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportTable:
    """
    A table of a report.

    Attributes
    ----------
    title : str
        Its heading.
    columns : tuple of str
        Their names; empty where rows are names and values.
    rows : tuple of tuple of str
        The cells.

    """

    title: str
    columns: Cells = ()
    rows: tuple[Cells, ...]
