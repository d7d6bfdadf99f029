"""The public face: ten names, loaded when they are used, typed for people's own files."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

import flex_planner
import pytest

ROOT = Path(flex_planner.__file__).parents[1]
NAMES = ['Arm', 'FlexPlannerError', 'Monitor', 'Objectives', 'Plan', 'Task', 'find_max_payload',
         'find_min_duration', 'load_arm', 'plan_path']
USER = """
from flex_planner import (
    Arm, find_max_payload, find_min_duration, FlexPlannerError, load_arm, Monitor, Objectives,
    Plan, plan_path, Task)


def main() -> Plan:
    arm: Arm = load_arm('korayem_rigid')
    task = Task(arm=arm, start_positions=[0.0, 1.0], goal_positions=[1, 1], duration=1.0,
                effort_weights=[0.125, 0.125])
    other = Task.between_points(arm, (0.5, 0.0), [0.5, 0.5], duration=1.0, payload_mass=1.0)
    try:
        plan = plan_path(task, monitor=Monitor(time_limit=10.0),
                         objectives=Objectives(max_joint_speeds=[1.5, 1.5]))
    except FlexPlannerError as error:
        raise SystemExit(str(error)) from None
    print(f'{find_max_payload(other).payload:.1f} {find_min_duration(other).duration:.2f}',
          plan.sample([0.0, 0.5]).torques.shape)
    return plan


main()
"""


def python(code: str, *options: str) -> str:
    run = subprocess.run([sys.executable, *options, '-c', code], text=True, capture_output=True,
                         env={**os.environ, 'PYTHONPATH': str(ROOT)}, check=False)
    assert run.stderr == ''
    return run.stdout


def test_face_is_ten_sorted_names_that_resolve() -> None:
    assert flex_planner.__all__ == NAMES
    assert set(NAMES) <= set(dir(flex_planner))
    for name in NAMES:
        assert getattr(flex_planner, name).__name__ == name


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'flex_planner' has no attribute 'plan_paht'"):
        flex_planner.plan_paht  # noqa: B018


def test_names_are_loaded_when_they_are_used() -> None:
    heavy = ('numpy', 'scipy', 'casadi', 'yaml')
    assert python(f'import flex_planner, sys; print([n for n in {heavy} if n in sys.modules])'
                  ) == '[]\n'
    # what takes longest to load waits until something is solved
    heavy = ('scipy.linalg', 'scipy.optimize', 'scipy.integrate', 'casadi', 'matplotlib')
    assert python(f'from flex_planner import *; import sys; '
                  f'print([n for n in {heavy} if n in sys.modules])') == '[]\n'


def test_file_of_a_user_runs_and_is_strictly_typed(tmp_path: Path) -> None:
    file = tmp_path / 'mine.py'
    file.write_text(USER)
    # 5.855 kg, within the accuracy of 1 g
    assert python(f'exec(open({str(file)!r}).read())') == '5.9 0.64 (2, 2)\n'
    mypy = pytest.importorskip('mypy.api')
    report, errors, code = mypy.run(['--strict', '--cache-dir', str(tmp_path / 'cache'),
                                     str(file)])
    assert (report.strip(), errors, code) == ('Success: no issues found in 1 source file', '', 0)
