"""``flex-planner compare``: what it says and draws, and what it refuses."""

from __future__ import annotations

from pathlib import Path

from flex_planner.cli import main
import pytest

MOTION = ['compare', 'korayem_ei5', '--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1',
          '--payload', '1', '--effort-weights', '0.125,0.125']


def test_comparison_shows_that_the_flexible_plan_is_worth_it(
        capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main([*MOTION, '--output', str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line[27:].partition(':')[0] for line in lines if line.startswith('warning ')] == [
        'the torque jumps by shares of the stall torque']
    errors = {line.split('  ')[0].strip() or line[:28].strip(): line for line in lines
              if 'torque only' in line}
    arrival = {name: float(line[28:].split()[0]) for name, line in errors.items()}
    # tip errors in mm: 0.9 planned rigid, as found before the project began; below 0.01 flexible
    assert arrival['rigid plan, torque only'] == pytest.approx(0.9, abs=0.05)
    assert arrival['flexible plan, torque only'] < 0.01
    assert (tmp_path / 'korayem_ei5_comparison.png').stat().st_size > 10_000


@pytest.mark.parametrize(('options', 'text'), [
    (['--rigidity-scale', '0'], '--rigidity-scale is 0.0, but must be a number >= 0.001'),
    (['--added-friction', '1'], '--added-friction has 1 number'),
    (['--plant-modes', '99'], 'but must be'),
    (['--settling', '0'], '--settling is 0.0, but must be'),
    (['--time-limit', '1e-9'], 'time limit')])
def test_comparison_that_cannot_be_made_says_why(capsys: pytest.CaptureFixture[str],
                                                 tmp_path: Path, options: list[str],
                                                 text: str) -> None:
    assert main([*MOTION, *options, '--output', str(tmp_path)]) == 1
    assert text in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
