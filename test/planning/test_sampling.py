"""Samples of a plan, as a controller gets them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from factories import PlanFactory
from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidTaskError, InvalidValueError, NotFiniteError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.execution import Execution
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.point_times import point_times
from flex_planner.planning.published_motion import PublishedMotion
from flex_planner.planning.quick_sampling import sample_quickly
from flex_planner.planning.sampling import sample_plan, SampledPlan, SamplingSettings
import numpy as np
import pytest


@pytest.fixture(scope='module')
def flexible(ei50_model: ArmModel, ei50_arm: Arm, paper_task: Any) -> Plan:
    return plan_path(paper_task(ei50_arm), model=ei50_model)


@pytest.fixture(scope='module')
def hanging(workshop_model: ArmModel, workshop_arm: Arm) -> Plan:
    """Return a plan under gravity, with friction and unlike links."""
    task = Task(arm=workshop_arm, start_positions=np.array([-1.5, 0.1]), duration=1.0,
                goal_positions=np.array([-1.3, 0.3]), payload_mass=0.3)
    return plan_path(task, model=workshop_model)


@pytest.fixture(scope='module')
def saturated(rigid_model: ArmModel, rigid_arm: Arm, paper_task: Any) -> Plan:
    """Return the plan with the largest payload: motors change from limit to limit in 4 ms."""
    plan = find_max_payload(paper_task(rigid_arm), model=rigid_model).plan
    assert plan is not None
    return plan


@pytest.fixture(params=['flexible', 'hanging', 'saturated'])
def plan(request: pytest.FixtureRequest) -> Plan:
    plan: Plan = request.getfixturevalue(request.param)
    assert plan.solved, plan.message
    return plan


def placed(plan: Plan, tolerance: float, longest: float = 0.01) -> tuple[Array, float]:
    """Return times of points whose efforts are the planned torques, and their error."""
    controller = JointController(gains=Gains.of(2, 100.0, 10.0))
    motion = PublishedMotion.of(plan, controller, 0.0)
    return point_times(motion, longest, tolerance, Monitor())


def interpolation_error(plan: Plan, reference: SampledPlan) -> float:
    """Return the error of linear interpolation on a grid 32 times as fine as the samples."""
    moving = reference.samples
    shares = np.linspace(0, 1, 32, endpoint=False)
    times = (moving.times[:-2, None] + np.diff(moving.times[:-1])[:, None] * shares).ravel()
    exact = plan.sample(times).torques
    lines = np.stack([np.interp(times, moving.times[:-1], column[:-1])
                      for column in moving.torques.T], axis=1)
    return float(np.abs(lines - exact).max())


def test_times_are_integers_that_grow_from_0(plan: Plan) -> None:
    times = sample_plan(plan, SamplingSettings()).times_ns
    assert times.dtype == np.int64
    assert times[0] == 0
    assert (np.diff(times) > 0).all()
    assert times[-2] == round(plan.task.duration * 1e9)
    assert times[-1] - times[-2] == 1_000_000  # a period of the controller


def test_samples_belong_to_their_times(plan: Plan) -> None:
    reference = sample_plan(plan, SamplingSettings())
    inner = slice(1, -2)
    exact = plan.sample(reference.times_ns[inner] * 1e-9)
    np.testing.assert_allclose(reference.samples.times, reference.times_ns * 1e-9, atol=1e-12)
    for name in ('coordinates', 'rates', 'accelerations', 'torques', 'velocity_costates', 'tip'):
        np.testing.assert_allclose(getattr(reference.samples, name)[inner], getattr(exact, name),
                                   rtol=1e-6, atol=1e-6)


def test_motion_starts_and_ends_exactly_at_rest(plan: Plan) -> None:
    samples = sample_plan(plan, SamplingSettings()).samples
    n_t = plan.arm.n_coordinates
    for row, state in ((0, plan.problem.start), (-2, plan.problem.goal), (-1, plan.problem.goal)):
        assert samples.coordinates[row].tolist() == state[:n_t].tolist()
        assert not samples.rates[row].any()
    assert not samples.accelerations[-1].any()


def test_last_effort_holds_the_arm(plan: Plan) -> None:
    sampled = sample_plan(plan, SamplingSettings())
    samples = sampled.samples
    assert sampled.efforts[-1].tolist() == samples.torques[-1].tolist()
    n, n_t = plan.arm.n_joints, plan.arm.n_coordinates
    p = Parameters.of(plan.arm, payload_mass=plan.task.payload_mass).physical
    still = np.concatenate([samples.coordinates[-1], np.zeros(n_t)])[None]
    force = plan.model.inverse_dynamics(still, np.zeros((1, n_t)), p)[0]
    np.testing.assert_allclose(samples.torques[-1], force[:n], atol=1e-9)
    # the joints bear the whole load: the links are bent as far as it bends them
    np.testing.assert_allclose(force[n:], 0, atol=1e-9)
    assert samples.torques[-1].any() == plan.arm.gravity.any()


def test_last_effort_under_gravity_is_not_that_of_the_arrival(hanging: Plan) -> None:
    torques = sample_plan(hanging, SamplingSettings()).samples.torques
    assert np.abs(torques[-1] - torques[-2]).max() > 1


@pytest.mark.parametrize('tolerance', [0.2, 0.02, 0.002])
def test_torque_error_bounds_linear_interpolation(plan: Plan, tolerance: float) -> None:
    reference = sample_plan(plan, SamplingSettings(torque_tolerance=tolerance,
                                                   controller_period=0.0))
    assert 0 < reference.torque_error <= tolerance
    assert reference.efforts.tolist() == reference.samples.torques.tolist()
    # four probes a step, one of them in the middle, where a parabola is worst
    assert interpolation_error(plan, reference) <= 1.02 * reference.torque_error


def fewest_samples(plan: Plan, longest: float) -> int:
    """Return the steps between switches, and one more."""
    ends = [0.0, *plan.switching_times, 1.0]
    count = int(np.ceil(np.diff(ends) / longest).sum()) + 1
    # without switches 101 of 10 ms, 35 of 30 ms
    assert plan.switching_times.size or count == {0.01: 101, 0.03: 35}[longest]
    return count


def test_tighter_tolerance_gives_more_samples(plan: Plan) -> None:
    counts = [placed(plan, tolerance)[0].size for tolerance in (0.5, 0.02, 0.001)]
    assert counts[0] < counts[1] < counts[2]
    assert counts[0] == fewest_samples(plan, 0.01)


def test_samples_lie_on_switches_and_are_dense_only_where_torques_bend(saturated: Plan) -> None:
    reference = sample_plan(saturated, SamplingSettings(controller_period=0.0))
    switches = np.round(saturated.switching_times * 1e9).astype(np.int64)
    assert switches.size == 6
    assert np.isin(switches, reference.times_ns).all()
    steps = np.diff(reference.times_ns)[:-1]
    assert reference.torque_error <= 0.02
    assert reference.times_ns.size <= 110
    assert steps.min() < 2_000_000 < 9_000_000 < steps.max() <= 10_000_000
    at_limits = reference.samples.torques[np.isin(reference.times_ns, switches)]
    bounds = TorqueLimits.of(saturated.arm).bounds(
        reference.samples.rates[np.isin(reference.times_ns, switches), :2])
    nearest = np.abs(np.stack(bounds) - at_limits).min(axis=(0, 2))
    assert (nearest < 1e-3).all()


def test_switches_nearer_than_the_shortest_step_are_one(flexible: Plan) -> None:
    switches = np.array([1e-4, 0.5, 0.5001, 0.70017, 0.9999])
    plan = replace(flexible, switching_times=switches)
    times, _ = placed(plan, 1e3)
    assert np.isin([0.5, 0.70017], times).all()
    assert np.diff(times).min() >= 2.5e-4


def test_samples_that_are_too_many_are_spent_where_they_matter_most(
        flexible: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('flex_planner.planning.point_times.MAX_SAMPLES', 130)
    (few, coarse), (many, fine) = (placed(flexible, tolerance) for tolerance in (1e3, 1e-6))
    assert [few.size, many.size] == [101, 131]
    assert fine < 0.8 * coarse


def test_longest_step_is_kept(plan: Plan) -> None:
    times, _ = placed(plan, 1e3, longest=0.03)
    assert np.diff(times).max() <= 0.03 * (1 + 1e-12)
    assert times.size == fewest_samples(plan, 0.03)


def test_points_are_closer_where_the_arm_would_arrive_elsewhere(flexible: Plan) -> None:
    settings = SamplingSettings(longest_step=0.05, torque_tolerance=10.0)
    coarse, _ = placed(flexible, 10.0, longest=0.05)
    sampled = sample_plan(flexible, settings)
    assert sampled.times_ns.size > 3 * coarse.size
    assert sampled.torque_error < 0.1
    # with infinitely many points 0.2 um, of which 10 um are allowed to the points
    assert sampled.execution.tip_error < 1.1e-5


@pytest.mark.parametrize(('hold', 'shift'), [
    (EffortHold.END, 2e-3), (EffortHold.START, -2e-3), (EffortHold.MIDDLE, 0.0),
    (EffortHold.LINEAR, 0.0)])
def test_efforts_are_shifted_by_half_the_period_in_which_they_are_held(
        flexible: Plan, hold: EffortHold, shift: float) -> None:
    controller = JointController(gains=Gains.of(2, 100.0, 10.0), rate=250.0, hold=hold)
    sampled = sample_plan(flexible, SamplingSettings(controller=controller))
    times = sampled.times_ns[:-1] * 1e-9
    planned = flexible.sample(np.clip(times - shift, 0, 1)).torques
    np.testing.assert_allclose(sampled.efforts[:-1], planned, atol=1e-9)
    np.testing.assert_allclose(sampled.samples.torques[1:-2], flexible.sample(times[1:-1]).torques,
                               atol=1e-6)
    assert sampled.execution.controller is controller


def test_steps_stay_above_a_quarter_of_a_millisecond(flexible: Plan) -> None:
    reference = sample_plan(flexible, SamplingSettings(torque_tolerance=1e-9))
    assert np.diff(reference.times_ns)[:-1].min() >= 250_000
    assert reference.torque_error > 1e-9  # and the truth is told


def test_plan_without_solution_has_no_samples(rigid_arm: Arm, rigid_model: ArmModel,
                                              paper_task: Any) -> None:
    failed = plan_path(paper_task(rigid_arm, payload_mass=200.0), model=rigid_model)
    assert not failed.solved
    with pytest.raises(ValueError, match='the plan has no solution'):
        sample_plan(failed, SamplingSettings())


@pytest.mark.parametrize(('values', 'error', 'text'), [
    ({'longest_step': 1e-5}, InvalidValueError, 'longest_step is 1e-05'),
    ({'longest_step': 2.0}, InvalidValueError, 'longest_step is 2.0'),
    ({'torque_tolerance': 0.0}, InvalidValueError, 'torque_tolerance is 0.0'),
    ({'torque_tolerance': np.nan}, NotFiniteError, 'torque_tolerance is nan'),
    ({'controller_period': -1.0}, InvalidValueError, 'controller_period is -1.0'),
    ({'controller_period': 0.2}, InvalidValueError, 'controller_period is 0.2')])
def test_bad_sampling_settings_are_refused(values: dict[str, float], error: type[Exception],
                                           text: str) -> None:
    with pytest.raises(error, match=text):
        SamplingSettings(**values)


def test_more_samples_than_a_message_should_hold_are_refused(flexible: Plan) -> None:
    task = replace(flexible.task, duration=6.0)
    with pytest.raises(InvalidTaskError, match='has 24000 samples, but may have 20000'):
        sample_plan(replace(flexible, task=task), SamplingSettings(longest_step=2.5e-4))


def test_sampling_listens_to_the_monitor(flexible: Plan) -> None:
    with pytest.raises(StoppedError):
        sample_plan(flexible, SamplingSettings(), Monitor(canceled=lambda: True))


@pytest.mark.parametrize('change', [
    {'goal_velocities': [0.1, 0.0]}, {'goal_position_weights': [1.0, 1.0]}])
def test_motion_that_does_not_end_at_rest_is_no_reference(flexible: Plan,
                                                          change: dict[str, Any]) -> None:
    with pytest.raises(InvalidTaskError, match='does not end at rest'):
        sample_plan(replace(flexible, task=replace(flexible.task, **change)),
                    SamplingSettings())


@pytest.mark.parametrize('arm', ['ei50', 'rigid'])
def test_quick_samples_have_the_figures_of_an_exact_simulation(plan_of: PlanFactory,
                                                               arm: str) -> None:
    plan, settings = plan_of(arm), SamplingSettings(longest_step=0.02, torque_tolerance=0.1)
    quick = sample_quickly(plan, settings)
    execution = Execution.of(plan, settings.controller_of(plan))
    exact = execution.arrive(quick.reference)
    # by steps with tolerances of 1e-5 that are not cut at the limits of motors [m]
    assert quick.execution.tip_error == pytest.approx(execution.tip_error(exact), abs=1e-6)
    assert quick.execution.residual_vibration == pytest.approx(execution.vibration(exact),
                                                               abs=1e-6)
