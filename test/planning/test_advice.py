"""What a plan that was not found says: what was tried, and what may help."""

from __future__ import annotations

from dataclasses import replace

from flex_planner import load_arm, plan_path, Task
from flex_planner.cli.request import say_failure
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.paper.cases import paper_arm, point_to_point
from flex_planner.planning.advice import suggest_changes
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import plan_problem
from flex_planner.planning.strategies.catalogue import QUICK
from flex_planner.reports.motion import plan_rows
import numpy as np
import pytest


def problem_of(task: Task) -> MotionProblem:
    """Return the problem of a task."""
    return MotionProblem(ArmModel.of(task.arm), task, task_parameters(task))


@pytest.fixture(scope='module')
def failed() -> Plan:
    """Return the outcome of quick strategies that do not solve a motion of clamped links."""
    task = point_to_point(paper_arm(5.0, 1, 'clamped_free'), 1.0)
    return plan_problem(problem_of(task), Solver(), QUICK)


def test_failure_says_what_may_help(failed: Plan) -> None:
    assert failed.status is PlanStatus.NOT_CONVERGED
    count = len(failed.strategy.split(', '))
    assert failed.message.startswith(
        'what may help: rotor_inertia and gear_ratio of the motors, a longer duration than 1 s '
        '(0.74 periods of the lowest vibration), damping of the links, less payload or '
        'velocity_weights, a price on fast bending; '
        f'{count} strategies found no motion; cold start: ')


def test_each_strategy_that_failed_has_a_line_in_the_terminal(failed: Plan) -> None:
    first, *lines = say_failure(failed, 60.0).split('\n')
    assert first.endswith(f'; {len(lines)} strategies found no motion')
    assert [line.split(': ')[0].strip() for line in lines] == failed.strategy.split(', ')


def test_failure_lists_what_was_tried_with_times_and_iterations(failed: Plan) -> None:
    names = [one.name for one in failed.tried]
    assert list(dict.fromkeys(names)) == failed.strategy.split(', ')
    assert all(one.seconds > 0 and one.iterations > 0 for one in failed.tried)
    assert sum(one.iterations for one in failed.tried) == failed.iterations
    assert all(one.outcome in failed.message for one in failed.tried[-1:])
    row = dict(plan_rows(failed))['tried']
    assert [part.split(' took')[0] for part in row.split(', ')] == failed.strategy.split(', ')


def test_plan_of_the_first_strategy_tried_nothing_else() -> None:
    plan = plan_path(point_to_point(paper_arm(np.inf), 1.0), search='fast')
    assert [one.outcome for one in plan.tried] == ['solved']
    assert 'tried' not in dict(plan_rows(plan))
    assert 'what may help' not in plan.message


def test_advice_names_only_what_an_arm_has() -> None:
    rigid = problem_of(replace(point_to_point(paper_arm(np.inf), 1.0), payload_mass=0.0))
    assert suggest_changes(rigid) == 'what may help: a longer duration than 1 s'
    two_modes = suggest_changes(problem_of(point_to_point(load_arm('korayem_ei50'), 1.0)))
    assert 'fewer modes per link than 2' in two_modes
    assert 'rotor_inertia' not in two_modes
