"""The solver as a value: what its variants change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, FrozenInstanceError
from typing import Any

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import solve, Solver, SolverSettings
import pytest
from scipy_backend import CountingBackend, FINE

Variant = Callable[[Solver], Solver]
VARIANTS: dict[str, tuple[Variant, dict[str, Any]]] = {
    'loose': (Solver.loose, {'error_tolerance': 0.05}),
    'cheap': (Solver.cheap, {'error_tolerance': 0.05, 'max_iterations': 15}),
    'coarse': (Solver.coarse, {'error_tolerance': 1e-2, 'max_iterations': 25}),
    'coarse to 1e-4': (lambda solver: solver.coarse(1e-4),
                       {'error_tolerance': 1e-4, 'max_iterations': 25}),
    'coarse to 1': (lambda solver: solver.coarse(1.0),
                    {'error_tolerance': 1e-2, 'max_iterations': 25}),
    'coarse to 1e-9': (lambda solver: solver.coarse(1e-9), {'max_iterations': 25}),
    'patient': (lambda solver: solver.patient(7), {'max_iterations': 7}),
    'patient beyond its limit': (lambda solver: solver.patient(50), {}),
    'with_settings': (lambda solver: solver.with_settings(stages=4, max_meshes=3),
                      {'stages': 4, 'max_meshes': 3})}
every_variant = pytest.mark.parametrize(('variant', 'changes'), VARIANTS.values(), ids=VARIANTS)


@every_variant
def test_variant_changes_only_what_it_says(variant: Variant, changes: dict[str, Any]) -> None:
    solver = Solver(FINE, Monitor(), CountingBackend())
    found = variant(solver)
    assert asdict(found.settings) == {**asdict(FINE), **changes}
    assert found.monitor is solver.monitor
    assert found.backend is solver.backend
    assert solver.settings is FINE


@pytest.mark.parametrize('variant', [Solver.loose, Solver.cheap, Solver.coarse,
                                     lambda solver: solver.coarse(1e-4)])
def test_variant_of_a_solver_that_is_looser_still_stays_as_loose(variant: Variant) -> None:
    # and as impatient: a variant never asks for more work than the solver itself
    found = variant(Solver(SolverSettings(error_tolerance=0.5, max_iterations=3))).settings
    assert (found.error_tolerance, found.max_iterations) == (0.5, 3)


def test_solver_watched_by_another_monitor_is_otherwise_the_same() -> None:
    solver, monitor = Solver(FINE, Monitor(), CountingBackend()), Monitor()
    found = solver.watched_by(monitor)
    assert found.monitor is monitor
    assert (found.settings, found.backend) == (FINE, solver.backend)
    assert solver.monitor is not monitor
    assert solver.watched_by(None) is solver


@pytest.mark.parametrize('name', ['settings', 'monitor', 'backend', 'other'])
def test_solver_cannot_be_changed(name: str) -> None:
    solver = Solver()
    # slots of a frozen class refuse unknown names in their own way
    with pytest.raises((FrozenInstanceError, TypeError)):
        setattr(solver, name, None)
    with pytest.raises(FrozenInstanceError):
        solver.settings.stages = 3  # type: ignore[misc]


def test_solver_is_our_collocation_unless_told_otherwise() -> None:
    first, second = Solver(), Solver()
    assert (first.settings, first.backend) == (SolverSettings(), solve)
    # each is watched by a monitor of its own: counts do not mix
    assert first.monitor is not second.monitor


def test_settings_out_of_bounds_are_refused_however_they_are_set() -> None:
    with pytest.raises(InvalidValueError, match='max_iterations is 0'):
        Solver().patient(0)
    with pytest.raises(InvalidValueError, match='error_tolerance is 2'):
        Solver().with_settings(error_tolerance=2.0)
