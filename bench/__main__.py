"""Measure everything and write docs/benchmarks.md and docs/benchmarks.json: ``make bench``."""

from __future__ import annotations

from dataclasses import asdict
from datetime import date
import json
import os
from pathlib import Path
import platform
import subprocess

from bench import model
import numpy as np

DOCS = Path(__file__).parents[1] / 'docs'

INTRODUCTION = """# Benchmarks

Written by `make bench`, {date}: one run on one machine, medians. Times are per point, for {points}
points at a time. They say how things compare; on another machine they differ.

{versions}

## The model

Paper-like arms of equal links (length 0.5 m, 6 kg/m, EI = 50 N m²) with the same number of
pinned-pinned modes on each. *z'* is the right-hand side of the optimality conditions, *dz'/dz* its
full Jacobian. *First build* is a fresh process with an empty cache, *later start* a fresh process
that finds the compiled functions. *CasADi VM* evaluates the same functions (z' with dz'/dz) by
CasADi's virtual machine. *SymPy* is the same z' as one would first write it: energies with
quadrature inside, differentiated by SymPy, lambdified with common subexpressions; its derivation
takes minutes from 2 links with 2 modes on, and was not run there.

{table}
"""


def versions() -> dict[str, str]:
    """Return what the figures depend on."""
    import casadi
    import scipy
    import sympy

    compiler = subprocess.run(['cc', '--version'], check=True, capture_output=True, text=True)
    return {'Python': platform.python_version(), 'NumPy': np.__version__,
            'SciPy': scipy.__version__, 'CasADi': str(casadi.CasadiMeta.version()),
            'SymPy': str(sympy.__version__), 'compiler': compiler.stdout.splitlines()[0],
            'machine': f'{platform.machine()}, {os.cpu_count()} cores'}


def main() -> None:
    """Run all benchmarks."""
    rows = []
    for links, modes in model.SIZES:
        print(f'model: {links} links, {modes} modes each', flush=True)
        rows.append(model.measure(links, modes))
    used = versions()
    text = INTRODUCTION.format(
        date=date.today().isoformat(), points=model.POINTS, table=model.table(rows),
        versions=', '.join(f'{name} {value}' for name, value in used.items()))
    (DOCS / 'benchmarks.md').write_text(text)
    figures = {'versions': used, 'model': [asdict(row) for row in rows]}
    (DOCS / 'benchmarks.json').write_text(json.dumps(figures, indent=1) + '\n')
    print(text)


if __name__ == '__main__':
    main()
