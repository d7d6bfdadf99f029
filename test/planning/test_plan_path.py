"""Optimal paths: the paper's and the design document's numbers, and what every plan promises."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import InvalidTaskError
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.dynamics.integration import simulate
from flex_planner.dynamics.statics import residual_vibration
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.planned_torque import PlannedTorque
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.plan import peaks, Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
import numpy as np
from plan_checks import SAME_COST, solution_of
import pytest
from scipy.integrate import simpson, solve_ivp

PlanFactory = Callable[..., Plan]
TaskFactory = Callable[..., Task]
Case = tuple[str, float, float]

# by Gauss rules with 5 to 10 stages on 20 to 800 intervals, whose first 11 digits agree;
# direct/test_ipopt.py comes to the same motions by another method
COSTS = {
    # arm, payload [kg], w_2: tables II to V, where the paper's solver converged
    ('rigid', 1.0, 0.0): 0.6468129775, ('rigid', 1.0, 1.0): 1.042830679,
    ('rigid', 1.0, 10.0): 3.919485376, ('rigid', 1.0, 1400.0): 413.7907806,
    ('rigid', 4.0, 0.0): 2.619123468, ('rigid', 5.5, 0.0): 5.109283980,
    ('rigid', 5.5, 200.0): 113.4492807, ('rigid', 5.8, 0.0): 6.569752421,
    ('single_mode', 1.0, 0.0): 0.6471750443, ('ei50', 1.0, 0.0): 0.6471788857,
    ('ei50', 5.5, 0.0): 5.114784932, ('ei5', 1.0, 0.0): 0.6488203576,
    ('ei5', 5.5, 0.0): 5.145083260}
# rigid arm, 1 kg: w_2 and peak speeds of section 5.2, with half a unit of their last digit
SPEEDS = [(0.0, (1.02, 1.20), 5e-3), (1.0, (0.90, 0.86), 5e-3),
          (10.0, (0.745, 0.621), 5e-4), (1400.0, (0.617, 0.559), 5e-4)]
every_case = pytest.mark.parametrize('case', COSTS, ids=str)


# Numbers


@every_case
def test_cost(plan_of: PlanFactory, case: Case) -> None:
    assert plan_of(*case).cost == pytest.approx(COSTS[case], rel=SAME_COST)


@pytest.mark.parametrize(('w_2', 'speeds', 'tolerance'), SPEEDS)
def test_peak_speeds_of_section_5_2(plan_of: PlanFactory, w_2: float,
                                    speeds: tuple[float, float], tolerance: float) -> None:
    plan = plan_of('rigid', 1.0, w_2)
    found = peaks(plan, plan.uniform_samples(1001)).speeds
    np.testing.assert_allclose(found, speeds, atol=tolerance)


def test_weight_10_is_the_first_of_table_2_to_stay_within_0_8_rad_s(
        plan_of: PlanFactory) -> None:
    plans = [plan_of('rigid', 1.0, w_2) for w_2 in (0.0, 1.0, 10.0)]
    fast = [peaks(plan, plan.uniform_samples(1001)).speeds.max() > 0.8 for plan in plans]
    assert fast == [True, True, False]


def test_one_link_has_the_cubic_motion_of_a_double_integrator() -> None:
    # M theta'' = u: u falls linearly, integral of u^2 = 12 M^2 change^2 / t_f^3
    arm = Arm(name='one link', links=(Link(length=0.8, linear_density=2.0),), joints=(Joint(),))
    task = Task(arm=arm, start_positions=[0.2], goal_positions=[1.7], duration=2.0,
                payload_mass=0.5, effort_weights=[0.25])
    plan = plan_path(task, search='fast')
    M, change = 2.0 * 0.8**3 / 3 + 0.5 * 0.8**2, 1.5
    samples, s = plan.uniform_samples(101), np.linspace(0, 1, 101)
    # the collocation polynomials contain the cubic: rounding is left
    assert plan.cost == pytest.approx(0.25 / 2 * 12 * M**2 * change**2 / 2**3, rel=1e-13)
    np.testing.assert_allclose(samples.coordinates[:, 0], 0.2 + change * (3*s**2 - 2*s**3),
                               atol=1e-13)
    np.testing.assert_allclose(samples.torques[:, 0], M * change / 4 * (6 - 12 * s), atol=1e-12)
    # Newton's method needs one step, and another where the first mesh is tested more sharply
    assert plan.iterations <= 2


def test_one_link_saturates_as_bang_coast_theory_says() -> None:
    # M theta'' = u, |u| <= u_max: u_max up to t_s, then linear through 0 at t_f/2
    link = Link(length=1.0, linear_density=3.0)  # M = 1 kg m^2
    arm = Arm(name='bounded', links=(link,), joints=(Joint(motor=Motor(stall_torque=2.0)),))
    t_s, t_f, u_max = 0.3, 2.0, 2.0
    ramp = t_f / 2 - t_s
    # distance in the first half: constant, then linearly falling acceleration
    half = u_max * t_s**2 / 2 + u_max * t_s * ramp + u_max * ramp**2 / 3
    plan = plan_path(Task(arm=arm, start_positions=[0], goal_positions=[2 * half], duration=t_f))
    effort = 2 * u_max**2 * (t_s + ramp / 3)
    assert plan.solved
    assert plan.effort == pytest.approx(effort, rel=1e-10)
    assert plan.cost == pytest.approx(effort / 2, rel=1e-10)
    np.testing.assert_allclose(plan.switching_times, [t_s, t_f - t_s], atol=1e-8)
    assert plan.saturation == pytest.approx([2 * t_s / t_f], abs=1e-8)


def test_flexible_plan_spares_the_vibration_that_a_rigid_one_leaves(
        plan_of: PlanFactory, ei5_model: ArmModel) -> None:
    rigid, flexible = plan_of('rigid'), plan_of('ei5')
    problem = flexible.problem
    end = simulate(ei5_model, problem.parameters.physical, problem.start,
                   PlannedTorque.of(rigid.problem, solution_of(rigid)), 1.0)
    miss = np.linalg.norm(tip_position(ei5_model.arm, end[:6])
                          - tip_position(ei5_model.arm, problem.goal[:6]))
    vibration = residual_vibration(ei5_model, end, problem.goal[:6], problem.parameters)
    # half the last digit
    assert miss == pytest.approx(0.912e-3, abs=0.5e-6)
    assert vibration == pytest.approx(1.066e-3, abs=0.5e-6)
    assert flexible.certificate.tip_error < 1e-7 * miss
    assert flexible.certificate.residual_vibration < 1e-6 * vibration


# What every plan promises


@every_case
def test_plan_is_solved_within_its_limits_and_work(plan_of: PlanFactory, case: Case) -> None:
    plan = plan_of(*case)
    assert (plan.status, plan.message) == (PlanStatus.SOLVED, PlanStatus.SOLVED.value)
    assert plan.strategy == 'cold start'
    # at least three times what was found
    assert plan.certificate.tip_error <= 1e-7  # [m]
    assert plan.certificate.boundary_error <= 2e-12
    assert plan.certificate.residual_vibration <= 1e-10  # [m]
    assert plan.certificate.hamiltonian_drift <= 2e-7
    assert plan.certificate.collocation_residual <= 1e-3
    assert max(plan.certificate.state_error, plan.certificate.costate_error) <= 1e-6  # asked for
    assert plan.iterations <= 300  # with those for cheaper kinds, of which there are none
    assert len(plan.kinds) == 1
    assert plan_path(plan.task, model=plan.model, search='fast').iterations <= 30
    assert plan.mesh_intervals <= {'rigid': 45, 'ei50': 130}.get(case[0], 50)


@every_case
def test_plan_keeps_the_torque_within_the_bounds(plan_of: PlanFactory, case: Case) -> None:
    samples = plan_of(*case).uniform_samples(1000)
    # rounding of K_1 - K_2 theta'
    assert (samples.torques <= samples.upper_bounds + 1e-12).all()
    assert (samples.torques >= samples.lower_bounds - 1e-12).all()
    lower, upper = TorqueLimits.of(plan_of(*case).arm).bounds(samples.rates[:, :2])
    assert np.array_equal(samples.lower_bounds, lower)
    assert np.array_equal(samples.upper_bounds, upper)


@every_case
def test_plan_starts_and_ends_at_rest_where_it_was_asked_to(plan_of: PlanFactory,
                                                            case: Case) -> None:
    plan = plan_of(*case)
    samples, bent = plan.uniform_samples(2), np.zeros(plan.arm.n_modes)
    expected = [[*plan.task.start_positions, *bent], [*plan.task.goal_positions, *bent]]
    # the conditions are linear: rounding
    np.testing.assert_allclose(samples.coordinates, expected, atol=1e-14)
    np.testing.assert_allclose(samples.rates, 0, atol=1e-14)
    np.testing.assert_allclose(samples.tip, [[0.5, 0.0], [0.5, 0.5]], atol=1e-14)
    assert samples.times.tolist() == [0.0, 1.0]


@every_case
def test_hamiltonian_is_constant_on_the_extremal(plan_of: PlanFactory, case: Case) -> None:
    # tens of per cent without the multiplier of the moving bound
    hamiltonian = plan_of(*case).uniform_samples(500).hamiltonian
    assert np.ptp(hamiltonian) <= 4e-7 * np.abs(hamiltonian).max()


def test_hamiltonian_of_a_saturated_motion_is_constant_to_rounding_on_a_finer_mesh(
        rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    plan = plan_path(paper_task(rigid_model.arm, 5.5), model=rigid_model,
                     solver=Solver(SolverSettings(error_tolerance=1e-8)))
    assert plan.certificate.hamiltonian_drift < 1e-14


@pytest.mark.parametrize('case', [
    ('rigid', 1.0, 10.0), ('ei5', 1.0, 0.0), ('rigid', 5.5, 0.0), ('rigid', 5.5, 200.0)], ids=str)
def test_torques_lead_another_integrator_to_the_goal(plan_of: PlanFactory, case: Case) -> None:
    plan = plan_of(*case)
    rate = plan.model.state_rate(plan.problem.parameters.physical)
    samples = plan.uniform_samples(4001)

    def torque(t: float) -> list[float]:
        return [np.interp(t, samples.times, column) for column in samples.torques.T]

    end = solve_ivp(lambda t, x: rate(x, np.array(torque(t))).copy(), (0, 1),
                    plan.problem.start, method='RK45', rtol=1e-9, atol=1e-11).y[:, -1]
    # the torque between samples: 2e3 N m/s^2 times the square of 0.25 ms, by eight
    np.testing.assert_allclose(tip_position(plan.arm, end[:plan.arm.n_coordinates]), [0.5, 0.5],
                               atol=1e-6)


@pytest.mark.parametrize('case', [('ei5', 5.5, 0.0), ('rigid', 5.5, 0.0)], ids=str)
def test_samples_agree_with_one_another(plan_of: PlanFactory, case: Case) -> None:
    plan, h = plan_of(*case), 1e-6
    before, at, after = (plan.sample(np.array([0.123, 0.456, 0.789]) + d) for d in (-h, 0, h))
    # a defect of less than 1e-7 there, and 1e-10 from rounding
    slope = (after.coordinates - before.coordinates) / (2 * h)
    np.testing.assert_allclose(slope, at.rates, atol=1e-7 * np.abs(at.rates).max())
    slope = (after.rates - before.rates) / (2 * h)
    np.testing.assert_allclose(slope, at.accelerations,
                               atol=1e-7 * np.abs(at.accelerations).max())
    forces = plan.model.inverse_dynamics(np.hstack([at.coordinates, at.rates]),
                                         at.accelerations, plan.problem.parameters.physical)
    np.testing.assert_allclose(forces[:, :2], at.torques, atol=1e-13)  # rounding
    np.testing.assert_array_equal(at.tip, tip_position(plan.arm, at.coordinates))


def test_totals_are_integrals_of_the_samples(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid', 1.0, 1.0)
    samples = plan.uniform_samples(2001)
    torques, rates = samples.torques, samples.rates
    # Simpson's rule is of fourth order, and of second at the kinks of the absolute power
    assert plan.effort == pytest.approx(
        simpson((torques**2).sum(axis=1), x=samples.times), rel=1e-11)
    assert plan.energy == pytest.approx(
        simpson(np.abs(torques * rates).sum(axis=1), x=samples.times), rel=3e-5)
    assert plan.cost == pytest.approx(plan.effort / 16 + simpson(
        (rates**2).sum(axis=1), x=samples.times) / 2, rel=1e-11)


def test_peaks_are_shares_of_the_motors_limits(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid', 5.5)
    samples = plan.uniform_samples(1001)
    found = peaks(plan, samples)
    np.testing.assert_allclose(found.torque_shares, 1.0, rtol=1e-12)  # both saturate
    np.testing.assert_allclose(found.speed_shares, found.speeds / 3.5, rtol=1e-15)
    assert found.torques.tolist() == np.abs(samples.torques).max(axis=0).tolist()


def test_saturation_is_the_share_of_the_samples_on_their_bound(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid', 5.5)
    times = np.concatenate([[0], plan.switching_times, [1]])
    middles = plan.sample((times[1:] + times[:-1]) / 2)
    gap = np.minimum(middles.upper_bounds - middles.torques,
                     middles.torques - middles.lower_bounds)
    shares = np.diff(times) @ (gap < 1e-12)
    # quadrature of a step on a mesh with a node near it
    np.testing.assert_allclose(plan.saturation, shares, atol=1e-3)


def test_cost_grows_with_payload_and_softness(plan_of: PlanFactory) -> None:
    by_payload = [plan_of('rigid', mass).cost for mass in (1.0, 4.0, 5.5, 5.8)]
    by_softness = [plan_of(arm).cost for arm in ('rigid', 'ei50', 'ei5')]
    assert by_payload == sorted(by_payload)
    assert by_softness == sorted(by_softness)


# Other tasks


@pytest.mark.parametrize('name', ['rigid', 'ei50'])
def test_no_motion_costs_nothing(request: pytest.FixtureRequest, paper_task: TaskFactory,
                                 name: str) -> None:
    model = request.getfixturevalue(f'{name}_model')
    start = paper_task(model.arm).start_positions
    plan = plan_path(paper_task(model.arm, goal_positions=start), model=model)
    samples = plan.uniform_samples(11)
    assert (plan.solved, plan.cost, plan.energy) == (True, 0.0, 0.0)
    assert not samples.torques.any()
    np.testing.assert_array_equal(samples.coordinates[:, :2], np.tile(start, (11, 1)))


def test_no_motion_under_gravity_takes_the_holding_torque(workshop_model: ArmModel) -> None:
    posture = [1.4, 0.5]
    plan = plan_path(Task(arm=workshop_model.arm, start_positions=posture,
                          goal_positions=posture, duration=0.5), model=workshop_model)
    hold = plan.problem.holding_torque
    assert plan.solved
    assert plan.cost <= hold @ hold / 2 * 0.5  # swinging is free where it spares torque
    assert plan.cost == pytest.approx(hold @ hold / 2 * 0.5, rel=0.05)
    np.testing.assert_allclose(plan.uniform_samples(2).coordinates,
                               np.tile(plan.problem.goal[:5], (2, 1)), atol=1e-14)


def test_arm_with_gravity_friction_and_nodes_is_planned(workshop_model: ArmModel) -> None:
    task = Task(arm=workshop_model.arm, start_positions=[-1.8, 0.3], goal_positions=[-1.2, -0.3],
                duration=1.0, payload_mass=0.2, velocity_weights=[0.5, 0.5],
                position_weights=[0.1, 0.1])
    plan = plan_path(task, model=workshop_model)
    assert plan.solved, plan.message
    # links sag at both ends as gravity bends them, the even mode of a uniform link by nothing
    sag = plan.uniform_samples(2).coordinates[:, 2:]
    assert (np.abs(sag[:, :2]) > 1e-5).all()
    np.testing.assert_allclose(sag[:, 2], 0, atol=1e-14)


def test_motion_about_an_unstable_posture_is_simulated_as_exactly_as_it_was_planned() -> None:
    # upright, errors grow by e^17 in 4 s: no mesh helps an integrator with a tolerance of 1e-8
    arm = Arm(name='upright', links=(Link(length=0.8, linear_density=2.0),), joints=(Joint(),),
              gravity=[0.0, -9.81])
    task = Task(arm=arm, start_positions=[1.2], goal_positions=[1.9], duration=4.0)
    plan = plan_path(task, solver=Solver(SolverSettings(stages=6, max_intervals=60)))
    assert plan.solved, plan.message
    assert plan.certificate.tip_error <= 1e-5


def test_motor_too_weak_to_hold_the_goal_is_refused_in_words(workshop_arm: Arm) -> None:
    # the first joint needs 9.375 N m there, its motor has 9
    task = Task(arm=workshop_arm, start_positions=[-1.8, 0.2], goal_positions=[-1.2, 0.5],
                duration=1.0, payload_mass=0.3)
    plan = plan_path(task)
    assert (plan.status, plan.solution) == (PlanStatus.INFEASIBLE, None)
    assert plan.message.startswith('joint 1 needs 9.375 N m to hold 0.3 kg at the goal, its motor')
    assert plan.message.endswith('gives 9: no motion can end there (HOLDING)')


def test_solver_without_a_monitor_counts_anew_in_every_plan(rigid_model: ArmModel,
                                                            paper_task: TaskFactory) -> None:
    task, solver = paper_task(rigid_model.arm), Solver()
    first, second = (plan_path(task, model=rigid_model, solver=solver) for _ in range(2))
    assert first.iterations == second.iterations > 0


def test_functions_of_another_arm_are_refused(rigid_model: ArmModel, ei50_model: ArmModel,
                                              paper_task: TaskFactory) -> None:
    for search in (plan_path, find_max_payload, find_min_duration):
        with pytest.raises(InvalidTaskError, match='model is of another arm'):
            search(paper_task(ei50_model.arm), model=rigid_model)


def test_functions_do_for_an_arm_with_other_motors_and_stiffness(ei50_model: ArmModel,
                                                                 paper_task: TaskFactory) -> None:
    arm = ei50_model.arm
    softer = tuple(replace(link, flexural_rigidity=20.0) for link in arm.links)
    assert plan_path(paper_task(replace(arm, links=softer)), model=ei50_model).solved
