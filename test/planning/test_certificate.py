"""The certificate: what it finds, and what its limits refuse."""

from __future__ import annotations

from copy import copy
from dataclasses import fields, replace
import math

from factories import PlanFactory
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.progress import Monitor
from flex_planner.collocation import CollocationResult, CollocationSolution, SolverStatus
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.certificate import (
    Certificate,
    CertificateLimits,
    certify,
    hamiltonian_drift,
)
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
from plan_checks import solution_of
import pytest

Case = tuple[str, float, float]


def altered(plan: Plan, factor: float) -> CollocationResult:
    """Return a plan's solution with other costates, as a solver in error would."""
    solution, half = solution_of(plan), plan.problem.size // 2
    nodes, stages = solution.nodes.copy(), solution.stages.copy()
    nodes[:, half:] *= factor
    stages[..., half:] *= factor
    return CollocationResult(
        solution=CollocationSolution(solution.mesh, nodes, stages, solution.rule),
        status=SolverStatus.CONVERGED, residual=1e-9, errors=np.zeros(plan.problem.size),
        switches=np.zeros(0), iterations=1, meshes=1, message='')


@pytest.mark.parametrize('case', [('rigid', 1.0, 0.0), ('ei5', 1.0, 0.0)], ids=str)
def test_certificate_finds_an_error_of_a_thousandth(plan_of: PlanFactory, case: Case) -> None:
    plan = plan_of(*case)
    right, wrong = (certify(plan.problem, altered(plan, factor), Monitor())
                    for factor in (1.0, 1.001))
    assert right.tip_error == pytest.approx(plan.certificate.tip_error, rel=1e-6)
    assert CertificateLimits().violations(right) == []
    # 0.1 % less torque moves the arm by 0.1 % of ~0.5 m
    assert 1e-4 < wrong.tip_error < 1e-3
    assert any(text.startswith('tip error is ') for text in CertificateLimits().violations(wrong))


def test_drift_finds_wrong_costates(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid')
    assert hamiltonian_drift(plan.problem, altered(plan, 1.0).solution) < 1e-14
    assert hamiltonian_drift(plan.problem, altered(plan, 1.1).solution) > 0.02


def test_solution_of_another_duration_is_not_certified(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid')
    longer = replace(plan.task, duration=1.1)
    problem = type(plan.problem)(plan.model, longer, plan.problem.parameters)
    with pytest.raises(ValueError, match='does not last as long as its task'):
        certify(problem, altered(plan, 1.0), Monitor())


@pytest.mark.parametrize('name', ['boundary_error', 'hamiltonian_drift', 'tip_error',
                                  'residual_vibration'])
@pytest.mark.parametrize('value', [math.inf, math.nan, 1.0])
def test_limits_name_what_they_refuse(name: str, value: float) -> None:
    perfect = Certificate(**{entry.name: 0.0 for entry in fields(Certificate)})
    limits = CertificateLimits()
    assert limits.violations(perfect) == []
    at_limit = replace(perfect, **{name: getattr(limits, name)})
    assert limits.violations(at_limit) == []
    (sentence,) = limits.violations(replace(perfect, **{name: value}))
    assert sentence.startswith(f'{name.replace("_", " ")} is {value:.3g}, but must be <= ')


def test_certificate_of_a_plan_without_solution_is_infinite() -> None:
    found = {entry.name: getattr(Certificate(), entry.name) for entry in fields(Certificate)}
    assert found.pop('limit_slack') == -math.inf  # infinite is without limits
    assert set(found.values()) == {math.inf}


@pytest.fixture(scope='module')
def to_a_point(crane_model: ArmModel) -> Plan:
    """Return a motion under gravity between points."""
    return plan_path(Task.between_points(crane_model.arm, (0.1, -0.8), (0.3, -0.75), elbow=1,
                                         duration=1.2, payload_mass=0.2), model=crane_model)


def test_tip_of_a_plan_under_gravity_rests_at_the_point(to_a_point: Plan) -> None:
    plan = to_a_point
    assert plan.solved, plan.message
    for time, point in ((0.0, (0.1, -0.8)), (1.2, (0.3, -0.75))):
        q, _ = equilibrium(plan.model, plan.sample(time).coordinates[0, :2],
                           plan.problem.parameters)
        np.testing.assert_allclose(tip_position(plan.arm, q), point, rtol=0, atol=1e-6)
    unbent = np.concatenate([plan.task.goal_positions, np.zeros(3)])
    missed, _ = equilibrium(plan.model, unbent[:2], plan.problem.parameters)
    assert np.linalg.norm(tip_position(plan.arm, missed) - (0.3, -0.75)) > 5e-3


def test_tip_error_is_measured_from_the_point(to_a_point: Plan) -> None:
    plan = to_a_point
    result = altered(plan, 1.0)
    assert certify(plan.problem, result, Monitor()).tip_error < 1e-8
    problem = copy(plan.problem)
    problem.task = replace(plan.task, goal_point=plan.task.goal_point + [3e-4, 4e-4])
    assert certify(problem, result, Monitor()).tip_error == pytest.approx(5e-4, rel=1e-3)
    # without a point, and where the tip may end beside it at a price, the goal is the state
    for changes in ({'goal_point': []}, {'goal_position_weights': [1.0, 1.0]}):
        problem.task = replace(problem.task, **changes)  # type: ignore[arg-type]
        assert certify(problem, result, Monitor()).tip_error < 1e-8
