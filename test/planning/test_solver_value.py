"""The solver as a value: what its variants change, and that another method takes its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, FrozenInstanceError
from typing import Any

from factories import PlanFactory, TaskFactory
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.progress import Monitor
from flex_planner.collocation import solve, Solver, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.catalogue import CATALOGUE
from flex_planner.planning.strategies.strategy import Strategy
import pytest
from scipy_backend import CountingBackend, solve_by_scipy

# no two entries are those of the default, or beyond what a variant sets
FINE = SolverSettings(stages=5, intervals=30, max_intervals=1000, max_iterations=40,
                      error_tolerance=1e-7, max_meshes=10)
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


# Variants


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


# Other methods


@pytest.mark.parametrize('strategy', [
    each for each in CATALOGUE if each.name != 'direct collocation'], ids=lambda each: each.name)
def test_every_iteration_of_a_plan_is_made_by_its_backend(
        ei5_model: ArmModel, paper_task: TaskFactory, strategy: Strategy) -> None:
    backend, monitor = CountingBackend(), Monitor()
    plan = plan_path(paper_task(ei5_model.arm, w_2=10.0), model=ei5_model, monitor=monitor,
                     strategies=[strategy], solver=Solver(FINE, backend=backend))
    assert plan.solved, plan.message
    # a solve that went past it would count in the monitor alone
    assert backend.iterations == monitor.iteration == plan.iterations > 0
    assert all(watch is monitor for watch in backend.monitors)
    assert backend.settings[-1] == FINE  # whatever the way to it was


def test_weights_are_adapted_and_durations_freed_by_the_backend(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    for changes in ({'time_weight': 10.0}, {'payload_mass': 5.8, 'w_2': 200.0}):
        backend = CountingBackend()
        plan = plan_path(paper_task(rigid_model.arm, **changes), model=rigid_model,
                         solver=Solver(backend=backend))
        assert plan.solved, plan.message
        assert backend.iterations == plan.iterations


def test_only_a_warm_start_promises_its_error_to_the_backend(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory) -> None:
    cold, warm = CountingBackend(), CountingBackend()
    task = paper_task(rigid_model.arm)
    plan_path(task, model=rigid_model, solver=Solver(FINE, backend=cold))
    plan_path(task, model=rigid_model, solver=Solver(FINE, backend=warm),
              start_from=plan_of('rigid'))
    assert (cold.expected_errors[0], warm.expected_errors[0]) == (1.0, FINE.error_tolerance)


@pytest.mark.parametrize('w_2', [0.0, 10.0])
def test_solve_bvp_plans_the_rigid_arm_end_to_end(
        rigid_model: ArmModel, paper_task: TaskFactory, plan_of: PlanFactory, w_2: float) -> None:
    plan = plan_path(paper_task(rigid_model.arm, w_2=w_2), model=rigid_model,
                     solver=Solver(backend=solve_by_scipy))
    assert (plan.solved, plan.strategy) == (True, 'cold start'), plan.message
    # its tolerance of 1e-6 holds for the residual
    assert plan.cost == pytest.approx(plan_of('rigid', 1.0, w_2).cost, rel=1e-6)
    # nobody counted iterations, so none of ours were made
    assert plan.iterations == 0


def test_solve_bvp_is_stopped_by_the_monitor(rigid_model: ArmModel,
                                             paper_task: TaskFactory) -> None:
    plan = plan_path(paper_task(rigid_model.arm), model=rigid_model,
                     solver=Solver(backend=solve_by_scipy, monitor=Monitor(canceled=lambda: True)))
    assert (plan.message, plan.solution) == ('canceled', None)
