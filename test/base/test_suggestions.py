"""Names that do not exist, and what is meant by them."""

from __future__ import annotations

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import did_you_mean, nearest_name, one_of
from flex_planner.base.yaml_files import YamlSection
import pytest

FIELDS = ('length', 'linear_density', 'mode_family')


@pytest.mark.parametrize(('given', 'meant'), [
    ('lenght', 'length'), ('linear-density', 'linear_density'), ('MODE_FAMILY', 'mode_family'),
    ('mode_familly', 'mode_family'), ('colour', ''), ('', ''), (3, ''), (None, ''),
    ('length' * 1000, '')])
def test_nearest_name_is_found_or_none(given: object, meant: str) -> None:
    assert nearest_name(given, FIELDS) == meant
    assert did_you_mean(given, FIELDS) == (f'; did you mean {meant}?' if meant else '')


def test_a_choice_lists_what_there_is() -> None:
    assert one_of('dierct', ['direct', 'incremental']) == (
        'one of direct, incremental; did you mean direct?')
    assert one_of('euler', ['direct', 'incremental']) == 'one of direct, incremental'


def test_unknown_field_is_compared_with_those_that_are_read() -> None:
    section = YamlSection('links[0]', {'length': 1.0, 'modse': 2})
    section.number('length')
    section.take('modes', 0)
    with pytest.raises(InvalidValueError, match='no such field; did you mean modes[?]$'):
        section.finish()


def test_missing_field_is_compared_with_those_that_are_left() -> None:
    section = YamlSection('links[0]', {'lenght': 1.0, 'modes': 2})
    with pytest.raises(InvalidValueError, match='given; or is that what lenght is meant to be[?]'):
        section.number('length')
    with pytest.raises(InvalidValueError, match='links.0..mass is missing, but must be given$'):
        section.number('mass')
