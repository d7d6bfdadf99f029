"""Compiled linear systems obey their monitor."""

from __future__ import annotations

import time

from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.collocation import GaussRule
from flex_planner.collocation.compiled_system import CompiledSystem, factorise_system
from flex_planner.collocation.linear import LinearSystem, Residual
import numpy as np
import pytest

RULE, COUNT = GaussRule.of(3), 16
# longer than core.c waits between two questions [s]
PATIENCE = 6e-3


def factorise(monitor: Monitor | None, *, exact: bool = True) -> LinearSystem:
    """Return x'' = 0 with x given at both ends."""
    rate = np.array([[0.0, 1.0], [0.0, 0.0]])
    shape = (COUNT, 3, 2, 2) if exact else (COUNT, 2, 2)
    return factorise_system(RULE, np.full(COUNT, 1 / COUNT), np.broadcast_to(rate, shape),
                            np.array([[1.0, 0.0]]), np.array([[1.0, 0.0]]), np.ones(2),
                            np.array([], dtype=np.intp), monitor=monitor)


RESIDUAL = Residual(np.zeros((COUNT, 3, 2)), np.zeros((COUNT, 2)), np.zeros(1), -np.ones(1))


@pytest.mark.parametrize('exact', [True, False])
def test_a_monitor_stops_a_factorisation(exact: bool) -> None:
    with pytest.raises(StoppedError, match='canceled'):
        factorise(Monitor(canceled=lambda: True), exact=exact)


def test_what_a_monitor_raises_comes_out_of_compiled_code() -> None:
    def fail() -> bool:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        factorise(Monitor(canceled=fail))


def test_a_monitor_stops_a_correction() -> None:
    stopped = False
    system = factorise(Monitor(canceled=lambda: stopped))
    stopped = True
    time.sleep(PATIENCE)
    with pytest.raises(StoppedError):
        system.correction(RESIDUAL)


def test_a_watched_system_finds_the_same_corrections() -> None:
    systems = [factorise(monitor) for monitor in (None, Monitor())]
    assert all(isinstance(system, CompiledSystem) for system in systems)
    free, watched = (system.correction(RESIDUAL) for system in systems)
    np.testing.assert_array_equal(free[0], watched[0])
    np.testing.assert_allclose(free[0][:, 0], np.linspace(0, 1, COUNT + 1), atol=1e-14)


def test_another_rule_is_watched_too() -> None:
    with pytest.raises(StoppedError):
        factorise(None).with_rule(GaussRule.of(4), Monitor(canceled=lambda: True))
