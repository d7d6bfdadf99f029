"""Sentences that are put together do not stutter."""

from __future__ import annotations

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.sentences import count_of, say_os_error, say_reason
from flex_planner.base.validation import number, vector
import pytest


@pytest.mark.parametrize(('status', 'reason', 'sentence'), [
    ('canceled', 'canceled', 'canceled'), ('canceled', '', 'canceled'),
    ('canceled', 'canceled at 45.0% of the homotopy', 'canceled at 45.0% of the homotopy'),
    ('canceled', 'a: it failed; canceled', 'canceled: a: it failed'),
    ('not found', 'it failed; it failed; no way', 'not found: it failed; no way')])
def test_status_and_reason_are_said_once(status: str, reason: str, sentence: str) -> None:
    assert say_reason(status, reason) == sentence


def test_things_are_counted() -> None:
    assert [count_of(n, 'number') for n in (0, 1, 2)] == ['0 numbers', '1 number', '2 numbers']


def test_bound_without_a_limit_names_the_unit() -> None:
    with pytest.raises(InvalidValueError, match='^x is nan, but must be a finite number in m$'):
        number('x', float('nan'), unit='m')
    with pytest.raises(InvalidValueError, match="^x is 'a', but must be a number in m$"):
        number('x', 'a', unit='m')
    with pytest.raises(InvalidValueError, match='^x has 1 number, but must be a list of 2 num'):
        vector('x', [1.0], 2)


def test_missing_value_is_called_missing() -> None:
    with pytest.raises(InvalidValueError, match='^x is missing, but must be a number > 0 m$'):
        number('x', None, above=0, unit='m')


@pytest.mark.parametrize(('error', 'sentence'), [
    (FileNotFoundError(2, 'No such file', '/a'), '/a: No such file'),
    (OSError(18, 'Invalid cross-device link', '/a', None, '/b'),
     '/a: /b: Invalid cross-device link'), (OSError('it broke'), 'it broke')])
def test_error_of_the_system_is_told_without_its_number(error: OSError, sentence: str) -> None:
    assert say_os_error(error) == sentence
