"""The generated pages, written where Sphinx finds them."""

from __future__ import annotations

from pathlib import Path

from flex_planner.recording import definition_folder

from site_pages.command_line import command_line_page
from site_pages.interfaces import interfaces_page
from site_pages.parameters import parameters_page
from site_pages.python_api import python_page


def generated_pages() -> dict[str, str]:
    """Return the text of every generated page by its name."""
    return {'python': python_page(),
            'interfaces': interfaces_page(definition_folder('flex_planner_interfaces')),
            'parameters': parameters_page(),
            'command_line': command_line_page()}


def write_pages(folder: Path) -> None:
    """Write the pages into a folder; one that is as it was is not touched."""
    folder.mkdir(exist_ok=True)
    for name, text in generated_pages().items():
        path = folder / f'{name}.md'
        if not path.exists() or path.read_text(encoding='utf-8') != text:
            path.write_text(text, encoding='utf-8')
