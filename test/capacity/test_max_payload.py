"""Maximum payload: physics, an independent method, front, gravity, and what is refused."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from bench.random_tasks import random_task
from factories import SearchFactory, TaskFactory
from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import InvalidTaskError, InvalidValueError
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.dynamics.integration import PiecewisePolynomial, simulate
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectResult, DirectSettings
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_path import plan_path
from kinds_support import assert_says
from known_limits import G, HEAVIEST, lifted_to, one_link
import numpy as np
from numpy.polynomial import legendre
from payload_searches import (
    assert_stopped,
    assert_stopped_at,
    followed,
    moments,
    raised,
    stopped_after,
)
from plan_checks import problem_of
import pytest

inf, nan = math.inf, math.nan
EXACT = SolverSettings(error_tolerance=1e-8)
every_arm = pytest.mark.parametrize('name', HEAVIEST)


def arm_with(arm: Arm, torques: tuple[float, float], no_load_speed: float = 3.5) -> Arm:
    """Return an arm of two joints with other motors."""
    speeds = [no_load_speed if math.isfinite(torque) else inf for torque in torques]
    return replace(arm, joints=tuple(
        Joint(motor=Motor(stall_torque=torque, no_load_speed=speed, max_torque=np.inf))
        for torque, speed in zip(torques, speeds, strict=True)))


# Physics


def test_stronger_motors_carry_more(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    found = [followed(paper_task(arm_with(rigid_arm, (torque, torque))))
             for torque in (4.0, 8.0, 8.01, 16.0)]
    assert all(each.solved for each in found)
    assert all(less.local_upper < more.payload
               for less, more in zip(found[:-1], found[1:], strict=True))


def test_stronger_second_motor_alone_carries_more(rigid_arm: Arm,
                                                  paper_task: TaskFactory) -> None:
    less, more = (followed(paper_task(arm_with(rigid_arm, (8.0, torque))))
                  for torque in (8.0, 9.0))
    assert less.local_upper < more.payload


def test_more_time_carries_more_in_the_horizontal_plane(rigid_model: ArmModel,
                                                        paper_task: TaskFactory) -> None:
    found = [followed(paper_task(rigid_model.arm, 0.0, duration=T), model=rigid_model)
             for T in (0.6, 1.0, 1.001, 4.0)]
    assert all(each.solved for each in found)
    assert all(less.local_upper < more.payload
               for less, more in zip(found[:-1], found[1:], strict=True))


def test_slower_motion_of_motors_as_much_weaker_carries_the_same(rigid_arm: Arm,
                                                                 paper_task: TaskFactory) -> None:
    # time in units of t_f: torques go with 1 / t_f^2, speeds with 1 / t_f
    found = followed(paper_task(arm_with(rigid_arm, (0.5, 0.5), 0.875), duration=4.0))
    assert found.payload <= HEAVIEST['rigid'] <= found.local_upper


def test_heavier_arm_of_motors_as_much_stronger_carries_as_much_more(
        rigid_arm: Arm, paper_task: TaskFactory) -> None:
    link = Link(length=0.5, linear_density=18.0)
    arm = replace(arm_with(rigid_arm, (24.0, 24.0)), links=(link, link))
    found = followed(paper_task(arm))
    assert found.payload <= 3 * HEAVIEST['rigid'] <= found.local_upper


@pytest.mark.parametrize('changes', [
    {'position_weights': [50.0, 0.0]}, {'position_weights': [3.0, 9.0], 'w_2': 20.0},
    {'effort_weights': [1e-3, 1e-3]}, {'effort_weights': [1e3, 1e3]},
    {'effort_weights': [1.0, 100.0]}], ids=str)
def test_weights_do_not_matter(rigid_model: ArmModel, paper_task: TaskFactory,
                               changes: dict[str, Any]) -> None:
    found = find_max_payload(paper_task(rigid_model.arm, **changes), model=rigid_model)
    assert found.solved, found.message
    assert found.payload <= HEAVIEST['rigid'] <= found.local_upper
    # the gap counts efforts as they weigh
    assert all(one.value < HEAVIEST['rigid'] < one.value + one.gap for one in found.extremals)


def test_weights_do_not_matter_where_links_bend(ei5_model: ArmModel,
                                                paper_task: TaskFactory) -> None:
    task = paper_task(ei5_model.arm, effort_weights=[1.0, 4.0],
                      velocity_weights=[5.0, 5.0, 1.0, 1.0, 1.0, 1.0])
    found = followed(task, model=ei5_model)
    assert found.payload <= HEAVIEST['ei5'] <= found.local_upper
    assert found.plan is not None
    assert found.plan.task.velocity_weights.tolist() == task.velocity_weights.tolist()


@pytest.mark.parametrize('payload_mass', [0.0, 3.0, 5.85, 5.8551])
def test_first_payload_does_not_matter(rigid_model: ArmModel, paper_task: TaskFactory,
                                       payload_mass: float) -> None:
    found = followed(paper_task(rigid_model.arm, payload_mass), model=rigid_model)
    assert max(found.payload, payload_mass) == found.payload
    assert found.payload <= HEAVIEST['rigid'] <= found.local_upper


@pytest.mark.parametrize('duration', [1.01, 1.5, 2.0, 5.0, 50.0])
def test_maximum_payload_of_one_link_has_its_closed_form(duration: float) -> None:
    # bang-bang: u_max T^2 = 4 M d
    found = find_max_payload(one_link(duration))
    assert found.solved, found.message
    assert found.payload <= duration**2 - 1 <= found.local_upper
    # a millionth of the payload is the finest
    assert found.local_upper - found.payload <= max(1e-3, 1e-6 * found.payload)


def test_payload_inertia_is_carried_too() -> None:
    # M = 1 + J_p + m_p
    found = followed(one_link(2.0, payload_inertia=0.5))
    assert found.payload <= 2.5 <= found.local_upper


def test_first_payload_may_cost_next_to_nothing(rigid_model: ArmModel,
                                                paper_task: TaskFactory) -> None:
    found = followed(paper_task(rigid_model.arm, duration=100.0), model=rigid_model)
    # the same in units of t_f
    same = followed(paper_task(arm_with(rigid_model.arm, (8e4, 8e4), 350.0)))
    assert same.solved, same.message
    assert max(found.payload, same.payload) <= min(found.local_upper, same.local_upper)


# An independent method


def by_ipopt(model: ArmModel, task: Task, intervals: int) -> DirectResult:
    """Look for a motion by direct collocation, with four points an interval."""
    problem = problem_of(model, task)
    settings = DirectSettings(degree=4, intervals=intervals, max_iterations=200)
    return DirectProblem(model, settings).solve(problem.parameters, problem.start, problem.goal,
                                                task.duration)


def miss_of(model: ArmModel, task: Task, found: DirectResult) -> float:
    """Return where the torques of IPOPT lead SciPy's integrator, by eq. (17)."""
    problem, mesh = problem_of(model, task), found.times
    theta = (legendre.leggauss(4)[0] + 1) / 2
    torque = PiecewisePolynomial.through(mesh, theta,
                                         found.torques.reshape(mesh.size - 1, 4, -1))
    miss = simulate(model, problem.parameters.physical, problem.start, torque,
                    task.duration) - problem.goal
    return float(miss @ miss / 2)


@every_arm
def test_ipopt_carries_a_thousandth_less_and_no_thousandth_more(
        request: pytest.FixtureRequest, paper_task: TaskFactory, search_of: SearchFactory,
        name: str) -> None:
    model, found = request.getfixturevalue(f'{name}_model'), search_of(name)
    below = paper_task(model.arm, 0.999 * found.payload)
    carried = by_ipopt(model, below, 60)
    assert carried.converged, carried.message
    # what rings is not resolved: eq. (17) a hundred thousand times as exactly as the paper
    assert miss_of(model, below, carried) < 1e-8
    bounds = np.array([8.0, 8.0]) - carried.point_states[:, model.arm.n_coordinates:][:, :2] * (
        np.sign(carried.torques) * 8 / 3.5)
    assert (np.abs(carried.torques) <= bounds * (1 + 1e-6)).all()
    # failures take longer: on a third of the mesh
    above = by_ipopt(model, paper_task(model.arm, 1.001 * found.local_upper), 20)
    assert not above.converged
    # on some processors it does not come so far as to see why
    assert above.message in ('infeasible problem detected', 'maximum iterations exceeded')


def test_ipopt_agrees_under_gravity() -> None:
    task = lifted_to(0.0, 0.5)
    model, found = ArmModel(task.arm), find_max_payload(task)
    below, above = (by_ipopt(model, replace(task, payload_mass=payload), 40)
                    for payload in (0.999 * found.payload, 1.001 * found.local_upper))
    assert below.converged
    assert not above.converged


# The front


@every_arm
def test_front_is_convex_and_its_prices_are_its_slopes(search_of: SearchFactory,
                                                       name: str) -> None:
    front = search_of(name).front
    assert front.payloads.size >= 3
    assert (np.diff(front.payloads) > 0).all()
    assert (np.diff(front.prices) > 0).all()
    slopes = np.diff(front.efforts) / np.diff(front.payloads)
    assert (front.prices[:-1] < slopes).all()
    assert (slopes < front.prices[1:]).all()


def test_payload_of_the_front_costs_what_its_plan_costs(
        rigid_model: ArmModel, paper_task: TaskFactory, search_of: SearchFactory) -> None:
    front, h, costs = search_of('rigid').front, 1e-3, []
    for k in (0, -2, -1, 1, 2):
        task = paper_task(rigid_model.arm, front.payloads[0] + k * h)
        costs.append(plan_path(task, model=rigid_model, solver=Solver(EXACT)).cost)
    # J is stationary: the square of the errors of the motion
    assert front.efforts[0] == pytest.approx(costs[0], rel=1e-7)
    price = np.array([1, -8, 8, -1]) @ costs[1:] / (12 * h)
    assert front.prices[0] == pytest.approx(price, rel=1e-5)


def test_front_knows_no_weights_but_those_of_effort(rigid_model: ArmModel,
                                                    paper_task: TaskFactory) -> None:
    bare, weighted = (followed(paper_task(rigid_model.arm, 3.0, w_2), model=rigid_model)
                      for w_2 in (0.0, 50.0))
    assert weighted.front.efforts.tolist() == bare.front.efforts.tolist()
    assert weighted.plan is not None
    assert bare.plan is not None
    assert weighted.plan.cost > 2 * bare.plan.cost


def test_front_scales_with_the_weights_of_effort(rigid_model: ArmModel,
                                                 paper_task: TaskFactory) -> None:
    one, ten = (followed(paper_task(rigid_model.arm, 3.0, effort_weights=[R, R]),
                         model=rigid_model).front for R in (0.125, 1.25))
    # the first price is ten times as high, so are all
    np.testing.assert_allclose(ten.prices, 10 * one.prices, rtol=1e-3)
    np.testing.assert_allclose(ten.payloads, one.payloads, rtol=1e-3)
    np.testing.assert_allclose(ten.efforts, 10 * one.efforts, rtol=1e-3)


# Motions that were not found


@pytest.mark.parametrize(('method', 'payload_mass', 'changes', 'found_instead'), [
    (PayloadMethod.DIRECT, 1.0, {'duration': 0.6},
     'no motion with 1 kg in 0.6 s was found from 16 starts; the heaviest payload found in 0.6 s '
     'is 0.5652 kg, the shortest duration found with 1 kg is 0.6434 s'),
    (PayloadMethod.INCREMENTAL, 0.0, {'duration': 0.5},
     'no motion with 0 kg in 0.5 s was found from 16 starts; the shortest duration found with '
     '0 kg is 0.5367 s')], ids=['direct', 'incremental'])
def test_payload_that_no_motion_was_found_to_carry_is_told_with_what_was_found_instead(
        rigid_model: ArmModel, paper_task: TaskFactory, method: PayloadMethod,
        payload_mass: float, changes: dict[str, float], found_instead: str) -> None:
    found = followed(paper_task(rigid_model.arm, payload_mass, **changes), model=rigid_model,
                     method=method)
    assert (found.status, found.solved) == (PlanStatus.NOT_FOUND, False)
    assert_says(found.message, f'{found_instead}. This does not show that there is none')
    assert (found.payload, found.local_upper, found.plan) == (0.0, inf, None)
    assert (found.limiting_joint, found.held, found.method) == (None, False, method)
    # what is proved is far above what was found
    assert found.proved_upper > 2 * (payload_mass or 1.0)
    assert found.proof is not None


# Gravity


def test_payload_that_can_be_held_is_reached_from_where_an_exploration_came_to_it() -> None:
    # a task of the adversary, whose price Newton's method cannot follow
    found = find_max_payload(random_task(326, gravity=True))
    assert (found.status, found.held) == (PlanStatus.SOLVED, True), found.message
    assert found.payload == pytest.approx(0.947996, rel=1e-6)
    assert found.proved_upper == pytest.approx(found.payload, rel=2e-6)


def test_payload_that_the_motor_just_holds_at_the_goal_is_the_limit() -> None:
    # u_max = (m / 2 + m_p) G l cos(goal)
    for angle in (0.0, -0.4):
        found = find_max_payload(lifted_to(angle, 2.0))
        assert found.solved, found.message
        assert found.held
        assert found.local_upper == pytest.approx(6 / (G * math.cos(angle)) - 0.15, rel=1e-10)
        assert found.payload == pytest.approx(found.local_upper, rel=2e-9)
        assert found.payload < found.local_upper
        assert found.limiting_joint == 0
        assert found.message.endswith(
            'joint 1 can hold no more at the goal: no motion carries more')
        # that is a proof for all kinds of motion, which need not be looked for
        # the proof gives away a millionth
        assert found.proved_upper == pytest.approx(found.local_upper, rel=2e-6)
        assert found.proved_upper >= found.local_upper
        assert found.starts == 0
        assert str(found.proof).startswith('joint 1 can hold no more than ')
        assert str(found.proof).endswith(' at the goal (HOLDING)')


def test_plan_with_what_the_motor_just_holds_is_certified() -> None:
    found = followed(lifted_to(0.0, 2.0))
    assert found.plan is not None
    assert found.plan.solved
    assert found.plan.task.payload_mass == found.payload
    torque = found.plan.uniform_samples(101).torques
    assert np.abs(torque).max() <= 6 * (1 + 1e-12)
    assert found.plan.problem.holding_torque == pytest.approx([6.0], rel=1e-8)


@pytest.mark.parametrize(('angle', 'duration'), [(0.0, 0.5), (0.0, 0.3), (0.5, 1.0)])
def test_payload_of_a_quick_lift_is_less_than_the_motor_holds(angle: float,
                                                              duration: float) -> None:
    found = followed(lifted_to(angle, duration))
    assert found.solved, found.message
    assert not found.held
    assert found.local_upper < 6 / (G * math.cos(angle)) - 0.15
    assert found.local_upper - found.payload <= 1e-3
    assert found.message.split(': ')[1].startswith('the motor of joint 1 is on its limit for 9')
    # no motion ends there with more than can be held
    assert found.local_upper < found.proved_upper
    assert found.proved_upper == pytest.approx(6 / (G * math.cos(angle)) - 0.15, rel=2e-6)


def test_quick_lift_carries_less_than_the_same_motion_without_gravity() -> None:
    task = lifted_to(0.0, 0.5)
    level = replace(task, arm=replace(task.arm, gravity=[0.0, 0.0]))
    # bang-bang: u_max T^2 = 4 M d
    free = followed(level)
    assert free.payload <= 6 * 0.5**2 / 2 - 0.1 <= free.local_upper
    assert followed(task).local_upper < free.payload


def test_joint_that_can_hold_no_more_is_named() -> None:
    # link 2 is level at the goal; the first motor has no limit
    link = Link(length=0.5, linear_density=1.0)
    arm = Arm(name='two', links=(link, link), gravity=[0, -G],
              joints=(Joint(), Joint(motor=Motor(stall_torque=4.0))))
    task = Task(arm=arm, start_positions=[-0.7, 0.5], goal_positions=[-0.5, 0.5], duration=0.4)
    found = followed(task)
    assert found.solved, found.message
    assert (found.held, found.limiting_joint) == (True, 1)
    assert found.local_upper == pytest.approx((4 / G - 0.125) / 0.5, rel=1e-9)


@pytest.mark.parametrize('method', PayloadMethod)
def test_tip_of_the_bent_arm_rests_at_its_points_with_the_largest_payload(
        crane_model: ArmModel, method: PayloadMethod) -> None:
    points = np.array([[0.1, -0.8], [0.3, -0.75]])
    task = Task.between_points(crane_model.arm, *points, elbow=1, duration=0.5, payload_mass=0.2)
    found = find_max_payload(task, model=crane_model, method=method, accuracy=0.05)
    assert found.solved, found.message
    assert found.payload > 0.5
    assert found.plan is not None
    ends = found.plan.problem.start, found.plan.problem.goal
    for state, point in zip(ends, points, strict=True):
        q, _ = equilibrium(crane_model, state[:2], found.plan.problem.parameters)
        np.testing.assert_allclose(tip_position(crane_model.arm, q), point, rtol=0, atol=1e-9)
        lighter, _ = equilibrium(crane_model, state[:2], task_parameters(task))
        assert np.linalg.norm(tip_position(crane_model.arm, lighter) - point) > 1e-3
    # the same joint angles carry the same
    angles = replace(task, start_point=[], goal_point=[], start_positions=ends[0][:2],
                     goal_positions=ends[1][:2])
    limit, joint = holding_limit(crane_model, angles, task_parameters(angles))
    if method is PayloadMethod.DIRECT:
        assert (found.held, found.limiting_joint) == (True, joint)
        assert found.local_upper == pytest.approx(limit, rel=1e-7)


def test_goal_that_the_motor_cannot_hold_with_the_first_payload_is_proved_impossible() -> None:
    found = find_max_payload(lifted_to(0.0, 2.0, payload_mass=0.5))
    assert found.status is PlanStatus.INFEASIBLE
    assert found.message.startswith('joint 1 needs 6.377 N m to hold 0.5 kg at the goal')
    assert found.message.endswith('(HOLDING)')
    # 0.4616 kg can be held
    assert found.proved_upper == pytest.approx(6 / G - 0.15, rel=2e-6)


# Refused


@pytest.mark.parametrize(('changes', 'message'), [
    ({'time_weight': 1.0},
     'time_weight is 1, but must be 0: the largest payload is that of a given duration'),
    ({'goal_position_weights': [1.0, inf]}, 'a motion which ends at rest'),
    ({'goal_velocity_weights': [inf, 0.0]}, 'a motion which ends at rest'),
    ({'goal_velocities': [0.0, 0.1]}, 'goal_velocities 0')], ids=str)
@pytest.mark.parametrize('method', PayloadMethod)
def test_task_without_a_largest_payload_is_refused(
        rigid_model: ArmModel, paper_task: TaskFactory, method: PayloadMethod,
        changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidTaskError, match=message):
        find_max_payload(paper_task(rigid_model.arm, **changes), model=rigid_model, method=method)


def test_arm_without_motor_limits_is_refused(rigid_arm: Arm, paper_task: TaskFactory) -> None:
    with pytest.raises(InvalidTaskError, match='no motor of the arm has a stall torque'):
        find_max_payload(paper_task(arm_with(rigid_arm, (inf, inf))))


def test_arm_that_stays_where_it_is_has_no_largest_payload(paper_task: TaskFactory,
                                                           rigid_arm: Arm) -> None:
    task = paper_task(rigid_arm)
    with pytest.raises(InvalidTaskError, match='goal_positions are start_positions'):
        find_max_payload(replace(task, goal_positions=task.start_positions))


@pytest.mark.parametrize(('options', 'message'), [
    ({'accuracy': 0.0}, 'accuracy is 0.0, but must be a number >= 1e-06 and <= 1000 kg'),
    ({'accuracy': 1001.0}, 'accuracy is 1001.0, but must be a number >= 1e-06 and <= 1000 kg'),
    ({'accuracy': nan}, 'accuracy is nan, but must be a finite number >= 1e-06 and <= 1000 kg'),
    ({'accuracy': 'fine'}, "accuracy is 'fine', but must be a number >= 1e-06 and <= 1000 kg"),
    ({'step': 1e-4}, 'step is 0.0001, but must be a number >= 0.001 and <= 1e+06 kg'),
    ({'step': 0.1, 'accuracy': 0.2}, 'step is 0.1, but must be a number >= 0.2 and <= 1e+06 kg'),
    ({'step': 2e6}, 'step is 2000000.0, but must be a number >= 0.001 and <= 1e+06 kg'),
    ({'step': inf}, 'step is inf, but must be a finite number >= 0.001 and <= 1e+06 kg')], ids=str)
def test_bad_option_is_named_with_its_bound(rigid_model: ArmModel, paper_task: TaskFactory,
                                            options: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        raised(paper_task(rigid_model.arm), model=rigid_model, **options)
    assert str(caught.value) == message


# Stopped


def test_search_for_any_motion_is_stopped(rigid_model: ArmModel, paper_task: TaskFactory) -> None:
    monitor = Monitor()
    monitor.canceled = lambda: monitor.phase.startswith('kinds of motion, start 3')
    found = followed(paper_task(rigid_model.arm, duration=0.6), model=rigid_model,
                     monitor=monitor)
    assert_stopped(found, PlanStatus.CANCELED)


def test_search_is_stopped_in_the_plan_with_what_the_motor_holds() -> None:
    task = lifted_to(0.0, 2.0)
    assert_stopped_at(lambda monitor: find_max_payload(task, monitor=monitor),
                      {('cold start', True): False})


@pytest.mark.parametrize('status', [PlanStatus.CANCELED, PlanStatus.TIMEOUT])
def test_plan_with_less_is_kept_if_that_with_what_the_motor_holds_is_stopped(
        status: PlanStatus) -> None:
    # a search that is given a motion comes to what the motor holds last
    task, start = lifted_to(0.0, 2.0), find_max_payload(lifted_to(0.0, 0.5))

    def search(monitor: Monitor) -> MaxPayload:
        return find_max_payload(task, monitor=monitor, start_from=start)

    last = moments(search)['continuation to the limit', True]
    found = search(stopped_after(last, status))
    assert not found.held
    assert_stopped(found, status, certified=True)


def test_time_limit_that_has_passed_leaves_nothing(rigid_model: ArmModel,
                                                   paper_task: TaskFactory) -> None:
    found = find_max_payload(paper_task(rigid_model.arm), model=rigid_model,
                             monitor=Monitor(time_limit=0.0))
    assert_stopped(found, PlanStatus.TIMEOUT)
    assert (found.plan, found.local_upper, found.extremals) == (None, inf, ())
