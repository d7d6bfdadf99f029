"""The generated pages, written where Sphinx finds them."""

from __future__ import annotations

from pathlib import Path

from flex_planner.recording import definition_folder

from site_pages.command_line import command_line_page
from site_pages.interfaces import interfaces_page
from site_pages.parameters import parameters_page
from site_pages.python_api import python_page


def generated_pages(root: Path) -> dict[str, str]:
    """Return the text of every generated page by the name of its file."""
    contributing = (root / 'CONTRIBUTING.md').read_text(encoding='utf-8')
    return {'python.md': python_page(),
            'interfaces.md': interfaces_page(definition_folder('flex_planner_interfaces')),
            'parameters.md': parameters_page(),
            'command_line.md': command_line_page(),
            'contributing.md': contributing.replace('](docs/', '](../'),
            'changelog.rst': (root / 'CHANGELOG.rst').read_text(encoding='utf-8')}


def write_pages(folder: Path, root: Path) -> None:
    """Write the pages of a repository into a folder; one that is as it was is not touched."""
    folder.mkdir(exist_ok=True)
    for name, text in generated_pages(root).items():
        path = folder / name
        if not path.exists() or path.read_text(encoding='utf-8') != text:
            path.write_text(text, encoding='utf-8')
