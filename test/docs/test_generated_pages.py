"""The generated pages name every message, field, parameter, command, option and public name."""

from __future__ import annotations

from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
import re

from documents import DOCS, ROOT
import flex_planner
from flex_planner.cli.parser import build_parser
from flex_planner.recording import definition_folder, MessageTypes
from flex_planner.ros.settings.fields import parameter_field
import pytest
from site_pages.command_line import command_line_page, commands
from site_pages.interface_files import read_interface
from site_pages.interfaces import interfaces_page
from site_pages.markdown import escape
from site_pages.parameters import anchor, NODES, parameters_page
from site_pages.python_api import python_page, SECTIONS
from site_pages.source_links import link_sources, title_links
from site_pages.write import write_pages

INTERFACES = ROOT / 'flex_planner_interfaces'
FILES = [path for kind in ('msg', 'srv', 'action') for path in INTERFACES.glob(f'{kind}/*')]


def section(page: str, title: str) -> str:
    """Return a section of a page."""
    (text,) = re.findall(rf'^#+ {re.escape(title)}\n(.*?)(?=^#|\Z)', page,
                         re.MULTILINE | re.DOTALL)
    return str(text)


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_every_entry_of_an_interface_is_there_with_what_is_said_of_it(path: Path) -> None:
    shown = section(interfaces_page(INTERFACES), path.name)
    # read by other means: what is left of a line without its comment
    lines = [line.partition('#')[0].strip() for line in path.read_text().splitlines()]
    for line in filter(lambda text: text not in ('', '---'), lines):
        wanted = line.partition(' ')[2].replace('=', ' = ') if '=' in line else line
        assert f'`{wanted}`' in shown
    letters = re.sub(r'[\s#*:|`-]|text', '', escape(path.read_text()).replace('\\', ''))
    assert len(re.sub(r'[\s#*:|`-]|text', '', shown.replace('\\', ''))) > 0.85 * len(letters)


def test_messages_are_those_that_are_recorded() -> None:
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    for path in INTERFACES.glob('msg/*.msg'):
        entries = [entry for groups in read_interface(path).parts.values() for group in groups
                   for entry in group.entries]
        name = f'flex_planner_interfaces/msg/{path.stem}'
        assert [entry.name for entry in entries if not entry.value] == list(types.fields(name))
        assert {entry.name for entry in entries if entry.value} == set(types.constants(name))


def test_comment_before_and_beside_an_entry_and_an_indented_one_are_kept(tmp_path: Path) -> None:
    file = tmp_path / 'srv' / 'Ask.srv'
    file.parent.mkdir()
    file.write_text('# What it is for:\n#\n#   J = 1 < 2\n\n# [m], of both.\nfloat64 a\nint8[] b'
                    '\nuint8 ONE=1   # the first\n---\n')
    page = interfaces_page(tmp_path)
    assert 'What it is for:\n\n```text\n  J = 1 < 2\n```\n' in page
    assert '`float64 a`, `int8[] b`\n: \\[m\\], of both.\n\n  * `ONE = 1`: the first\n' in page
    assert '**Response**\n\nEmpty.\n' in page


@pytest.mark.parametrize('node', NODES)
def test_every_parameter_is_there_with_its_default_and_range(node: str) -> None:
    shown = section(parameters_page(), node)
    for entry in fields(NODES[node]):
        assert f'`{entry.name}`{{#{anchor(node, entry.name)}}}\n: ' in shown
        assert escape(entry.metadata['description'].text) in shown
    assert shown.count('; fixed') == sum(entry.metadata['description'].read_only
                                         for entry in fields(NODES[node]))


def test_parameter_is_told_with_its_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(kw_only=True)
    class Settings:
        gain: float = parameter_field(1.5, 'Of the PD [N].', lowest=0, highest=9, read_only=True)
        names: list[str] = parameter_field(['a'], 'Names.')

    monkeypatch.setitem(NODES, 'other', Settings)
    shown = section(parameters_page(), 'other')
    assert ': Of the PD \\[N\\].\n\n  *double, default `1.5`; 0 to 9; fixed*' in shown
    assert '*string[], default `["a"]`*' in shown


def test_every_command_and_option_is_there() -> None:
    page, names = command_line_page(), []
    for name, _, parser in commands():
        names.append(name)
        shown = section(page, f'flex-planner {name}')
        said = re.findall(r'^  (?:-\w, )?(--[\w-]+)', parser.format_help(), re.MULTILINE)
        assert [option for option in said if f'`{option}' not in shown] == ['--help']
        assert '%(' not in shown
    listed = re.findall(r'^    (\w[\w-]*)(?:  |$)', build_parser().format_help(), re.MULTILINE)
    assert names == listed


def test_every_public_module_exists_and_every_name_is_there_once() -> None:
    page = python_page()
    entries = re.findall(r'^   (\w+)$', page, re.MULTILINE)
    assert set(flex_planner.__all__) <= set(entries)
    for modules in SECTIONS.values():
        for name in modules:
            assert import_module(name).__doc__
    for block in re.findall(r'currentmodule:: ([\w.]+)\n(.*?)```', page, re.DOTALL):
        module = import_module(block[0])
        assert all(hasattr(module, entry) for entry in re.findall(r'^   (\w+)$', block[1],
                                                                  re.MULTILINE))


def test_modules_that_examples_and_tutorials_import_are_public() -> None:
    public = {name for modules in SECTIONS.values() for name in modules}
    texts = [path.read_text() for path in [*ROOT.glob('examples/*.py'),
                                           *DOCS.glob('tutorials/*.md'), ROOT / 'README.md']]
    used = {name for text in texts for name in re.findall(r'from (flex_planner[.\w]*) import',
                                                          text)}
    assert {name for name in used - public if 'interfaces' not in name} == set()


def test_pages_are_written_once(tmp_path: Path) -> None:
    write_pages(tmp_path, ROOT)
    times = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    write_pages(tmp_path, ROOT)
    assert {'python.md', 'interfaces.md', 'parameters.md', 'command_line.md'} < set(times)
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == times


def test_links_out_of_the_documentation_lead_to_the_repository() -> None:
    text = '[a](../x/a.py) [b](../b.md) ![c](../x/c.png)'
    assert link_sources(text, 'tutorials/page', '') == text
    assert link_sources(text, 'page', 'https://h/r') == (
        '[a](https://h/r/blob/main/x/a.py) [b](https://h/r/blob/main/b.md) ![c](../x/c.png)')
    assert link_sources(text, 'page', '') == 'a b ![c](../x/c.png)'


def test_page_that_is_named_by_its_file_is_shown_by_its_title() -> None:
    assert title_links('[a.md](a.md#b) [a.md](../a.md) [x](a.md) [a.md](b.md)') == (
        '[](a.md#b) [](../a.md) [x](a.md) [a.md](b.md)')


def test_people_at_a_terminal_are_spared_the_equations_of_the_paper() -> None:
    assert not re.search(r'\beqs?\.', command_line_page() + parameters_page())
