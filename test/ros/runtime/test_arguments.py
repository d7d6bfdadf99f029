"""Command lines and files of parameters as people write them."""

from __future__ import annotations

from pathlib import Path

from flex_planner.ros.runtime.arguments import readable_arguments, unused_files, with_floats
import pytest


@pytest.mark.parametrize(('text', 'read'), [
    ('[1, 2.5]', '[1.0, 2.5]'), ('[-1, 1e-3, .inf]', '[-1.0, 1e-3, .inf]'),
    ('a: [0, .5] # 1, 2', 'a: [0.0, .5] # 1, 2'),
    ('a:\n  b:\n  - 1.0\n  - 2\n  - +3\n', 'a:\n  b:\n  - 1.0\n  - 2.0\n  - +3.0\n'),
    # as they are: whole numbers alone, texts, what looks like octal numbers, what is no YAML
    ('[1, 2]', '[1, 2]'), ('[1, two, 3.0]', '[1, two, 3.0]'), ("['1', 2.0]", "['1', 2.0]"),
    ('[010, 2.0]', '[010, 2.0]'), ('[1, 2.5', '[1, 2.5'), ('', ''), ('3', '3')])
def test_lists_of_whole_and_other_numbers_get_points(text: str, read: str) -> None:
    assert with_floats(text) == read


def test_files_and_parameters_are_read_and_left_alone_elsewhere(tmp_path: Path) -> None:
    mixed, plain = tmp_path / 'mixed.yaml', tmp_path / 'plain.yaml'
    mixed.write_text('/**:\n  ros__parameters:\n    gains: [1, 2.5]\n')
    plain.write_text('/**:\n  ros__parameters:\n    gains: [1.0, 2.5]\n')
    given = ['node', '-p', 'x:=[1, 2.5]', '--ros-args', '-p', 'x:=[1, 2.5]', '--params-file',
             str(mixed), '--params-file', str(plain), '--params-file', 'none.yaml', '--', '-p',
             'y:=[1, 2.5]']
    with readable_arguments(given) as read:
        changed = {place: word for place, word in enumerate(read) if word != given[place]}
        assert changed.keys() == {5, 7}
        assert changed[5] == 'x:=[1.0, 2.5]'
        assert Path(changed[7]).read_text() == plain.read_text()
    assert not Path(changed[7]).exists()


@pytest.mark.parametrize(('key', 'rules', 'used'), [
    ('arm', [], True), ('/arm', [], True), ('/**/arm', [], True), ('/**', [], True),
    ('/*', [], True), ('arm', ['__ns:=/robot'], False), ('/**/arm', ['__ns:=/robot'], True),
    ('/**/arm', ['__ns:=/robot/left'], True), ('/robot/arm', ['__ns:=robot'], True),
    ('/*/arm', ['__ns:=/robot'], True), ('/*/arm', [], False), ('arms', [], False),
    ('arm', ['__node:=hand'], False), ('/**/hand', ['arm:__node:=hand'], True)])
def test_file_without_parameters_for_a_node_is_named(tmp_path: Path, key: str, rules: list[str],
                                                     used: bool) -> None:
    path = tmp_path / 'own.yaml'
    path.write_text(f'{key}:\n  ros__parameters:\n    x: 1\n')
    arguments = ['program', '--ros-args', '--params-file', str(path)]
    for rule in rules:
        arguments += ['-r', rule]
    sentences = unused_files(arguments, 'arm')
    assert len(sentences) == (not used)
    if not used:
        assert f'{path} has no parameters for /' in sentences[0]
        assert f'only for /{key.strip("/")}: nothing of it is used here' in sentences[0]


def test_node_in_a_namespace_of_a_file_is_found(tmp_path: Path) -> None:
    path = tmp_path / 'own.yaml'
    path.write_text('robot:\n  arm:\n    ros__parameters:\n      x: 1\n')
    arguments = ['program', '--ros-args', '--params-file', str(path), '-r', '__ns:=/robot']
    assert not unused_files(arguments, 'arm')
