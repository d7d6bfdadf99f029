"""Direct collocation with a free payload: its optimum, its derivatives, its starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.collocation import solve, SolverSettings
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import (
    DirectProblem,
    DirectResult,
    DirectSettings,
    DirectStatus,
)
from flex_planner.optimal_control.direct.mesh import Mesh, SCHEMES
from flex_planner.optimal_control.direct.programme import Programme
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.free_payload import FreePayloadProblem
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
import numpy as np
from plan_checks import problem_of, solution_of
import pytest

TaskFactory = Callable[..., Task]

PRICE = 10.0
EVERY = pytest.mark.parametrize('scheme', SCHEMES)
# scheme: error of the payload at this price with 20 and 80 intervals, rounded up from 2.6e-4 and
# 3.3e-5, 1.1e-3 and 4.6e-5, 2.3e-3 and 7.4e-5: switches inside intervals leave no order
CONVERGING = [('gauss', 5e-4, 1e-4), ('radau', 2e-3, 1e-4), ('hermite_simpson', 4e-3, 2e-4)]


def free(problem: MotionProblem, intervals: int = 40, scheme: str = 'gauss') -> DirectProblem:
    return DirectProblem(problem.model, DirectSettings(
        intervals=intervals, scheme=scheme))


def solved(problem: MotionProblem, direct: DirectProblem, price: float = PRICE,
           warm: DirectResult | None = None) -> DirectResult:
    found = direct.solve(problem.parameters, problem.start, problem.goal, problem.task.duration,
                         free=Free.PAYLOAD, price=price, warm=warm)
    assert found.converged, found.message
    return found


@pytest.fixture(scope='module')
def motion(rigid_model: ArmModel, paper_task: TaskFactory) -> MotionProblem:
    return problem_of(rigid_model, paper_task(rigid_model.arm))


def worth(problem: MotionProblem, price: float) -> float:
    """Return the payload at a price by the indirect method."""
    # near it: from 5 kg on
    task = replace(problem.task, payload_mass=5.0)
    plan = plan_path(task, model=problem.model)
    settings = SolverSettings(error_tolerance=1e-8)
    ahead = FreePayloadProblem(
        MotionProblem(problem.model, task, plan.problem.parameters), price)
    found = solve(ahead, ahead.extend(solution_of(plan)), settings)
    assert found.converged, found.message
    return ahead.restrict(found.solution)[0]


# Optimum


@pytest.mark.parametrize(('scheme', 'coarse', 'fine'), CONVERGING)
def test_payload_converges_to_that_of_the_indirect_method(
        motion: MotionProblem, scheme: str, coarse: float, fine: float) -> None:
    payload = worth(motion, PRICE)
    assert payload == pytest.approx(5.811399, abs=5e-7)  # half the last digit
    errors = [abs(solved(motion, free(motion, intervals, scheme)).payload - payload)
              for intervals in (20, 80)]
    assert errors[1] < errors[0] < coarse
    assert errors[1] < fine


def test_payload_of_an_arm_that_bends_is_that_of_the_indirect_method(
        ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    problem = problem_of(ei5_model, paper_task(ei5_model.arm))
    found = solved(problem, free(problem))
    # 2e-4 by the mesh
    assert found.payload == pytest.approx(worth(problem, PRICE), abs=4e-4)


def test_payload_at_a_high_price_is_the_maximum(motion: MotionProblem) -> None:
    found = solved(motion, free(motion, 80), 1e4)
    limit = find_max_payload(motion.task, model=motion.model)
    # the mesh gives 3e-5
    assert limit.payload - 1e-4 < found.payload < limit.local_upper + 1e-4


def test_cost_is_that_of_the_payload_without_its_price(motion: MotionProblem) -> None:
    found = solved(motion, free(motion, 80))
    alone = plan_path(replace(motion.task, payload_mass=found.payload), model=motion.model)
    # what the mesh does to the payload, by its price: 3e-4
    assert found.cost == pytest.approx(alone.cost, abs=1e-3)
    fixed = DirectProblem(motion.model, DirectSettings(intervals=80)).solve(
        replace(motion.parameters, payload_mass=found.payload), motion.start, motion.goal, 1.0)
    assert fixed.payload == found.payload
    # the same programme where the payload is given
    assert found.cost == pytest.approx(fixed.cost, rel=1e-7)
    np.testing.assert_allclose(found.torques, fixed.torques, atol=1e-3)


def test_cost_of_more_payload_is_its_price(motion: MotionProblem) -> None:
    found, h = solved(motion, free(motion)), 1e-4
    fixed = DirectProblem(motion.model, DirectSettings(tolerance=1e-10))
    less, more = (fixed.solve(replace(motion.parameters, payload_mass=found.payload + change),
                              motion.start, motion.goal, 1.0).cost for change in (-h, h))
    # ten digits of the cost over the step; the price rises by a hundredth in so much payload
    assert (more - less) / (2 * h) == pytest.approx(PRICE, rel=1e-3)


def test_first_payload_does_not_matter(motion: MotionProblem) -> None:
    direct = free(motion)
    payloads = [
        direct.solve(replace(motion.parameters, payload_mass=first), motion.start, motion.goal,
                     1.0, free=Free.PAYLOAD, price=PRICE).payload for first in (0.0, 3.0, 9.0)]
    # IPOPT's tolerance of 1e-8
    np.testing.assert_allclose(payloads, payloads[0], rtol=1e-6)


def test_payload_that_is_not_worth_its_effort_is_none(motion: MotionProblem) -> None:
    # the first kilogram costs 0.36
    found = solved(motion, free(motion), 0.1)
    assert found.payload == pytest.approx(0.0, abs=1e-6)
    bare = plan_path(replace(motion.task, payload_mass=0.0), model=motion.model)
    assert found.cost == pytest.approx(bare.cost, rel=1e-4)


def test_unknowns_and_costates_keep_their_shapes(motion: MotionProblem) -> None:
    found, K = solved(motion, free(motion, 20)), 60
    assert found.torques.shape == (K, 2)
    assert found.states.shape == found.costates.shape == (21, 4)
    assert found.point_states.shape == found.point_costates.shape == (K, 4)
    np.testing.assert_allclose(found.states[[0, -1]], [motion.start, motion.goal], atol=1e-9)
    # optimal torques follow from the costates, with the payload found
    p = replace(motion.parameters, payload_mass=found.payload).stack()
    z = np.hstack([found.point_states, found.point_costates])
    np.testing.assert_allclose(motion.model.controls(z, p).torque, found.torques, atol=1e-3)


# Starts


def test_warm_start_at_the_next_price_takes_fewer_iterations(motion: MotionProblem) -> None:
    direct = free(motion)
    first = solved(motion, direct, 100.0)
    cold, warm = (solved(motion, direct, 150.0, start) for start in (None, first))
    assert warm.iterations < 0.7 * cold.iterations
    assert warm.payload == pytest.approx(cold.payload, abs=1e-7)
    assert warm.payload > first.payload


def test_search_is_stopped_and_can_be_made_again(motion: MotionProblem) -> None:
    direct = free(motion, 20)
    data = motion.parameters, motion.start, motion.goal, 1.0
    stopped = direct.solve(*data, free=Free.PAYLOAD, price=PRICE, monitor=Monitor(time_limit=0.0))
    assert (stopped.status, stopped.message) == (DirectStatus.STOPPED, 'time limit reached')
    assert direct.solve(*data, free=Free.PAYLOAD, price=PRICE).converged


def test_impossible_motion_fails_with_a_free_payload(motion: MotionProblem) -> None:
    # it takes 0.536 s without payload
    found = free(motion, 20).solve(motion.parameters, motion.start, motion.goal, 0.4,
                                   free=Free.PAYLOAD, price=PRICE)
    assert found.status is DirectStatus.FAILED


# Derivatives


def derivatives(arm: Arm, scheme: str,
                with_rates: bool = False) -> dict[str, tuple[Array, Array]]:
    """Return the programme's derivatives and CasADi's own of its expressions, at some point."""
    programme = Programme.of(arm, Mesh.of(scheme, 2, 3).transcription(),
                             with_rates=with_rates)
    x, p, f, g = (programme.expressions[name] for name in ('x', 'p', 'f', 'g'))
    s, multipliers = ca.MX.sym('s'), ca.MX.sym('lambda', g.numel())
    lagrangian = ca.triu(ca.hessian(s * f + ca.dot(multipliers, g), x)[0])
    own = ca.Function('own', [x, p, s, multipliers], [ca.gradient(f, x), ca.jacobian(g, x),
                                                      lagrangian])
    random = np.random.default_rng(7)
    point = [random.uniform(0.2, 1.5, each.numel()) for each in (x, p, s, multipliers)]
    ours = (programme.derivatives['grad_f'](*point[:2])[1],
            programme.derivatives['jac_g'](*point[:2])[1],
            programme.derivatives['hess_lag'](*point))
    return {name: (np.array(mine), np.array(theirs)) for name, mine, theirs in zip(
        ('gradient', 'jacobian', 'hessian'), ours, own(*point), strict=True)}


@EVERY
def test_derivatives_are_those_of_the_expressions(single_mode_arm: Arm, scheme: str) -> None:
    for name, (ours, own) in derivatives(single_mode_arm, scheme).items():
        assert ours.shape == own.shape
        # rounding
        np.testing.assert_allclose(ours, own, atol=1e-12 * np.abs(own).max(), err_msg=name)


@pytest.mark.parametrize('with_rates', [False, True])
def test_derivatives_of_an_arm_that_has_everything(workshop_arm: Arm, with_rates: bool) -> None:
    for name, (ours, own) in derivatives(workshop_arm, 'gauss', with_rates).items():
        np.testing.assert_allclose(ours, own, atol=1e-11 * np.abs(own).max(), err_msg=name)


def test_payload_and_duration_are_the_last_unknowns(rigid_arm: Arm) -> None:
    found = derivatives(rigid_arm, 'gauss')
    by_payload, by_duration = found['jacobian'][0][:, -2:].T
    # eq. (3) has the payload at each of 6 points, the mesh has the duration
    assert not by_payload[:-12].any()
    assert by_payload[-12:].all()
    assert by_duration[:-12].any()
    assert not by_duration[-12:].any()
    # linear in the cost, and in the rows
    assert found['gradient'][0][-2] < 0
    assert not found['hessian'][0][-2:, -2:].any()
    assert found['hessian'][0][:-2, -2].any()
    assert found['hessian'][0][:-2, -1].any()
