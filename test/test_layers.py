"""Imports go one way: the numerical core knows nothing of ROS, recordings, plots or files."""

from __future__ import annotations

import ast
import os
from pathlib import Path
import subprocess
import sys

import flex_planner
import pytest

ROOT = Path(flex_planner.__file__).parent
# beside the core, never imported by it
BESIDE = {'arm_report', 'cli', 'comparison_report', 'demo', 'maps', 'motion_report', 'paper',
          'plotting', 'recording', 'report', 'ros'}
BLOCKED = ['rclpy', 'flex_planner_interfaces', 'matplotlib', 'mcap', 'mcap_ros2', 'rosbags',
           'geometry_msgs', 'sensor_msgs', 'trajectory_msgs', 'builtin_interfaces']


def module_name(path: Path) -> str:
    parts = ['flex_planner', *path.relative_to(ROOT).with_suffix('').parts]
    return '.'.join(part for part in parts if part != '__init__')


PATHS = {module_name(path): path for path in sorted(ROOT.rglob('*.py'))}
CORE = [name for name in PATHS if name.split('.')[1:2] != [] and name.split('.')[1] not in BESIDE]


def imports(name: str) -> set[str]:
    """Return what a module imports anywhere: its own package's modules, others by their top."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(PATHS[name].read_text())):
        if isinstance(node, ast.ImportFrom):
            inner = [f'{node.module}.{alias.name}' for alias in node.names]
            found |= {entry if entry in PATHS else str(node.module) for entry in inner}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return {entry if entry in PATHS else entry.split('.')[0] for entry in found} - {name}


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, '-c', code], text=True, capture_output=True,
                          timeout=60, env={**os.environ, 'PYTHONPATH': str(ROOT.parent)})


def test_core_works_without_ros_plotting_and_recording() -> None:
    result = run(
        'import importlib, sys\n'
        f'sys.modules.update(dict.fromkeys({BLOCKED}))\n'
        f'for name in {CORE}: importlib.import_module(name)\n'
        'from flex_planner.arm_files import load_arm\n'
        'from flex_planner.path import plan_path; from flex_planner.task import Task\n'
        "task = Task(arm=load_arm('korayem_rigid'), start_positions=[0, 1],\n"
        '            goal_positions=[1, 1], duration=1.0)\n'
        'print(plan_path(task).solved)')
    assert (result.stdout, result.stderr) == ('True\n', '')


def test_blocker_of_the_test_above_does_block() -> None:
    result = run(f'import sys; sys.modules.update(dict.fromkeys({BLOCKED})); import matplotlib')
    assert 'ModuleNotFoundError' in result.stderr


@pytest.mark.parametrize('name', CORE)
def test_core_module_imports_nothing_from_beside_the_core(name: str) -> None:
    inner = {entry.split('.')[1] for entry in imports(name) if entry.startswith('flex_planner.')}
    assert not inner & BESIDE
    assert not imports(name) & set(BLOCKED)


def test_core_modules_do_not_import_one_another_in_circles() -> None:
    # a package's __init__ stands for its modules and is not a part of their order
    left = {name: imports(name) & set(CORE) for name in CORE if PATHS[name].stem != '__init__'}
    imported = set(CORE) - set(left)
    while ready := {name for name, needed in left.items() if needed <= imported}:
        imported |= ready
        left = {name: needed for name, needed in left.items() if name not in ready}
    assert not left


@pytest.mark.parametrize('name', [name for name in CORE if '.collocation' in name])
def test_collocation_knows_nothing_of_arms(name: str) -> None:
    allowed = {'flex_planner.progress', 'flex_planner.validation', 'flex_planner.errors'}
    ours = {entry for entry in imports(name) if entry.startswith('flex_planner')}
    assert all(entry in allowed or '.collocation' in entry for entry in ours)


def test_casadi_is_imported_only_to_derive_and_to_compile() -> None:
    users = {name.removeprefix('flex_planner.') for name in PATHS if 'casadi' in imports(name)}
    assert users == {'compiled', 'dynamics', 'pontryagin', 'transcription'}


def test_kinematics_and_dynamics_can_check_each_other() -> None:
    assert 'flex_planner.dynamics' not in imports('flex_planner.kinematics')
    assert 'flex_planner.kinematics' not in imports('flex_planner.dynamics')
