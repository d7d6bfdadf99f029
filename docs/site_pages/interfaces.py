"""The page of the ROS interfaces, from the files that define them."""

from __future__ import annotations

from pathlib import Path

from site_pages.interface_files import Group, Interface, paragraphs, read_interfaces
from site_pages.markdown import code, definition, escape

_HEAD = """\
# ROS interfaces

Made from the files of the package `flex_planner_interfaces`; `ros2 interface show` prints the
same. Which topics, services and actions use them is told in [the node](../ros_node.md), error
codes have
[a page of their own](../error_codes.md). Units are SI and radians.
"""
_TITLES = {'msg': 'Messages', 'srv': 'Services', 'action': 'Actions'}


def interfaces_page(folder: Path) -> str:
    """Return the page for the interfaces of a package."""
    lines, kind = [_HEAD], ''
    for interface in read_interfaces(folder):
        if interface.kind != kind:
            kind = interface.kind
            lines += [f'## {_TITLES[kind]}', '']
        lines += _interface_lines(interface)
    return '\n'.join(lines)


def _interface_lines(interface: Interface) -> list[str]:
    """Return the section of an interface."""
    name = f'{interface.kind}-{interface.name}'.lower()
    lines = [f'({name})=', f'### {interface.name}.{interface.kind}', '']
    for part, groups in interface.parts.items():
        lines += [f'**{part}**', ''] if part else []
        for group in groups:
            lines += _group_lines(group)
        if not groups:
            lines += ['Empty.', '']
    return lines


def _group_lines(group: Group) -> list[str]:
    """Return a paragraph, or an entry of a definition list."""
    told = [f'```text\n{text}\n```' if indented else escape(text)
            for indented, text in paragraphs(group.comment)]
    if not group.entries:
        return [line for text in told for line in (text, '')]
    terms = ', '.join(code(f'{entry.type_name} {entry.name}') for entry in group.entries
                      if not entry.value)
    constants = [_constant(entry.name, entry.value, entry.comment) for entry in group.entries
                 if entry.value]
    if constants and terms:
        return definition(terms, [*told, *constants])
    if constants:
        return [line for text in (*told, '\n'.join(constants)) for line in (text, '')]
    remarks = [escape(entry.comment) for entry in group.entries if entry.comment]
    return definition(terms, [*told, *remarks])


def _constant(name: str, value: str, comment: str) -> str:
    """Return a line of a list."""
    remark = f': {escape(comment)}' if comment else ''
    return f'* {code(f"{name} = {value}")}{remark}'
