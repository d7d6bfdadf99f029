"""What reports certify, and what the independent arm does: ``python -m bench.independent``."""

from __future__ import annotations

from collections.abc import Iterable
import sys

from bench.independent.cases import (
    certified,
    MARGIN,
    published,
    ratios,
    start_error,
)

PLANS = 40


def compare(seeds: Iterable[int], plans: int) -> dict[str, tuple[float, float]]:
    """Print a line for each of so many plans; return the smallest and largest ratio of figures."""
    found: dict[str, list[float]] = {}
    left = plans
    for seed in seeds:
        case = published(seed)
        if case is None:
            print(f'seed {seed}: nothing is published', flush=True)
            continue
        these = ratios(case)
        for name, ratio in these.items():
            found.setdefault(name, []).append(ratio)
        far = max(abs(ratio - 1) for ratio in these.values())
        print(f'seed {seed}: {case.words}: tip error {certified(case.report).tip_error:.3g} m, '
              f'vibration {certified(case.report).vibration:.3g} m; ratios '
              f'{", ".join(f"{ratio:.4f}" for ratio in these.values())}; start '
              f'{start_error(case):.1e} m{"" if far <= MARGIN else "  <-- DIFFERS"}', flush=True)
        left -= 1
        if not left:
            break
    return {name: (min(values), max(values)) for name, values in found.items()}


if __name__ == '__main__':
    first = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    count = int(sys.argv[2]) if len(sys.argv) > 2 else PLANS
    for figure, (smallest, largest) in compare(range(first, first + 2 * count), count).items():
        print(f'{figure.replace("_", " ")}: {smallest:.5f} to {largest:.5f} of what is certified')
