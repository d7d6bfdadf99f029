"""The command that says what a motion leaves behind on arms that differ."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.yaml_text import format_yaml, parse_yaml
from flex_planner.cli import main
from flex_planner.reports.arm_file import format_arm_file
import pytest

MOTION = ['--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1', '--payload', '1',
          '--effort-weights', '0.125,0.125']


@pytest.fixture
def arm_file(tmp_path: Path) -> Path:
    """Return an arm file beside which an identification lies."""
    path = tmp_path / 'arm.yaml'
    path.write_text(format_arm_file(load_arm('korayem_ei5')))
    (tmp_path / 'arm_identification.yaml').write_text(format_yaml({'parameters': [
        {'name': name, 'value': value, 'half_width': 0.02 * value, 'spread': None,
         'verdict': 'identified'} for name, value in (
            ('payload_mass', 1.0), ('links[0].flexural_rigidity', 5.0),
            ('links[1].flexural_rigidity', 5.0))]}))
    return path


def test_identified_errors_are_those_of_every_figure(arm_file: Path,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    folder = arm_file.parent / 'out'
    assert main(['robustness', str(arm_file), *MOTION, '--output', str(folder)]) == 0
    text = capsys.readouterr().out
    assert 'stiffness +-2%, payload +-2% (identified, ' in text
    assert 'carried out with           100, 100 N m/rad and 10, 10 N m s/rad at 1000 Hz' in text
    values: Any = parse_yaml((folder / 'arm_robustness.yaml').read_text())
    left = {one['if']: one for one in values['arms']}
    assert {'as modelled', 'stiffness -2%', 'payload +2%', 'two more modes'} < set(left)
    assert 0 < left['as modelled']['tip_motion'] < left['payload +2%']['tip_motion'] < 1e-3
    # of the trajectory that is recorded, too
    assert main(['plan', str(arm_file), *MOTION, '--output', str(folder)]) == 0
    text = capsys.readouterr().out
    assert 'stiffness +-2%' in text and 'payload +-2%' in text


def test_errors_that_are_given_count_more(arm_file: Path,
                                          capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['robustness', str(arm_file), *MOTION, '--stiffness-error', '0.05',
                 '--output', str(arm_file.parent)]) == 0
    assert 'stiffness +-5%, payload +-2% (in part identified' in capsys.readouterr().out
    assert main(['robustness', str(arm_file), *MOTION, '--stiffness-error', '0.9',
                 '--output', str(arm_file.parent)]) == 1
    assert '--stiffness-error is 0.9, but must be' in capsys.readouterr().err


def test_unstable_controller_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(['robustness', 'korayem_ei5', *MOTION, '--controller-rate', '100',
                 '--controller-stiffness', '100,100', '--controller-damping', '10,10',
                 '--output', str(tmp_path)]) == 1
    output = capsys.readouterr()
    assert 'unstable' in output.out + output.err
