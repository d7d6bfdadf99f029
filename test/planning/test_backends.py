"""Plans by another method than ours: each of their problems is solved by it."""

from __future__ import annotations

from factories import PlanFactory, TaskFactory
from flex_planner.base.progress import Monitor
from flex_planner.collocation import Solver
from flex_planner.collocation.core import CORE_VARIABLE
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.catalogue import CATALOGUE
from flex_planner.planning.strategies.strategy import Strategy
import pytest
from scipy_backend import CountingBackend, FINE, solve_by_scipy

# by IPOPT, by our own method alone, and without via points or Coulomb friction not at all
OTHERS = ('direct collocation', 'kinds of motion', 'interior point',
          'interior point from the rigid motion', 'homotopy in via points',
          'homotopy in Coulomb friction', 'homotopy in a price on bending')


@pytest.mark.parametrize('strategy', [
    each for each in CATALOGUE if each.name not in OTHERS], ids=lambda each: each.name)
def test_every_iteration_of_a_plan_is_made_by_its_backend(
        ei5_model: ArmModel, paper_task: TaskFactory, strategy: Strategy) -> None:
    backend, monitor = CountingBackend(), Monitor()
    plan = plan_path(paper_task(ei5_model.arm, w_2=10.0), model=ei5_model, monitor=monitor,
                     strategies=[strategy], solver=Solver(FINE, backend=backend), search='fast')
    assert plan.solved, plan.message
    # a solve that went past it would count in the monitor alone
    assert backend.iterations == monitor.iteration == plan.iterations > 0
    assert all(getattr(watch, 'whole', watch) is monitor for watch in backend.monitors)
    assert backend.settings[-1] == FINE  # whatever the way to it was


def test_cheaper_kinds_are_looked_for_by_the_backend(ei5_model: ArmModel,
                                                     paper_task: TaskFactory) -> None:
    backend, monitor = CountingBackend(), Monitor()
    plan = plan_path(paper_task(ei5_model.arm), model=ei5_model, monitor=monitor,
                     solver=Solver(FINE, backend=backend))
    assert plan.starts > 1
    assert backend.iterations == monitor.iteration == plan.iterations
    assert all(getattr(watch, 'whole', watch) is monitor for watch in backend.monitors)
    # coarse meshes for the other kinds, within the limit
    assert min(each.intervals for each in backend.settings) < FINE.intervals
    assert max(each.max_intervals for each in backend.settings) == FINE.max_intervals


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


@pytest.mark.parametrize('payload', [1.0, 5.5])
def test_plan_by_numpy_is_that_by_the_core(ei50_model: ArmModel, paper_task: TaskFactory,
                                           monkeypatch: pytest.MonkeyPatch,
                                           payload: float) -> None:
    task = paper_task(ei50_model.arm, payload_mass=payload)
    compiled = plan_path(task, model=ei50_model, search='fast')
    monkeypatch.setenv(CORE_VARIABLE, 'numpy')
    by_numpy = plan_path(task, model=ei50_model, search='fast')
    assert compiled.solved
    assert by_numpy.cost == pytest.approx(compiled.cost, rel=1e-10)
    assert by_numpy.mesh_intervals == compiled.mesh_intervals
