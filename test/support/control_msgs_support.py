"""The type of FollowJointTrajectory, built for the tests where control_msgs is not installed."""

from __future__ import annotations

import fcntl
import hashlib
import importlib.util
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

SOURCE = Path(__file__).parents[1] / 'data' / 'control_msgs'
ROOT = Path(__file__).parents[2]
BUILD = ROOT / 'build' / 'test_control_msgs'


def environment() -> dict[str, str]:
    """Return the variables under which a process finds control_msgs; it is built once."""
    if importlib.util.find_spec('control_msgs') is not None:
        return {}
    install = _build()
    site = next(install.glob('lib/python3*/site-packages'))
    added = {'AMENT_PREFIX_PATH': install, 'PYTHONPATH': site, 'LD_LIBRARY_PATH': install / 'lib'}
    return {name: os.pathsep.join([str(path), os.environ.get(name, '')])
            for name, path in added.items()}


def _build() -> Path:
    """Build the package, unless this very one is built already, and return its prefix."""
    wanted = hashlib.sha256(b''.join(
        path.read_bytes() for path in sorted(SOURCE.rglob('*')) if path.is_file())
        + sys.version.encode()).hexdigest()
    install, stamp = BUILD / 'install', BUILD / 'stamp'
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / 'lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if stamp.exists() and stamp.read_text() == wanted:
            return install
        for folder in (BUILD / 'cmake', install):
            shutil.rmtree(folder, ignore_errors=True)
        for command in (
                ['cmake', '-S', str(SOURCE), '-B', str(BUILD / 'cmake'), '-DBUILD_TESTING=OFF',
                 f'-DCMAKE_INSTALL_PREFIX={install}', f'-DPython3_EXECUTABLE={sys.executable}',
                 '-DCMAKE_C_FLAGS=-O0', '-DCMAKE_CXX_FLAGS=-O0'],
                ['cmake', '--build', str(BUILD / 'cmake'), '--parallel', '2'],
                ['cmake', '--install', str(BUILD / 'cmake')]):
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                pytest.fail(f'{" ".join(command[:2])} failed:\n{done.stdout[-2000:]}'
                            f'{done.stderr[-2000:]}')
        stamp.write_text(wanted)
    return install
