"""A table as text, for the page and for the terminal."""

from __future__ import annotations

from dataclasses import dataclass

Cells = tuple[str, ...]
NOTHING = '–'


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


def numbered_table(title: str, first: str, columns: dict[str, list[str]]) -> ReportTable:
    """Return a table of numbered rows; the first column has the numbers."""
    rows: list[Cells] = [(str(i), *cells) for i, cells in enumerate(
        zip(*columns.values(), strict=True), 1)]
    return ReportTable(title=title, columns=(first, *columns), rows=tuple(rows))


def told_columns(columns: dict[str, list[str]]) -> dict[str, list[str]]:
    """Return the columns in which something is said, the rest of them with dashes."""
    return {name: [cell or NOTHING for cell in cells] for name, cells in columns.items()
            if any(cells)}
