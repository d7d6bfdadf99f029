"""The report as a Markdown page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from flex_planner.paper.evidence import Claim, Section, Table, Verdict

_HEAD = """# The paper, reproduced

Every simulation of Korayem et al. 2009 (*Trajectory optimization of flexible link manipulators in
point-to-point motion*, Robotica), computed again with flex_planner. Sections 5.1 to 5.5 and their
figures are the paper's; figs. 1 to 3 and 15 are drawings and flow charts and have no counterpart.
Sections 6.1 to 7 are ours. Numbers that the paper prints stand beside ours. The independent check
is IPOPT, which transcribes and optimises the same dynamics by other means; the dynamics themselves
are checked by a second derivation and by finite elements in the tests. What is solved is explained
in [theory.md](theory.md); more on maximum payloads is in [payload.md](payload.md).

A statement is *confirmed* if it holds for our motions, by the number given, and printed values are
met to the accuracy to which the paper searches or prints them. It is *corrected* if the number
says otherwise, and *not reproducible* if what is printed does not suffice to decide.

This page is written by `make paper` (`flex-planner paper`): do not edit it.
"""


def document(sections: Sequence[Section], pictures: str, remark: str) -> str:
    """
    Return the page.

    Parameters
    ----------
    sections : sequence of Section
        In their order.
    pictures : str
        Folder of the pictures as seen from the page.
    remark : str
        How it was made, for its end.

    """
    parts = [_HEAD, _overview(sections)]
    parts += [_section(section, pictures) for section in sections]
    return '\n'.join([*parts, remark, ''])


def summary(sections: Sequence[Section]) -> str:
    """Return the number of statements with each verdict."""
    counts = Counter(claim.verdict for section in sections for claim in section.claims)
    total = ', '.join(f'{counts[verdict]} {verdict.value}' for verdict in Verdict)
    return f'Of {sum(counts.values())} statements put to the test: {total}.'


def _overview(sections: Sequence[Section]) -> str:
    """Return all statements with their verdicts."""
    rows = tuple((section.key, claim.said, claim.verdict.value)
                 for section in sections for claim in section.claims)
    return f'\n## In short\n\n{summary(sections)}\n\n' + _grid(
        ('section', 'statement', ''), rows)


def _section(section: Section, pictures: str) -> str:
    lines = [f'\n## {section.key} {section.title}\n', section.text, '']
    lines += [_table(table) for table in section.tables]
    if section.claims:
        lines.append(_claims(section.claims))
    lines += [f'![{picture.caption}]({pictures}/{picture.name}.png)\n\n{picture.caption}.\n'
              for picture in section.pictures]
    return '\n'.join(lines)


def _table(table: Table) -> str:
    return f'**{table.title}**\n\n{_grid(table.header, table.rows)}'


def _claims(claims: Sequence[Claim]) -> str:
    rows = tuple((claim.said, claim.found, f'**{claim.verdict.value}**') for claim in claims)
    return _grid(('the paper says', 'we find', ''), rows)


def _grid(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    lines = [header, ('---',) * len(header), *rows]
    return ''.join(f'| {" | ".join(_cell(cell) for cell in line)} |\n' for line in lines)


def _cell(text: str) -> str:
    return text.replace('|', '\\|')
