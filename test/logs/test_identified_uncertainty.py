"""Uncertainties are those of the file beside an arm file, if it is of that arm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.yaml_text import format_yaml
from flex_planner.identification.experiments import LogError
from flex_planner.logs.identified_uncertainty import find_uncertainty, identification_file
from flex_planner.planning.uncertainty import ASSUMED
from flex_planner.reports.arm_file import format_arm_file
import pytest


def entry(name: str, value: float, half_width: float | None, spread: float | None,
          verdict: str = 'identified') -> dict[str, Any]:
    return {'name': name, 'value': value, 'half_width': half_width, 'spread': spread,
            'verdict': verdict}


def write(folder: Path, *changes: dict[str, Any]) -> Path:
    """Write an arm file and what an identification says of it; return the former."""
    arm, path = load_arm('korayem_ei5'), folder / 'arm.yaml'
    path.write_text(format_arm_file(replace(arm, source='')))
    entries = {one['name']: one for one in (
        entry('payload_mass', 1.1, 0.011, 0.022),
        entry('links[0].flexural_rigidity', 5, 0.05, None),
        entry('links[1].flexural_rigidity', 5, None, 0.1), *changes)}
    identification_file(path).write_text(format_yaml({'parameters': list(entries.values())}))
    return path


def test_larger_one_of_interval_and_spread_counts(tmp_path: Path) -> None:
    path = write(tmp_path)
    found = find_uncertainty(str(path), load_arm(path))
    assert (found.stiffness, found.payload) == pytest.approx((0.02, 0.02))
    assert found.payload_error(1.1) == pytest.approx(0.02) and found.payload_error(2.0) == 0.1
    assert 'identified, ' in found.source and 'arm_identification.yaml' in found.source


def test_what_was_not_found_may_be_off_by_a_tenth_and_nothing_by_more_than_half(
        tmp_path: Path) -> None:
    path = write(tmp_path, entry('payload_mass', 1.0, None, None, 'fixed'),
                 entry('links[1].flexural_rigidity', 5, 7.0, None, 'weak'))
    found = find_uncertainty(str(path), load_arm(path))
    assert (found.stiffness, found.payload) == (0.5, 0.1)


def test_without_such_a_file_it_is_assumed(tmp_path: Path) -> None:
    path = write(tmp_path)
    identification_file(path).unlink()
    for name in (str(path), 'korayem_ei5'):
        assert find_uncertainty(name, load_arm(name)) is ASSUMED


@pytest.mark.parametrize(('content', 'message'), [
    ('parameters: 3', 'is not what flex-planner identify writes'),
    ('parameters: [{name: payload_mass, value: 1}]', 'is not what flex-planner identify writes'),
    ('parameters: []', "is not what flex-planner identify writes: 'payload_mass'"),
    (format_yaml({'parameters': [entry('payload_mass', 1, 0.1, 0.1), entry(
        'links[0].flexural_rigidity', 6, 0.1, 0.1)]}), 'is of another arm')])
def test_file_that_is_of_something_else_is_refused(tmp_path: Path, content: str,
                                                   message: str) -> None:
    path = write(tmp_path)
    identification_file(path).write_text(content)
    with pytest.raises(LogError, match=message):
        find_uncertainty(str(path), load_arm(path))
