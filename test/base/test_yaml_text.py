"""YAML says what people mean, or gets one sentence with its line."""

from __future__ import annotations

import math
import time
from typing import Any

from flex_planner.base.yaml_text import format_yaml, parse_yaml, YamlTextError
import pytest
import yaml


@pytest.mark.parametrize(('text', 'number'), [
    ('10', 10), ('-3', -3), ('+4', 4), ('0', 0), ('0.5', 0.5), ('.5', 0.5), ('5.', 5.0),
    ('2.0e4', 2e4), ('70.0e9', 7e10), ('1e3', 1e3), ('7E-3', 7e-3), ('1.e+2', 100.0),
    ('007.5', 7.5), ('08.0', 8.0), ('.inf', math.inf), ('-.Inf', -math.inf),
    ('123456789012345678', 123456789012345680.0), ('0e9', 0.0), ('-0', 0)])
def test_number_is_the_decimal_one_that_is_written(text: str, number: float) -> None:
    assert parse_yaml(f'a: {text}') == {'a': number}


@pytest.mark.parametrize('text', [
    '010', '-010', '00', '08', '1:30', '-1:30', '1:30.5', '190:20:30', '0x10', '0o10', '0b1',
    '1_000', '1_000.5', '1.5_0', '0x_1', '0_1', '1_0e3'])
def test_number_that_yaml_reads_in_two_ways_is_refused(text: str) -> None:
    with pytest.raises(YamlTextError, match=rf'^line 2, column 4: {text} must be a plain decimal '
                                            'number.*; put text in quotes$'):
        parse_yaml(f'b: 1\na: {text}')
    assert parse_yaml(f'a: "{text}"') == {'a': text}


@pytest.mark.parametrize(('text', 'problem'), [
    ('1e999', 'must be a number below 1e308'), ('-1e999', 'must be a number below 1e308'),
    ('9' * 400, 'must be a number below 1e308'), ('5e-400', 'must be 0 or a number above 1e-308'),
    ('!!int "010"', '010 must be a plain'), ('!!float no', 'no must be a number'),
    ('!!bool yes', 'yes must be true or false'), ('!!timestamp 2001-01-01', 'the tag !!timestamp'),
    ('!mine 3', 'the tag !mine'), ('"\\ud800"', 'halves of characters')])
def test_value_that_would_change_is_refused(text: str, problem: str) -> None:
    with pytest.raises(YamlTextError, match=f'^line 1, column 4: .*{problem}'):
        parse_yaml(f'a: {text}')


@pytest.mark.parametrize('text', ['yes', 'No', 'on', 'OFF', 'y', '2001-01-01', '1.2.3', '1,5', '=',
                                  '1e3 kg', '5 %', '\u0661', 'inf'])
def test_words_are_text(text: str) -> None:
    assert parse_yaml(f'a: {text}\n{text}: 1') == {'a': text, text: 1}


@pytest.mark.parametrize(('text', 'problem'), [
    ('a: 1\na: 2', "line 2, column 1: field 'a' is given twice"),
    ('"a": 1\na: 2', "line 2, column 1: field 'a' is given twice"),
    ('a:\n\tb: 1', 'line 2, column 1: a tab stands where YAML wants spaces'),
    ('a: 1\n---\nb: 1', 'line 2, column 1: a second document begins'),
    ('a: [1', 'line 1, column 6: .* but got the end of the file'),
    ('a: \x01', 'the character U.0001 at position 4 is not allowed'),
    ('[' * 60 + ']' * 60, 'line 1, column 52: nested deeper than 50 levels'),
    pytest.param('[' * 2000, 'nested deeper than 50 levels', id='very deep'),
    ('a: &a [*a]', 'nested deeper than 50 levels'),
    ('a: *b', "line 1, column 4: found undefined alias 'b'")])
def test_mistake_gets_one_line_that_says_where(text: str, problem: str) -> None:
    with pytest.raises(YamlTextError, match=f'^.*{problem}') as caught:
        parse_yaml(text)
    assert '\n' not in str(caught.value)


def test_aliases_that_multiply_are_refused_at_once() -> None:
    lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x, x]']
    lines += [f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 10)}]' for i in range(1, 10)]
    began = time.monotonic()
    with pytest.raises(YamlTextError, match='more than 100000 entries'):
        parse_yaml('\n'.join(lines))
    assert time.monotonic() - began < 1.0  # followed, they would be 10^10


def test_aliases_and_merged_mappings_are_read() -> None:
    text = 'one: &one {a: 1, b: 2}\ntwo: *one\nthree: {<<: *one, b: 3}'
    assert parse_yaml(text) == {'one': {'a': 1, 'b': 2}, 'two': {'a': 1, 'b': 2},
                                'three': {'a': 1, 'b': 3}}


def test_names_of_fields_are_text() -> None:
    assert parse_yaml('010: 1\n~: 2\nyes: 3\n1: {2.0: 4}') == {
        '010': 1, '~': 2, 'yes': 3, '1': {'2.0': 4}}


@pytest.mark.parametrize('part', ['1', '1_', '1:', '.', '1.', '0', '-', '_', '1e'])
def test_long_scalar_takes_no_time(part: str) -> None:
    text = part * 200_000 + 'x'
    began = time.monotonic()
    assert parse_yaml(f'a: {text}') == {'a': text}
    assert time.monotonic() - began < 20.0  # with patterns that try again it took minutes


def test_many_fields_take_no_time() -> None:
    text = '\n'.join(f'field{i}: {i}' for i in range(5000))
    began = time.monotonic()
    assert len(parse_yaml(text)) == 5000
    assert time.monotonic() - began < 20.0  # comparing each with each took minutes


def test_written_values_are_read_alike_by_both_versions_of_yaml() -> None:
    words = ['010', '1e3', '70.0e9', '1:30', '1_0', '0x1', '08', 'yes', 'on', '~', '', '.inf', '=',
             '2001-01-01', 'Größe 🦾', 'null', '- a', '1e', 'a: b', '#']
    values: dict[str, Any] = {'words': words, 'numbers': [1, -2.5, 1e-9, 1e20, math.inf, 7e10],
                              'flags': [True, False, None]}
    assert parse_yaml(format_yaml(values)) == values
    assert yaml.safe_load(format_yaml(values)) == values
