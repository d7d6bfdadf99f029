"""
Cost of the model: operations, build time, evaluation time, against other ways to evaluate it.

All figures come from one run on one machine; a time is the median of many calls.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import os
import pickle
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Any

from bench.brute_force import brute_force_rate
from flex_planner import Arm, load_arm
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
import numpy as np

POINTS = 300
SIZES = [(n, m) for n in range(1, 5) for m in range(4)]
BRUTE_FORCE = [(1, 0), (1, 1), (2, 0), (2, 1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Figures of one arm; evaluation times per point [us]; None where not run."""

    links: int
    modes: int
    coordinates: int
    rate_operations: int
    jacobian_operations: int
    first_build_seconds: float
    later_start_seconds: float
    compiled_rate: float
    compiled_jacobian: float
    interpreted_jacobian: float
    brute_force_rate: float | None = None


def uniform_arm(links: int, modes: int) -> Arm:
    """Return an arm of equal links like those of the paper."""
    paper = load_arm('korayem_ei50')
    link = replace(paper.links[0], modes=modes)
    return Arm(name=f'{links} links, {modes} modes each', links=(link,) * links,
               joints=(paper.joints[0],) * links)


def median_seconds(call: Callable[[], Any], *, at_least: int = 7, budget: float = 1.0) -> float:
    """Return the median duration of a call, repeated for about a second."""
    call()
    times: list[float] = []
    while len(times) < at_least or sum(times) < budget:
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def random_points(arm: Arm) -> tuple[Array, Array]:
    """Return extended states and parameters like those met on a motion."""
    random = np.random.default_rng(0)
    z = 0.1 * random.normal(size=(POINTS, 4 * arm.n_coordinates))
    p = Parameters.of(arm, payload_mass=1.0).stack()
    return z, p


def start_seconds(arm: Arm, cache: str) -> float:
    """Return the time that a fresh process takes from the arm to ready functions."""
    code = (
        'import sys, time, pickle\n'
        'began = time.perf_counter()\n'
        'from flex_planner.optimal_control.arm_model import ArmModel\n'
        'ArmModel(pickle.loads(bytes.fromhex(sys.argv[1])))\n'
        'print(time.perf_counter() - began)\n')
    result = subprocess.run([sys.executable, '-c', code, pickle.dumps(arm).hex()], check=True,
                            capture_output=True, text=True,
                            env={**os.environ, 'XDG_CACHE_HOME': cache})
    return float(result.stdout)


def interpreted_seconds(arm: Arm, z: Array, p: Array) -> float:
    """Return the time of CasADi's virtual machine for all points, called once."""
    from flex_planner.optimal_control.pontryagin import build_optimality_functions

    function, _ = build_optimality_functions(arm)['optimality_jacobian']
    mapped = function.map(len(z))
    columns, shared = np.ascontiguousarray(z.T), np.repeat(p[:, None], len(z), axis=1)
    return median_seconds(lambda: mapped(columns, shared))


def measure(links: int, modes: int) -> Row:
    """Return the figures of one arm."""
    from flex_planner.optimal_control.pontryagin import build_optimality_functions

    arm = uniform_arm(links, modes)
    built = build_optimality_functions(arm)
    with tempfile.TemporaryDirectory() as cache:
        first, later = start_seconds(arm, cache), start_seconds(arm, cache)
    z, p = random_points(arm)
    model = ArmModel(arm)
    micro = 1e6 / POINTS
    row = Row(
        links=links, modes=modes, coordinates=arm.n_coordinates,
        rate_operations=built['optimality'][0].n_instructions(),
        jacobian_operations=built['optimality_jacobian'][0].n_instructions(),
        first_build_seconds=first, later_start_seconds=later,
        compiled_rate=median_seconds(lambda: model.optimality(z, p)) * micro,
        compiled_jacobian=median_seconds(lambda: model.optimality_jacobian(z, p)) * micro,
        interpreted_jacobian=interpreted_seconds(arm, z, p) * micro)
    if (links, modes) in BRUTE_FORCE:
        evaluate = brute_force_rate(arm)
        columns = list(z.T)
        row = replace(row, brute_force_rate=median_seconds(lambda: evaluate(columns)) * micro)
    return row


def table(rows: Sequence[Row]) -> str:
    """Return the figures as a Markdown table."""
    heads = ['links x modes', 'coordinates', "operations z'", "with dz'/dz", 'first build [s]',
             'later start [s]', "z' [us]", "with dz'/dz [us]", 'CasADi VM [us]', 'ratio',
             "SymPy, z' only [us]", 'ratio']
    lines = [f'| {" | ".join(heads)} |', f'|{"---|" * len(heads)}']
    for row in rows:
        cells: list[float | str | None] = [
                 f'{row.links} x {row.modes}', row.coordinates, row.rate_operations,
                 row.jacobian_operations, row.first_build_seconds, row.later_start_seconds,
                 row.compiled_rate, row.compiled_jacobian, row.interpreted_jacobian,
                 _ratio(row.interpreted_jacobian, row.compiled_jacobian), row.brute_force_rate,
                 _ratio(row.brute_force_rate, row.compiled_rate)]
        lines.append(f'| {" | ".join(_cell(cell) for cell in cells)} |')
    return '\n'.join(lines)


def _ratio(slow: float | None, fast: float | None) -> float | None:
    return slow / fast if slow and fast else None


def _cell(value: float | str | None) -> str:
    if value is None:
        return '-'
    return f'{value:.3g}' if isinstance(value, float) else str(value)
