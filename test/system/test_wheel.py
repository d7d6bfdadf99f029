"""The package as pip installs it: a wheel of its source distribution, without ROS or sources."""

from __future__ import annotations

from importlib import metadata
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
import tarfile

from packaging.requirements import Requirement
import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ('bench', 'config', 'docs', 'examples', 'flex_planner', 'flex_planner_interfaces',
           'launch', 'requirements', 'resource', 'test', 'tools', 'CHANGELOG.rst',
           'CONTRIBUTING.md', 'LICENSE', 'MANIFEST.in', 'Makefile', 'README.md', 'package.xml',
           'pyproject.toml', 'setup.cfg', 'setup.py')
MAPS = ('dask', 'distributed', 'numcodecs', 'xarray', 'zarr')
IGNORED = shutil.ignore_patterns('__pycache__', '*.pyc', 'node_modules')
SECONDS = 200  # longest time of a step, beside other processes
PLAN = ('plan', 'korayem_rigid', '--from', '0.5,0', '--to', '0.5,0.5', '--duration', '1',
        '--effort-weights', '0.125,0.125', '--search', 'fast', '--no-plot')


def requirements() -> set[str]:
    """Return the distributions that the package needs, and those that they need."""
    found: set[str] = set()
    left = list(metadata.requires('flex_planner') or ())
    # for maps, too
    left += [line for line in left if "extra == 'maps'" in line.replace('"', "'")]
    while left:
        wanted = Requirement(left.pop())
        extras = {'extra': ''} if wanted.name not in MAPS else {'extra': 'maps'}
        if wanted.name in found or (wanted.marker and not wanted.marker.evaluate(extras)):
            continue
        found.add(wanted.name)
        left += metadata.requires(wanted.name) or ()
    return found


def link_requirements(site: Path) -> None:
    """Make the installed requirements, and nothing else, importable in an environment."""
    for name in requirements():
        files = metadata.distribution(name).files or ()
        for top in {file.parts[0] for file in files if file.parts[0] not in ('..', '__pycache__')}:
            place = Path(str(metadata.distribution(name).locate_file(top)))
            if place.exists() and not (site / top).exists():
                (site / top).symlink_to(place)


class Installation:
    """An environment, and commands of it that know nothing of another one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / 'venv'
        for name in SOURCES:
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            left_out = {'ignore': IGNORED} if (ROOT / name).is_dir() else {}
            copy(ROOT / name, folder / 'source' / name, **left_out)
        pip = [sys.executable, '-m', 'pip']
        self.call(sys.executable, '-c', 'import os, runpy, sys; os.chdir("source"); sys.argv = '
                  '["setup.py", "-q", "sdist", "-d", ".."]; runpy.run_path("setup.py")')
        shutil.rmtree(folder / 'source')
        (self.archive,) = folder.glob('*.tar.gz')
        self.call(*pip, 'wheel', '--no-deps', '--no-build-isolation', '--no-index', '-w',
                  str(folder), str(self.archive))
        self.call(sys.executable, '-m', 'venv', '--without-pip', str(self.path))
        python = self.path / 'bin' / 'python'
        (wheel,) = folder.glob('*.whl')
        self.call(*pip, '--python', str(python), 'install', '--no-deps', '--no-index', str(wheel))
        (site,) = self.path.glob('lib/python3*/site-packages')
        link_requirements(site)

    def call(self, *command: str, code: int = 0) -> str:
        """Return what a command prints; it must end with a code."""
        environment = {name: os.environ[name] for name in ('HOME', 'LANG') if name in os.environ}
        run = subprocess.run(
            command, cwd=self.folder, capture_output=True, text=True, timeout=SECONDS,
            env={**environment, 'PATH': f'{self.path / "bin"}:/usr/bin:/bin'}, check=False)
        assert run.returncode == code, run.stderr
        assert 'Traceback' not in run.stderr
        return run.stdout + run.stderr

    def flex_planner(self, *arguments: str, code: int = 0) -> str:
        return self.call(str(self.path / 'bin' / 'flex-planner'), *arguments, code=code)


@pytest.fixture(scope='module')
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installation:
    folder = tmp_path_factory.mktemp('wheel')
    (folder / 'source').mkdir()
    return Installation(folder)


def test_wheel_without_ros_plans_records_reports_checks_and_recovers(
        installed: Installation) -> None:
    looked = installed.call(str(installed.path / 'bin' / 'python'), '-c', 'import importlib.util; '
                            'print(*map(importlib.util.find_spec, ["rclpy", "geometry_msgs"]))')
    assert looked == 'None None\n'
    planned = installed.flex_planner(*PLAN)
    match = re.search(r'^recording +(\S+)$', planned, re.MULTILINE)
    assert match is not None, planned
    recording = match[1]
    checked = installed.flex_planner('report', recording, '--check', '--output', 'page.html')
    assert 'the check of the recording passed' in checked
    assert 'joint1' in (installed.folder / 'page.html').read_text(encoding='utf-8')
    file = next((installed.folder / recording).glob('*.mcap'))
    cut = installed.folder / 'cut.mcap'
    cut.write_bytes(file.read_bytes()[:-200])
    assert 'try flex-planner recover' in installed.flex_planner('report', str(cut), code=1)
    assert 'messages' in installed.flex_planner('recover', str(cut))
    again = installed.flex_planner('report', 'cut_recovered', '--output', 'cut.html')
    assert 'Solved and certified' in again


def test_source_distribution_holds_what_is_built_of_it(installed: Installation) -> None:
    with tarfile.open(installed.archive) as archive:
        names = {name.partition('/')[2] for name in archive.getnames()}
    kept = {str(path.relative_to(ROOT)) for folder in ('flex_planner', 'flex_planner_interfaces',
                                                       'config', 'launch', 'resource')
            for path in (ROOT / folder).rglob('*') if path.is_file()
            and path.suffix != '.pyc' and '__pycache__' not in path.parts}
    assert kept - names == set()
    assert {'package.xml', 'setup.cfg', 'CHANGELOG.rst', 'LICENSE', 'Makefile'} <= names


def test_wheel_computes_and_draws_maps(installed: Installation) -> None:
    (installed.folder / 'study.yaml').write_text(
        'name: small\narm: korayem_rigid\nquantity: min_effort\nduration: 1.0\n'
        'start: [0.5, 0.0]\naxes:\n  goal_x: [0.4, 0.5]\n  goal_y: [0.4, 0.5]\n')
    said = installed.flex_planner('map', 'study.yaml', '--workers', '1')
    assert 'solved                   4' in said
    assert list((installed.folder / 'output' / 'maps').glob('study/*.png'))


def test_every_preset_and_template_is_inside(installed: Installation) -> None:
    said = installed.call(str(installed.path / 'bin' / 'python'), '-c',
                          'from flex_planner.arms.arm_files import *; '
                          'print(*sorted(preset_files()), read_arm_template()[:1])')
    assert said.split() == [*sorted(path.stem for path in ROOT.glob('config/arms/*.yaml')), '#']


def test_what_needs_ros_says_so_in_a_sentence(installed: Installation) -> None:
    for name in ('planner', 'arm_simulator', 'replay'):
        said = installed.call(str(installed.path / 'bin' / name), code=1)
        assert said.startswith(f'{name}: this node needs ROS 2')
        assert said.count('\n') == 1
