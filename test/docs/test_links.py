"""Links of all pages lead somewhere, and pages that the site lacks are none of ours."""

from __future__ import annotations

from pathlib import Path
import re

from documents import anchors, DOCS, PAGES, prose, ROOT
import pytest
from site_pages.write import generated_pages

LINK = re.compile(r'\[[^\]]*\]\(([^)\s]+)\)')
# pages that are made when the site is built, see docs/site_pages
GENERATED = {f'generated/{name}' for name in generated_pages(ROOT)}
# pages of the host of the repository
HOST = '../../actions/'


def broken(page: Path, target: str) -> bool:
    """Return whether a link of a page leads nowhere."""
    name, _, anchor = target.partition('#')
    path = (page.parent / name).resolve() if name else page
    if path.is_relative_to(DOCS) and str(path.relative_to(DOCS)) in GENERATED:
        return bool(anchor)
    if not path.exists():
        return True
    return bool(anchor) and anchor not in anchors(path)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    targets = [target for target in LINK.findall(prose(page))
               if '://' not in target and not target.startswith(HOST)]
    assert [target for target in targets if broken(page, target)] == []


def test_link_that_leads_nowhere_is_seen() -> None:
    assert broken(DOCS / 'solver.md', 'nowhere.md')
    assert broken(DOCS / 'solver.md', 'kinds.md#nowhere')
    assert broken(DOCS / 'solver.md', '#nowhere')
    assert not broken(DOCS / 'solver.md', '#warnings')


def test_every_picture_is_shown() -> None:
    shown = {(page.parent / target).resolve() for page in PAGES
             for target in LINK.findall(prose(page))}
    assert {path for path in DOCS.glob('images/**/*.*') if path not in shown} == set()


def test_every_page_is_in_the_table_of_contents() -> None:
    index = (DOCS / 'index.md').read_text(encoding='utf-8')
    listed = set(re.findall(r'^([\w/]+)$', index, re.MULTILINE))
    pages = {str(path.relative_to(DOCS).with_suffix('')) for path in PAGES
             if path.is_relative_to(DOCS)}
    assert listed == (pages - {'index'}) | {name.rpartition('.')[0] for name in GENERATED}


def test_every_page_is_linked_from_the_readme() -> None:
    readme = (ROOT / 'README.md').read_text(encoding='utf-8')
    pages = {f'docs/{path.relative_to(DOCS)}' for path in PAGES if path.is_relative_to(DOCS)}
    linked = {target.partition('#')[0] for target in LINK.findall(readme)}
    assert pages - linked == {'docs/index.md'}
