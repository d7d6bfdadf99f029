"""Rates with a free payload or duration as machine code: those of the problems in Python."""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from typing import Any

from flex_planner.collocation.problem import CompiledRate
from flex_planner.optimal_control.free_duration import FreeDurationProblem
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.planning.plan import Plan
import numpy as np
from numpy.typing import NDArray
import pytest

Array = NDArray[np.float64]
ADDRESSES = ctypes.POINTER(ctypes.c_void_p)
FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_longlong, ctypes.c_int, ADDRESSES, ADDRESSES)


def call(address: int, rate: CompiledRate, z: Array, outputs: list[Array]) -> list[Array]:
    """Call machine code as core.c does."""
    given = [np.ascontiguousarray(z), *rate.shared]
    pointers = [(ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))
                for arrays in (given, outputs)]
    assert FUNCTION(address)(len(z), 0, *pointers) == 0
    return outputs


@pytest.mark.parametrize('name', ['rigid', 'ei5', 'crane'])
@pytest.mark.parametrize('kind', [FreePayloadProblem, FreeDurationProblem, None])
def test_machine_code_is_the_problem(saturated: Callable[[str], Plan], name: str,
                                     kind: Any) -> None:
    motion = saturated(name).problem
    problem = kind(motion, 2.0) if kind else motion
    rng = np.random.default_rng(0)
    z = np.tile(motion.start[0] + rng.uniform(-0.1, 0.1, problem.size), (3, 1))
    # the payload or the duration is the same at all points of an iterate
    z[:, :motion.size // 2] += rng.uniform(-0.01, 0.01, (3, motion.size // 2))
    z[:, motion.size:] = 0.7
    compiled = problem.compiled_rate()
    assert compiled is not None, 'there is no C compiler'
    expected, slopes = problem.rate_jacobian(np.zeros(3), z)
    [alone] = call(compiled.rate, compiled, z, [np.empty_like(z)])
    rate, jacobian = call(compiled.rate_jacobian, compiled, z,
                          [np.empty_like(z), np.empty_like(slopes)])
    for found in (alone, rate):
        np.testing.assert_allclose(found, expected, rtol=1e-13)  # the same expressions
    np.testing.assert_allclose(jacobian, slopes, rtol=1e-13)
