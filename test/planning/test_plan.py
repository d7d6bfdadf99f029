"""A plan as a value: shown, sampled, pickled, saved and loaded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
import os
from pathlib import Path
import pickle
import subprocess
import sys

from factories import PlanFactory
from flex_planner.base.errors import InvalidValueError, ValueFileError
from flex_planner.base.progress import Monitor
from flex_planner.base.value_files import save_value
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.objectives import Objectives
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
import numpy as np
import pytest

Copy = Callable[[Plan, Path], Plan]


def pickled(plan: Plan, folder: Path) -> Plan:
    copy = pickle.loads(pickle.dumps(plan))
    assert isinstance(copy, Plan)
    return copy


def saved(plan: Plan, folder: Path) -> Plan:
    plan.save(folder / 'motion.plan')
    return Plan.load(folder / 'motion.plan')


copies = pytest.mark.parametrize('copy', [pickled, saved])


@copies
@pytest.mark.parametrize('name', ['rigid', 'ei50'])
def test_copy_says_and_moves_as_the_plan(plan_of: PlanFactory, tmp_path: Path, copy: Copy,
                                         name: str) -> None:
    plan = plan_of(name, 5.5)
    other = copy(plan, tmp_path)
    assert repr(other) == repr(plan)
    assert (other.status, other.strategy, other.cost) == (plan.status, plan.strategy, plan.cost)
    assert other.certificate == plan.certificate
    ours, theirs = plan.uniform_samples(33), other.uniform_samples(33)
    for field in fields(ours):
        np.testing.assert_array_equal(getattr(theirs, field.name), getattr(ours, field.name))


@copies
def test_copy_is_a_start_for_another_plan(plan_of: PlanFactory, tmp_path: Path,
                                          copy: Copy) -> None:
    plan = plan_of('rigid')
    again = plan_path(plan.task, start_from=copy(plan, tmp_path))
    assert (again.solved, again.strategy) == (True, 'warm start')
    assert again.cost == pytest.approx(plan.cost, rel=1e-9)


@copies
def test_failure_can_be_kept_too(plan_of: PlanFactory, rigid_model: ArmModel, tmp_path: Path,
                                 copy: Copy) -> None:
    failed = plan_path(plan_of('rigid').task, model=rigid_model,
                       monitor=Monitor(canceled=lambda: True))
    other = copy(failed, tmp_path)
    assert (other.status, other.solution, other.cost) == (PlanStatus.CANCELED, None, np.inf)
    with pytest.raises(ValueError, match='the plan has no solution: canceled'):
        other.sample([0.0])


@copies
def test_objectives_are_kept(plan_of: PlanFactory, rigid_model: ArmModel, tmp_path: Path,
                             copy: Copy) -> None:
    plan = plan_path(plan_of('rigid').task, model=rigid_model,
                     objectives=Objectives(max_joint_speeds=[0.9, 0.9]))
    other = copy(plan, tmp_path)
    assert plan.objectives is not None
    assert other.objectives is not None
    assert repr(other.objectives.margins) == repr(plan.objectives.margins)
    assert len(other.objectives.trials) == len(plan.objectives.trials)


def test_saved_plan_is_read_without_compiled_functions(plan_of: PlanFactory,
                                                       tmp_path: Path) -> None:
    plan = plan_of('ei50')
    plan.save(tmp_path / 'motion.plan')
    code = ('import sys; sys.modules["casadi"] = None\n'
            'from flex_planner import Plan\n'
            f'plan = Plan.load({str(tmp_path / "motion.plan")!r})\n'
            'print(plan.cost, plan.solution(plan.solution.mesh[-1:])[0, 0])')
    empty = tmp_path / 'cache'
    empty.mkdir()
    run = subprocess.run([sys.executable, '-c', code], text=True, capture_output=True,
                         env={**os.environ, 'XDG_CACHE_HOME': str(empty), 'CC': '/nowhere'})
    assert run.stderr == ''
    assert plan.solution is not None
    assert run.stdout.split() == [repr(plan.cost), str(plan.solution.nodes[-1, 0])]
    assert list(empty.iterdir()) == []


def test_file_of_something_else_is_no_plan(plan_of: PlanFactory, tmp_path: Path) -> None:
    save_value(tmp_path / 'task', plan_of('rigid').task)
    with pytest.raises(ValueFileError, match='holds a Task, but must hold a Plan'):
        Plan.load(tmp_path / 'task')


def test_plan_is_shown_in_a_line(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid')
    assert repr(plan) == (f'<Plan SOLVED: {plan.arm.name}, 1 s, 1 kg, J = {plan.cost:.6g}>')
    assert repr(replace(plan, solution=None, status=PlanStatus.TIMEOUT)) == (
        f'<Plan TIMEOUT: {plan.arm.name}, 1 s, 1 kg>')


@pytest.mark.parametrize(('times', 'sentence'), [
    ([0.0, 1.001], r'times\[1\] is 1\.001, but must be from 0 to 1 s'),
    ([-0.1], r'times\[0\] is -0\.1, but must be from 0 to 1 s'),
    ([0.5, np.nan], r'times\[1\] is nan, but must be from 0 to 1 s'),
    (np.inf, r'times\[0\] is inf, but must be from 0 to 1 s')])
def test_time_outside_the_motion_is_an_error(plan_of: PlanFactory, times: object,
                                             sentence: str) -> None:
    with pytest.raises(InvalidValueError, match=sentence):
        plan_of('rigid').sample(times)  # type: ignore[arg-type]


def test_rounding_at_the_ends_is_none(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid')
    found, exact = plan.sample([-1e-16, 1 + 2e-16]), plan.sample([0, 1])
    np.testing.assert_array_equal(found.torques, exact.torques)


@pytest.mark.parametrize('times', ['soon', [[0.1]], {}, [None, 'x']])
def test_times_that_are_no_list_of_numbers_are_an_error(plan_of: PlanFactory,
                                                        times: object) -> None:
    with pytest.raises(InvalidValueError, match='times is .*, but must be a list of numbers'):
        plan_of('rigid').sample(times)  # type: ignore[arg-type]
