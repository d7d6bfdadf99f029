"""Imports go one way, floor by floor: the numerical core knows nothing of what stands above it."""

from __future__ import annotations

import ast
import os
from pathlib import Path
import subprocess
import sys

import flex_planner
import pytest

ROOT = Path(flex_planner.__file__).parent
# a package imports from lower floors and from itself, never from its own floor or above
FLOORS = {
    'base': 0,
    'arms': 1, 'collocation': 1, 'recording': 1,
    'dynamics': 2,
    'optimal_control': 3,
    'control': 4,
    'planning': 5,
    'capacity': 6, 'simulation': 6,
    'identification': 7,
    'logs': 8, 'plotting': 8, 'reports': 8,
    'maps': 9, 'paper': 9,
    'ros': 10,
    'cli': 11,
}
CORE = ('base', 'arms', 'collocation', 'dynamics', 'optimal_control', 'control', 'planning',
        'capacity', 'identification', 'simulation')
# what the core must do without
BLOCKED = ['rclpy', 'flex_planner_interfaces', 'matplotlib', 'mcap', 'mcap_ros2', 'rosbags',
           'geometry_msgs', 'sensor_msgs', 'trajectory_msgs', 'builtin_interfaces']


def module_name(path: Path) -> str:
    parts = ['flex_planner', *path.relative_to(ROOT).with_suffix('').parts]
    return '.'.join(part for part in parts if part != '__init__')


def package(name: str) -> str:
    """Return the top folder of a module of ours; empty for the face itself."""
    return (name.split('.') + [''])[1]


PATHS = {module_name(path): path for path in sorted(ROOT.rglob('*.py'))}
IN_CORE = [name for name in PATHS if package(name) in CORE]


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
        f'for name in {IN_CORE}: importlib.import_module(name)\n'
        'from flex_planner.arms.arm_files import load_arm\n'
        'from flex_planner.planning.plan_path import plan_path\n'
        'from flex_planner.optimal_control.task import Task\n'
        "task = Task(arm=load_arm('korayem_rigid'), start_positions=[0, 1],\n"
        '            goal_positions=[1, 1], duration=1.0)\n'
        'print(plan_path(task).solved)')
    assert (result.stdout, result.stderr) == ('True\n', '')


def test_blocker_of_the_test_above_does_block() -> None:
    result = run(f'import sys; sys.modules.update(dict.fromkeys({BLOCKED})); import matplotlib')
    assert 'ModuleNotFoundError' in result.stderr


def test_every_package_has_a_floor() -> None:
    folders = {path.name for path in ROOT.iterdir() if (path / '__init__.py').is_file()}
    assert folders == set(FLOORS)


@pytest.mark.parametrize('name', [name for name in PATHS if package(name)])
def test_module_imports_only_from_lower_floors(name: str) -> None:
    own = package(name)
    ours = {package(entry) for entry in imports(name) if entry.startswith('flex_planner.')}
    assert not {other for other in ours - {own} if FLOORS[other] >= FLOORS[own]}
    if own in CORE:
        assert not imports(name) & set(BLOCKED)


@pytest.mark.parametrize('folder', FLOORS)
def test_modules_of_a_package_do_not_import_one_another_in_circles(folder: str) -> None:
    # a package's __init__ stands for its modules and is not a part of their order
    own = {name for name in PATHS if package(name) == folder and PATHS[name].stem != '__init__'}
    left = {name: imports(name) & own for name in own}
    imported: set[str] = set()
    while ready := {name for name, needed in left.items() if needed <= imported}:
        imported |= ready
        left = {name: needed for name, needed in left.items() if name not in ready}
    assert not left


def test_nothing_inside_imports_from_the_face() -> None:
    users = {name for name in PATHS if name != 'flex_planner' and 'flex_planner' in imports(name)}
    assert users == set()


def test_private_names_stay_in_their_module() -> None:
    for name, path in PATHS.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith('flex_planner'):
                assert not [a.name for a in node.names if a.name.startswith('_')], name


def test_casadi_is_imported_only_to_derive_and_to_compile() -> None:
    users = {name.removeprefix('flex_planner.') for name in PATHS if 'casadi' in imports(name)}
    assert users == {
        'dynamics.body_power', 'dynamics.build_chain', 'dynamics.chain',
        'dynamics.controller_steps', 'dynamics.dynamics_functions', 'dynamics.function_source',
        'dynamics.joint_power', 'dynamics.moving_frame', 'dynamics.torque_bounds',
        'identification.loop_functions',
        'optimal_control.direct.programme', 'optimal_control.free_rates',
        'optimal_control.barrier_conditions', 'optimal_control.offset_conditions',
        'optimal_control.path_constraints.obstacles',
        'optimal_control.path_constraints.path_slacks',
        'optimal_control.path_constraints.regions',
        'optimal_control.path_constraints.spatial_points',
        'optimal_control.path_constraints.symbolic_arm',
        'optimal_control.pontryagin',
        'optimal_control.rate_jacobian', 'optimal_control.running_cost',
        'optimal_control.torque_limits', 'optimal_control.torque_rate_conditions'}


def test_kinematics_and_dynamics_can_check_each_other() -> None:
    assert not any(entry.startswith('flex_planner.dynamics')
                   for entry in imports('flex_planner.arms.kinematics'))
    assert not any('flex_planner.arms.kinematics' in imports(f'flex_planner.dynamics.{name}')
                   for name in ('build_chain', 'body_power', 'moving_frame'))
