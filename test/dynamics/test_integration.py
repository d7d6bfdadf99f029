"""The compiled integrator against SciPy's, under planned torques."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from applied_torques import Case, every_case, torque_of
from factories import PlanFactory
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.base import compiler
from flex_planner.base.progress import Monitor, StoppedError, StopReason
from flex_planner.base.validation import Array
from flex_planner.dynamics import integration
from flex_planner.dynamics.arm_dynamics import RUNGE_KUTTA_STAGES
from flex_planner.dynamics.integration import integrate, PiecewisePolynomial, simulate
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.planned_torque import PlannedTorque
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.plan import Plan
import numpy as np
import pytest
from scipy.integrate import DOP853


def by_scipy(plan: Plan, torque: PlannedTorque) -> Array:
    """Return the end by SciPy, from piece to piece: it must not step over a corner."""
    state, breaks = plan.problem.start, torque.pieces.breaks
    for start, end in zip(breaks, breaks[1:], strict=False):
        state = simulate(plan.model, plan.problem.parameters.physical, state,
                         lambda t, start=start: torque(start + t), end - start,  # type: ignore
                         rtol=1e-12, atol=1e-14)
    return state


def end_of(plan: Plan, torque: PlannedTorque, rtol: float, model: ArmModel | None = None,
           monitor: Monitor | None = None) -> Array:
    return integrate(model or plan.model, plan.problem.parameters.physical, plan.problem.start,
                     torque, monitor, rtol=rtol, atol=rtol / 100)[-1]


# One step


def dormand_prince(rate: Callable[[Array, Array], Array], x: Array, torques: Array,
                   h: float) -> tuple[tuple[Array, Array, Array], Array]:
    """Return the next state with two error estimates, and the slopes, by SciPy's tableau."""
    slopes = np.zeros((13, x.size))
    for i, u in enumerate(torques):
        slopes[i] = rate(x + h * DOP853.A[i, :i] @ slopes[:i], u)
    following = x + h * DOP853.B @ slopes[:12]
    slopes[12] = rate(following, torques[-1])
    return (following, h * DOP853.E5 @ slopes, h * DOP853.E3 @ slopes), slopes


@pytest.mark.parametrize('name', ['rigid', 'ei5', 'crane'])
def test_steps_are_those_of_dormand_and_prince(request: pytest.FixtureRequest,
                                               name: str) -> None:
    model: ArmModel = request.getfixturevalue(f'{name}_model')
    n_t, h, rng = model.arm.n_coordinates, 2e-3, np.random.default_rng(0)
    p = Parameters.of(model.arm, payload_mass=1.0, payload_inertia=0.1).physical
    x = rng.normal(size=2 * n_t) * np.repeat([0.1, 1.0], n_t)
    torques = rng.normal(size=(3, RUNGE_KUTTA_STAGES, 2))
    found = model.runge_kutta_steps(p)(x, torques.reshape(3, -1), h)
    for k, at_stages in enumerate(torques):
        expected, slopes = dormand_prince(model.state_rate(p), x, at_stages, h)
        for one, other in zip(found, expected, strict=True):
            # rounding of accelerations up to 1e4
            np.testing.assert_allclose(one[k], other, rtol=1e-13,
                                       atol=1e-13 * np.abs(h * slopes).max())
        x = expected[0]


def test_step_is_of_eighth_order(ei5_model: ArmModel) -> None:
    p = Parameters.of(ei5_model.arm, payload_mass=1.0).physical
    x = np.concatenate([[0.3, 0.8, 0.01, 0, -0.01, 0], np.full(6, 0.1)])

    def end(count: int) -> Array:
        torques = np.tile([1.0, -2.0], (count, RUNGE_KUTTA_STAGES))
        return ei5_model.runge_kutta_steps(p)(x, torques, 0.04 / count)[0][-1]

    exact = end(64)
    coarse, fine = (np.abs(end(count) - exact).max() for count in (4, 8))
    assert 2**7 < coarse / fine < 2**9.5


# A whole motion


@every_case
def test_end_is_that_of_scipy(any_plan: Callable[[Case], Plan], case: Case) -> None:
    plan = any_plan(case)
    torque = torque_of(plan)
    expected = by_scipy(plan, torque)
    for rtol in (1e-6, 1e-8, 1e-10):
        # a hundred steps, whose errors mostly cancel
        np.testing.assert_allclose(end_of(plan, torque, rtol), expected, rtol=0, atol=rtol)
    # of SciPy
    np.testing.assert_allclose(end_of(plan, torque, 1e-12), expected, rtol=0, atol=2e-11)


def test_end_is_that_of_scipy_in_one_go_where_no_motor_switches(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid')
    torque = torque_of(plan)
    expected = simulate(plan.model, plan.problem.parameters.physical, plan.problem.start, torque,
                        1.0, rtol=1e-12,
                        atol=1e-14)
    np.testing.assert_allclose(end_of(plan, torque, 1e-12), expected, rtol=0, atol=1e-11)


def test_another_start_is_followed(plan_of: PlanFactory) -> None:
    plan = plan_of('ei5')
    torque, start = torque_of(plan), plan.problem.start + 1e-3
    end = integrate(plan.model, plan.problem.parameters.physical, start, torque, rtol=1e-11,
                    atol=1e-13)[-1]
    expected = simulate(plan.model, plan.problem.parameters.physical, start, torque, 1.0,
                        rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(end, expected, rtol=0, atol=1e-9)
    assert np.abs(end - plan.problem.goal).max() > 1e-3


@pytest.mark.parametrize('payload', [1.0, 5.5])
def test_loop_in_c_is_that_in_python(plan_of: PlanFactory, monkeypatch: pytest.MonkeyPatch,
                                     payload: float) -> None:
    plan = plan_of('ei5', payload)
    torque = torque_of(plan)
    for rtol in (1e-6, 1e-10):
        found = end_of(plan, torque, rtol)
        with monkeypatch.context() as patch:
            patch.setattr(integration, 'cross_intervals', lambda *given, **more: False)
            expected = end_of(plan, torque, rtol)
        # the same steps, but for rounding
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_interpreted_functions_lead_to_the_same_end(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, plan_of: PlanFactory,
        rigid_arm: Arm) -> None:
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    monkeypatch.setattr(compiler.shutil, 'which', lambda name: None)
    plan, interpreted = plan_of('rigid', 5.5), ArmModel(rigid_arm)
    torque = torque_of(plan)
    # rounding: the C compiler may fuse a multiplication and an addition
    np.testing.assert_allclose(end_of(plan, torque, 1e-8, interpreted),
                               end_of(plan, torque, 1e-8), rtol=0, atol=1e-12)
    assert not list(tmp_path.iterdir())


def test_hanging_arm_swings_as_scipy_has_it() -> None:
    # without torques, under gravity
    model = ArmModel(load_arm('korayem_hanging'))
    p = Parameters.of(model.arm, payload_mass=0.5).physical
    start = np.zeros(12)
    start[:2] = -1.5, -0.5
    breaks = np.linspace(0, 0.4, 5)
    pieces = PiecewisePolynomial(breaks, np.zeros((4, 1, 4)))
    limits = TorqueLimits(np.full(2, np.inf), np.zeros(2), np.full(2, np.inf))
    still = PlannedTorque(pieces, limits)
    expected = simulate(model, p, start, still, 0.4, rtol=1e-12, atol=1e-14)
    end = integrate(model, p, start, still, rtol=1e-11, atol=1e-13)[-1]
    np.testing.assert_allclose(end, expected, rtol=0, atol=1e-10)


# What goes wrong


def test_motion_that_runs_away_is_not_a_number(plan_of: PlanFactory) -> None:
    plan = plan_of('ei5')
    torque = torque_of(plan)
    pieces = replace(torque.pieces, coefficients=1e30 * torque.pieces.coefficients)
    wild = replace(torque, pieces=pieces,
                   limits=TorqueLimits(np.full(2, np.inf), torque.limits.slope,
                                       np.full(2, np.inf)))
    tries: list[bool] = []
    monitor = Monitor(canceled=lambda: bool(tries.append(False)))  # asked before every try
    assert np.isnan(end_of(plan, wild, 1e-8, monitor=monitor)).all()
    # 1, 5, ..., 3125 steps in the first interval, and 15625 are too many
    assert len(tries) == 7


def test_torque_that_is_not_a_number_gives_none(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid')
    torque = torque_of(plan)
    pieces = replace(torque.pieces, coefficients=np.nan * torque.pieces.coefficients)
    assert np.isnan(end_of(plan, replace(torque, pieces=pieces), 1e-8)).all()


@pytest.mark.parametrize(('limit', 'reason'), [
    (float('inf'), StopReason.CANCELED), (-1.0, StopReason.TIMEOUT)])
def test_monitor_stops_it(plan_of: PlanFactory, limit: float, reason: StopReason) -> None:
    plan, checks = plan_of('ei5'), [0]

    def canceled() -> bool:
        checks[0] += 1
        return checks[0] > 10 and reason is StopReason.CANCELED

    with pytest.raises(StoppedError) as caught:
        end_of(plan, torque_of(plan), 1e-8, monitor=Monitor(canceled=canceled, time_limit=limit))
    assert caught.value.reason is reason


def test_monitor_is_asked_in_every_interval(plan_of: PlanFactory) -> None:
    plan, checks = plan_of('ei5'), [0]

    def canceled() -> bool:
        checks[0] += 1
        return False

    end_of(plan, torque_of(plan), 1e-8, monitor=Monitor(canceled=canceled))
    assert checks[0] >= plan.mesh_intervals


# Polynomials


def test_piecewise_polynomial_passes_through_its_values_in_every_piece() -> None:
    breaks, theta = np.array([0.0, 0.1, 0.4, 1.0]), np.array([0.0, 0.3, 1.0])
    values = np.random.default_rng(0).normal(size=(3, 3, 2))
    function = PiecewisePolynomial.through(breaks, theta, values)
    for piece in range(3):
        times = breaks[piece] + np.diff(breaks)[piece] * np.array([1e-12, 0.3, 1 - 1e-12])
        # slopes of up to 1e2 over a hundredth of a billionth
        np.testing.assert_allclose([function(t) for t in times], values[piece], atol=1e-9)
    np.testing.assert_allclose(function(1.0), values[-1, -1], atol=1e-14)  # rounding
