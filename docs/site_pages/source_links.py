"""Links of pages to files outside of the documentation."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
import posixpath
import re
import xml.etree.ElementTree as ElementTree

import flex_planner

_LINK = re.compile(r'(?<!!)\[(?P<text>[^\]]*)\]\((?P<target>\.\./[^)\s]*)\)')
# a page that is named by its file, as it is read in a checkout
_NAMED = re.compile(r'\[(?P<name>[\w-]+\.md)\](?=\([^)\s]*(?P=name)[)#])')


def repository_root(documentation: Path) -> Path:
    """
    Return the folder of package.xml.

    It is the parent of the documentation, unless that is a copy: rosdoc2 makes one. Then it is
    where the package is imported from.

    """
    for folder in (documentation.parent, Path(flex_planner.__file__).resolve().parents[1]):
        if (folder / 'package.xml').is_file():
            return folder
    raise FileNotFoundError(f'there is no package.xml beside {documentation}')


def repository_address(root: Path) -> str:
    """Return the address of the repository by package.xml; empty where it has none."""
    for address in ElementTree.parse(root / 'package.xml').iterfind('url'):
        if address.get('type') == 'repository':
            return (address.text or '').strip().rstrip('/')
    return ''


def maintainer(root: Path) -> str:
    """Return who maintains the project, by package.xml."""
    return ElementTree.parse(root / 'package.xml').findtext('maintainer', '')


def link_sources(text: str, page: str, address: str) -> str:
    """
    Return a page whose links out of the documentation lead to the repository.

    Parameters
    ----------
    text : str
        Markdown.
    page : str
        Path of the page in the documentation, such as ``tutorials/own_arm``.
    address : str
        Of the repository; where it is empty only the text of such links is left.

    """
    folder = PurePosixPath(page).parent

    def changed(match: re.Match[str]) -> str:
        path = posixpath.normpath(str(folder / match['target']))
        if not path.startswith('../'):
            return match[0]
        place = path.removeprefix('../')
        return f'[{match["text"]}]({address}/blob/main/{place})' if address else match['text']

    return _LINK.sub(changed, text)


def title_links(text: str) -> str:
    """Return a page whose links show titles, which Sphinx fills in, for the names of files."""
    return _NAMED.sub('[]', text)
