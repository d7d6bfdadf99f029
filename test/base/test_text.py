"""Texts and values from outside as they are shown."""

from __future__ import annotations

from pathlib import Path
import pickle

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.base.errors import FlexPlannerError, InvalidValueError
from flex_planner.base.text import LONGEST_VALUE, printable, shown_value
from flex_planner.base.validation import vector
from flex_planner.base.yaml_files import read_yaml, YamlFileError
import numpy as np
import pytest


def endless(depth: int = 40) -> object:
    """Return a list that has 10^depth entries, as a YAML file of a kilobyte can describe it."""
    value: object = 'x'
    for _ in range(depth):
        value = [value] * 10
    return value


@pytest.mark.parametrize(('text', 'shown'), [
    ('\x1b[31mred\x1b[0m', r'\x1b[31mred\x1b[0m'), ('bell\a', r'bell\x07'), ('a\nb', r'a\nb'),
    ('C1 \x9b2J', r'C1 \x9b2J'),
    ('turned \u202e', r'turned \u202e'), ('line \u2028', r'line \u2028'),
    ('not UTF-8 \udcff', r'not UTF-8 \udcff'), ('Größe λ 長腕\u3000🦾', 'Größe λ 長腕\u3000🦾'),
    ('👩\u200d🔧', '👩\u200d🔧')])
def test_only_what_steers_a_terminal_is_escaped(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert printable(shown) == shown
    shown.encode('utf-8')


@pytest.mark.parametrize('text', ['x' * 10**6, '\x1b' * 10**6])
def test_long_text_loses_its_middle(text: str) -> None:
    assert len(printable(text, 100)) == 100
    assert '...' in printable(text, 100)


@pytest.mark.parametrize('value', [
    endless(), {'a': endless()}, 'y' * 10**6, 16**6000, np.zeros(500), [0.1] * 10**6,
    {str(k): k for k in range(10**5)}], ids=lambda value: type(value).__name__)
def test_long_and_endless_values_are_cut(value: object) -> None:
    assert len(shown_value(value)) <= LONGEST_VALUE + 10
    assert '\n' not in shown_value(value)
    assert len(str(InvalidValueError('field', value, 'short'))) < 2 * LONGEST_VALUE


@pytest.mark.parametrize('value', [
    1.5, -3, None, True, 'text', "it's", [0.5, 1.0], {'b': 1, 'a': 2},
    ['joint1', 'joint2']])
def test_short_values_are_shown_as_python_writes_them(value: object) -> None:
    assert shown_value(value) == repr(value)


def test_every_error_is_one_line_that_steers_nothing() -> None:
    error = FlexPlannerError('\x1b[2J/home/\udcff\nnext')
    assert str(error) == str(pickle.loads(pickle.dumps(error))) == r'\x1b[2J/home/\udcff\nnext'
    assert 'must be 3' in str(InvalidValueError('a\x1b', '\x1b' * 10**5, 'must be 3'))


def test_names_of_arms_are_safe_to_show_wherever_they_go() -> None:
    arm = Arm(name='\x1b[31m' + 'long' * 1000, source='book\a\npage 3',
              links=(Link(length=1.0, linear_density=1.0),), joints=(Joint(),))
    assert arm.name.startswith(r'\x1b[31mlong')
    assert len(arm.name) < 250
    assert arm.source == 'book\\x07\npage 3'


def test_endless_list_is_no_vector() -> None:
    with pytest.raises(InvalidValueError, match='gravity is .*, but must be a list of 2 numbers'):
        vector('gravity', endless(), 2)  # type: ignore[arg-type]


def test_error_in_yaml_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / 'bad.yaml'
    path.write_text('a: [1,\nb: }\n? [x]\n')
    with pytest.raises(YamlFileError) as caught:
        read_yaml(path)
    assert r'\n' not in str(caught.value)
    path.write_text('? &a [x]\n: 1\n? *a\n: 2\n')
    with pytest.raises(YamlFileError, match='is no name of a field'):
        read_yaml(path)
