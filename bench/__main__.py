"""Measure everything and write docs/benchmarks.md and docs/benchmarks.json: ``make bench``."""

from __future__ import annotations

from dataclasses import asdict
import json
import os
from pathlib import Path
import platform
import subprocess
import sys

from bench import (
    battery,
    earlier,
    growth,
    limits_battery,
    model,
    payload,
    replanning,
    robust,
    soak,
    solver,
    spatial,
)
from bench.page import text
import numpy as np

DOCS = Path(__file__).parents[1] / 'docs'


def versions() -> dict[str, str]:
    """Return the versions and the machine that the figures depend on."""
    import casadi
    import scipy
    import sympy

    compiler = subprocess.run(['cc', '--version'], check=True, capture_output=True, text=True)
    return {'Python': platform.python_version(), 'NumPy': np.__version__,
            'SciPy': scipy.__version__, 'CasADi': str(casadi.CasadiMeta.version()),
            'SymPy': str(sympy.__version__), 'compiler': compiler.stdout.splitlines()[0],
            'machine': f'{platform.machine()}, {os.cpu_count()} cores'}


def measured_limits() -> dict[str, object]:
    """Plan random motions within random limits."""
    return {'limits': limits_battery.measure()}


def measured_robust() -> dict[str, object]:
    """Measure plans that forgive errors of the model."""
    return {'robust': robust.measure()}


def measured_spatial() -> dict[str, object]:
    """Measure motions of arms in space."""
    return {'spatial': spatial.measure()}


def measured_battery() -> dict[str, object]:
    """Measure motions of published arms."""
    return {'battery': battery.measure()}


def measured_speed() -> dict[str, object]:
    """Measure plans and searches of the first solver and of this one."""
    return {'speed': earlier.measure_speed()}


def measured_earlier() -> dict[str, object]:
    """Measure the model and the lift against those of an earlier version."""
    return {'earlier': earlier.measure()}


def measured_replanning() -> dict[str, object]:
    """Measure how often a planner plans again."""
    return {'replanning': {'rows': replanning.measure_all(), 'load': os.getloadavg()[0]}}


def measured_soak() -> dict[str, object]:
    """Measure what a planner answers, costs and leaves."""
    print(f'soak: {soak.SECONDS:g} s', flush=True)
    return {'soak': asdict(soak.measure())}


def measured_payload() -> dict[str, object]:
    """Measure the searches for the largest payload and the shortest duration."""
    rows = [row for arm in payload.ARMS for row in payload.measure(arm)]
    return {'payload': payload.figures(rows), 'durations': payload.durations()}


def measured_model() -> dict[str, object]:
    """Measure the model."""
    rows = []
    for links, modes in model.SIZES:
        print(f'model: {links} links, {modes} modes each', flush=True)
        rows.append(asdict(model.measure(links, modes)))
    return {'model': rows}


def measured_solver() -> dict[str, object]:
    """Measure the solver."""
    rows = [row for payload in solver.PAYLOADS for row in solver.measure(payload)]
    sizes = []
    for links, modes in growth.SIZES:
        print(f'growth: {links} links, {modes} modes each', flush=True)
        sizes.append(asdict(growth.measure(links, modes)))
    return {'solver': solver.figures(rows), 'growth': sizes, 'shares': growth.shares(),
            'plans': [solver.plan_seconds(payload) for payload in solver.PAYLOADS]}


def measured_clamped() -> dict[str, object]:
    """Measure plans of arms with clamped links."""
    rows = []
    for links, modes, setting in growth.CLAMPED:
        print(f'clamped: {links} links, {modes} modes each, {setting}', flush=True)
        try:
            rows.append(asdict(growth.measure(links, modes, setting)))
        except subprocess.CalledProcessError as error:  # refused: the links are too soft
            print(error.stderr, flush=True)
        else:
            print(rows[-1], flush=True)
    return {'clamped': rows}


def main() -> None:
    """Run the benchmarks named on the command line, or all; the others keep their figures."""
    kept = DOCS / 'benchmarks.json'
    figures = json.loads(kept.read_text()) if kept.exists() else {}
    parts = {'model': measured_model, 'solver': measured_solver, 'clamped': measured_clamped,
             'payload': measured_payload, 'earlier': measured_earlier, 'speed': measured_speed,
             'battery': measured_battery, 'limits': measured_limits, 'robust': measured_robust,
             'spatial': measured_spatial, 'soak': measured_soak,
             'replanning': measured_replanning}
    for name in sys.argv[1:] or parts:
        figures |= parts[name]()
    figures['versions'] = versions()
    kept.write_text(json.dumps(figures, indent=1) + '\n')
    (DOCS / 'benchmarks.md').write_text(text(figures))
    print(text(figures))


if __name__ == '__main__':
    main()
