"""Banded LU: the same numbers as SciPy's, and other threads run meanwhile."""

import threading
import time

from flex_planner.collocation.banded import BandedFactors
import numpy as np
import pytest
from scipy.linalg import solve_banded

Array = np.ndarray


def band(n: int, lower: int, upper: int, rng: np.random.Generator) -> Array:
    """Return a random band with the room that pivoting needs."""
    values = np.zeros((2 * lower + upper + 1, n), order='F')
    values[lower:] = rng.standard_normal((lower + upper + 1, n))
    return values


@pytest.mark.parametrize(('n', 'lower', 'upper'), [(1, 0, 0), (7, 2, 3), (400, 17, 9), (9, 8, 8)])
def test_solution_equals_scipys(n: int, lower: int, upper: int) -> None:
    rng = np.random.default_rng(n)
    values = band(n, lower, upper, rng)
    rhs = rng.standard_normal(n)
    expected = solve_banded((lower, upper), values[lower:], rhs)
    kept = rhs.copy()
    factors = BandedFactors(values, lower, upper)
    assert not factors.singular
    for _ in range(2):
        np.testing.assert_allclose(factors.solve(rhs), expected, rtol=1e-8, atol=1e-10)
    np.testing.assert_array_equal(rhs, kept)


def test_singular_and_not_finite_are_told() -> None:
    assert BandedFactors(np.zeros((4, 5), order='F'), 1, 1).singular
    values = band(5, 1, 1, np.random.default_rng(1))
    values[2, 3] = np.nan
    assert BandedFactors(values, 1, 1).singular


def test_wrong_arrays_are_refused() -> None:
    with pytest.raises(TypeError, match='Fortran order'):
        BandedFactors(np.zeros((4, 5)), 1, 1)
    factors = BandedFactors(band(5, 1, 1, np.random.default_rng(2)), 1, 1)
    with pytest.raises(ValueError, match='shape'):
        factors.solve(np.zeros(4))


def test_other_threads_run_meanwhile() -> None:
    values = band(60_000, 60, 60, np.random.default_rng(3))
    seen: list[float] = []
    done = threading.Event()

    def look() -> None:
        while not done.wait(1e-3):
            seen.append(time.monotonic())

    thread = threading.Thread(target=look)
    thread.start()
    began = time.monotonic()
    BandedFactors(values, 60, 60)
    ended = time.monotonic()
    done.set()
    thread.join()
    within = [t for t in seen if began < t < ended]
    # were the lock held, none would be seen before the check of the factors at the end
    assert len(within) > 0.1 * (ended - began) / 1e-3
