"""
The model and the lift against an earlier version of them, by turns.

The earlier version is a checkout of a commit of this repository, made for the run; both have the
same interpreter and libraries.

"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import json
import os
from pathlib import Path
import statistics
import subprocess
import sys
import tempfile
from typing import Any

from bench.earlier_probe import LIFTED, PRESETS
from bench.speed_probe import JOBS

ENERGIES = 'c8484632ad6e4d7bc3c20c30e315350d786de4e6'
"""The last commit whose equations of motion came from energies."""
FIRST_SOLVER = '7a2131117437bfd62d749f910a0b08ac377d53e2'
"""The last commit before the solver had compiled code of its own; its arms are older, too."""
ROUNDS = 3
_ROOT = Path(__file__).parents[1]


@contextmanager
def checkout(commit: str) -> Iterator[Path]:
    """Give a folder with the sources of a commit."""
    with tempfile.TemporaryDirectory() as folder:
        packed = subprocess.run(['git', '-C', str(_ROOT), 'archive', commit], check=True,
                                stdout=subprocess.PIPE).stdout
        subprocess.run(['tar', '-x', '-C', folder], input=packed, check=True)
        yield Path(folder)


@contextmanager
def versions(commit: str) -> Iterator[list[tuple[Path, str]]]:
    """Give sources and an empty cache folder of an earlier version and of this one."""
    with checkout(commit) as sources, tempfile.TemporaryDirectory() as caches:
        yield [(sources, f'{caches}/{commit}'), (_ROOT, f'{caches}/now')]


def measure() -> dict[str, Any]:
    """Return the figures of both versions, earlier ones first."""
    with versions(ENERGIES) as sides:
        rows = []
        for name in PRESETS:
            print(f'earlier: {name}', flush=True)
            runs = _by_turns('earlier_probe', sides, 'model', name)
            rows.append({
                'name': name, 'build_seconds': [one['build_seconds'] for one in runs[0]],
                'microseconds': [statistics.median(run[side]['microseconds'] for run in runs)
                                 for side in range(2)]})
        lifts = []
        for index, (name, start, goal, duration, payload) in enumerate(LIFTED):
            print(f'earlier: lift {index}', flush=True)
            both = [_probe('earlier_probe', *side, 'lift', str(index)) for side in sides]
            lifts.append({'name': f'{name}, {start} to {goal} deg in {duration:g} s, '
                          f'{payload:g} kg', 'both': both})
    return {'presets': rows, 'lifts': lifts}


def measure_speed() -> dict[str, Any]:
    """Return CPU times of plans and searches of the first solver and of this one, by turns."""
    with versions(FIRST_SOLVER) as sides:
        rows = []
        for name in JOBS:
            print(f'speed: {name}', flush=True)
            runs = _by_turns('speed_probe', sides, name)
            rows.append({'name': name, 'both': [{
                **runs[0][side], 'seconds': statistics.median(run[side]['seconds']
                                                              for run in runs)}
                for side in range(2)]})
    return {'jobs': rows}


def speed_table(figures: dict[str, Any]) -> str:
    """Return those figures as a Markdown table."""
    lines = ['| job | first solver [ms] | now [ms] | ratio | J or kg |', f'|{"---|" * 5}']
    for job in figures['jobs']:
        before, now = job['both']
        ratio = f'{before["seconds"] / now["seconds"]:.1f}' if before['solved'] else '-'
        told = f'{before["seconds"] * 1e3:.4g}{"" if before["solved"] else " (not solved)"}'
        lines.append(f'| {job["name"]} | {told} | {now["seconds"] * 1e3:.4g} | {ratio} | '
                     f'{now["value"]:.9g} |')
    return '\n'.join(lines)


def _by_turns(script_name: str, sides: list[tuple[Path, str]],
              *what: str) -> list[list[dict[str, Any]]]:
    """Return figures of both versions in every round."""
    return [[_probe(script_name, *side, *what) for side in sides] for _ in range(ROUNDS)]


def _probe(script_name: str, sources: Path, cache: str, *what: str) -> dict[str, Any]:
    """Return figures of one version from a process of its own."""
    script = 'import runpy; runpy.run_path({!r}, run_name="__main__")'.format(
        str(Path(__file__).with_name(f'{script_name}.py')))
    path = os.pathsep.join([str(sources), os.environ.get('PYTHONPATH', '')])
    done = subprocess.run([sys.executable, '-c', script, *what], check=True, cwd=sources,
                          capture_output=True, text=True,
                          env={**os.environ, 'PYTHONPATH': path, 'XDG_CACHE_HOME': cache})
    return json.loads(done.stdout.splitlines()[-1])  # type: ignore[no-any-return]


def tables(figures: dict[str, Any]) -> str:
    """Return the figures as two Markdown tables."""
    lines = ["| arm | z' with dz'/dz, energies [us] | virtual power [us] | ratio "
             '| first build [s] | | ratio |', f'|{"---|" * 7}']
    for row in figures['presets']:
        before, now = row['microseconds']
        slow, quick = row['build_seconds']
        lines.append(f'| {row["name"]} | {before:.3g} | {now:.3g} | {before / now:.2f} | '
                     f'{slow:.2f} | {quick:.2f} | {slow / quick:.1f} |')
    lines += ['', '| motion | links straight: iterations | CPU [s] | links bent: iterations '
              '| CPU [s] |', f'|{"---|" * 5}']
    lines += [f'| {lift["name"]} | {" | ".join(_lift_cells(one) for one in lift["both"])} |'
              for lift in figures['lifts']]
    return '\n'.join(lines)


def _lift_cells(one: dict[str, Any]) -> str:
    count = one['iterations'] if one['solved'] else f'not in {one["iterations"]}'
    return f'{count} | {one["seconds"]:.2f}'
