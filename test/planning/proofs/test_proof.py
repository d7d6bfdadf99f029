"""What is called impossible is: closed forms, motions that exist, and premises one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math
from typing import Any

from factories import TaskFactory
from flex_planner.arms.arm import Arm, BeamSection, Elasticity, Joint, Link, Motor, Node
from flex_planner.arms.mode_shapes import FAMILIES
from flex_planner.base.errors import HoldingError
from flex_planner.base.validation import Array
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.proofs import (
    bound_duration,
    bound_payload,
    find_doubt,
    find_proof,
    is_payload_bounded,
    payload_bounds,
    ProofName,
    prove_not_held,
    short_durations,
)
from flex_planner.planning.proofs.duration_bounds import bound_by_power, energy_limits
from flex_planner.planning.proofs.energy_growth import EnergyLimits
from flex_planner.planning.proofs.motion_facts import MotionFacts
from known_limits import G, HEAVIEST, lifted_to, one_link, SHORTEST
from light_model import LightModel
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

inf = math.inf


def problem_of(task: Task) -> MotionProblem:
    model: Any = LightModel(task.arm)
    return MotionProblem(model, task, task_parameters(task))


def with_motor(task: Task, friction: float = 0.0, **motor: float) -> Task:
    """Return a task with motors that are limited by a line alone, unless they have a cap."""
    limits = {'stall_torque': 2.0, 'max_torque': inf, **motor}
    joints = tuple(Joint(motor=Motor(**limits), viscous_friction=friction)
                   for _ in task.arm.joints)
    return replace(task, arm=replace(task.arm, joints=joints))


def two_links(**changes: Any) -> Task:
    links = (Link(length=0.6, linear_density=4.0), Link(length=0.4, linear_density=3.0))
    joints = (Joint(motor=Motor(stall_torque=9.0, no_load_speed=5.0, max_torque=inf)),
              Joint(motor=Motor(stall_torque=4.0, no_load_speed=6.0, max_torque=inf)))
    values: dict[str, Any] = {'start_positions': [0.2, 1.0], 'goal_positions': [1.4, -0.6],
                              'duration': 0.9, 'payload_mass': 1.5}
    return Task(arm=Arm(name='two', links=links, joints=joints), **{**values, **changes})


# Closed forms: one link, I = 1 kg m^2 + m_p (1 m)^2, K_1 = 2 N m, by 0.5 rad


def quickest(inertia: float, drag: float) -> float:
    """Return the least time from rest to rest of one link by 0.5 rad: drive, then brake."""
    if not drag:
        return 2 * math.sqrt(0.5 * inertia / 2.0)
    scale, end = inertia / drag, 2.0 / drag  # of time, and the speed of a free link

    def way(share: float) -> float:
        """Return the way to this share of that speed and back to rest."""
        return scale * end * (-math.log1p(-share) - math.log1p(share))

    share = brentq(lambda share: way(share) - 0.5, 0, 1 - 1e-15)
    return scale * (math.log1p(share) - math.log1p(-share))


@pytest.mark.parametrize(('slope', 'friction', 'close'), [
    (0.0, 0.0, 0.99), (1.0, 0.0, 0.99), (0.7, 0.3, 0.99), (0.0, 0.8, 0.99),
    # near its no-load speed a link is taken to be driven as at half of it
    (8.0, 1.0, 0.6)])
@pytest.mark.parametrize('payload', [0.0, 1.5])
def test_bounds_of_one_link_are_nearly_what_it_can_do(slope: float, friction: float,
                                                      close: float, payload: float) -> None:
    motor = {'no_load_speed': 2 / slope} if slope else {}
    task = with_motor(one_link(1.0, payload_mass=payload), friction, **motor)
    exact = quickest(1 + payload, slope + friction)
    assert close * exact < bound_duration(problem_of(task)) <= exact
    # the payload of a duration that it just takes; bounds are found to 0.5 %
    found = bound_payload(problem_of(replace(task, duration=exact)))
    assert found.payload >= payload
    if close > 0.9:
        assert found.payload <= payload + 0.03 * (1 + payload)


@pytest.mark.parametrize('slope', [0.7, 2.0])
def test_bounds_of_a_capped_motor_are_nearly_what_it_can_do(slope: float) -> None:
    # driven on its line, K_1 - K_2 w, and braked by its cap K_1; M = 1 kg m^2
    task, end = with_motor(one_link(1.0), no_load_speed=2 / slope, max_torque=2.0), 2.0 / slope

    def way(share: float) -> float:
        return end / slope * (-math.log1p(-share) - share) + (share * end)**2 / 4

    share = brentq(lambda share: way(share) - 0.5, 0, 1 - 1e-15)
    exact = -math.log1p(-share) / slope + share * end / 2
    uncapped = with_motor(task, no_load_speed=end)
    assert bound_duration(problem_of(uncapped)) < bound_duration(problem_of(task)) <= exact
    assert bound_duration(problem_of(task)) > 0.97 * exact


def test_motor_that_is_driven_far_beyond_its_line_brakes_with_more_than_its_cap() -> None:
    # from 20 rad/s: w' = 2 - 2 w down to 2 rad/s, where that is the cap, then w' = -2
    task = with_motor(one_link(1.0), no_load_speed=1.0, max_torque=2.0)
    seconds = math.log(19) / 2 + 1
    ends = [0.1 + math.log(19) / 2 + 9 + 1]
    braked = replace(task, start_velocities=[20.0], goal_positions=ends)
    assert 0.3 * seconds < bound_duration(problem_of(braked)) <= seconds


def test_cap_below_the_line_bounds_power_and_drive() -> None:
    task = with_motor(one_link(1.0), no_load_speed=40.0, max_torque=0.5)
    # far from the knee of the line the cap is all: 0.5 N m there and back
    exact = 2 * math.sqrt(0.5 / 0.5)
    assert 0.98 * exact < bound_duration(problem_of(task)) <= exact
    # 2 N m at standstill, -0.05 N m s: 0.5 N m up to 30 rad/s
    assert MotionFacts(problem_of(task)).power == pytest.approx(15.0, rel=1e-12)
    slow = with_motor(task, no_load_speed=40.0, max_torque=1.5)
    assert MotionFacts(problem_of(slow)).power == pytest.approx(2.0 * 40 / 4, rel=1e-12)
    rubbed = with_motor(task, 0.01, no_load_speed=40.0, max_torque=0.5)
    assert MotionFacts(problem_of(rubbed)).power == pytest.approx(0.5**2 / 0.04, rel=1e-12)


@pytest.mark.parametrize('payload', [0.0, 4.0])
def test_power_bounds_in_closed_form(payload: float) -> None:
    # m <= 8/9 P T^3 / d^2, of which the link is a third of its 3 kg; a quick motor has power alone
    task = with_motor(one_link(0.05, payload_mass=payload), no_load_speed=2e-3)
    power, chord = 2.0 * 2e-3 / 4, 2 * math.sin(0.25)
    seconds = (9 * (payload + 1.0) * chord**2 / (8 * power))**(1 / 3)
    proof = find_proof(problem_of(task))
    assert proof is not None
    assert proof.name is ProofName.POWER
    carried = f'{payload:.4g} kg' if payload else 'the tip'
    assert proof.sentence == (f'the motors give at most 0.001 W: moving {carried} by 0.495 m '
                              f'takes at least {seconds:.4g} s, and 0.05 s were asked for')
    longer = problem_of(replace(task, duration=20.0))
    expected = 8 / 9 * power * 20**3 / chord**2 - 1
    assert bound_payload(longer).payload <= expected * (1 + 1e-5)


def test_power_alone_bounds_flexible_links_without_gravity() -> None:
    link = Link(length=1.0, linear_density=3.0, flexural_rigidity=20.0, modes=2)
    task = with_motor(one_link(0.8, payload_mass=1.0), no_load_speed=3.0)
    task = Task(arm=replace(task.arm, links=(link,), nodes=(Node(), Node(mass=0.5))),
                start_positions=[0.1], goal_positions=[0.6], duration=0.8, payload_mass=1.0)
    power, chord = 2.0 * 3.0 / 4, 2 * math.sin(0.25)
    found = bound_payload(problem_of(task))
    assert found.payload == pytest.approx(8 / 9 * power * 0.8**3 / chord**2 - 0.5, rel=1e-5)
    assert found.proof is not None
    assert found.proof.sentence == (f'the motors give at most 1.5 W: they can bring no more than '
                                    f'{found.payload:.4g} kg to the goal in 0.8 s')
    assert bound_duration(problem_of(task)) == pytest.approx(
        (9 * 1.5 * chord**2 / (8 * power))**(1 / 3), rel=1e-5)


def test_speed_at_the_start_counts_as_energy() -> None:
    # int_0^T sqrt(2 (E + P t) / m) dt = d with E = m v^2 / 2, by quadrature
    task = replace(with_motor(one_link(1.0, payload_mass=1.0), no_load_speed=0.5),
                   start_velocities=[0.4])
    power, mass, chord = 0.25, 2.0, 2 * math.sin(0.25)
    energy = mass * 0.4**2 / 2

    def way(T: float) -> float:
        t = (np.arange(4000) + 0.5) * T / 4000
        return float(np.sqrt(2 * (energy + power * t) / mass).mean()) * T

    bound = bound_duration(problem_of(task))
    assert bound >= brentq(lambda T: way(T) - chord, 0, 5) * (1 - 1e-5)
    assert bound < bound_duration(problem_of(replace(task, start_velocities=[0.0])))


def test_coulomb_friction_helps_to_brake_but_not_to_drive() -> None:
    # from 0.8 rad/s to rest: I v / (K_1 + tau_c); the rotor is part of I
    rotor = {'gear_ratio': 10.0, 'rotor_inertia': 0.005, 'max_torque': inf}
    joint = Joint(motor=Motor(stall_torque=2.0, **rotor), coulomb_friction=0.6)
    task = one_link(1.0)
    task = replace(task, arm=replace(task.arm, joints=(joint,)))
    seconds = 1.5 * 0.8 / 2.6
    braked = replace(task, start_velocities=[0.8],
                     goal_positions=task.start_positions + 0.8 * seconds / 2)
    assert 0.99 * seconds < bound_duration(problem_of(braked)) <= seconds
    # from rest to rest without friction, but with what it adds to the braking torque
    quick = math.sqrt(2 * 0.5 * 1.5 * (1 / 2.0 + 1 / 2.6))
    assert 0.99 * quick < bound_duration(problem_of(task)) <= quick


def test_payload_off_the_tip_is_moved_where_it_is() -> None:
    # a hook of 1 m across: the payload is sqrt(2) m from the joint, and moves so much further
    task = with_motor(one_link(0.05, payload_mass=4.0), no_load_speed=2e-3)
    task = replace(task, arm=replace(task.arm, payload_com=[0.0, 1.0]))
    power, chord = 2.0 * 2e-3 / 4, math.sqrt(2) * 2 * math.sin(0.25)
    # 1 kg m^2 of the link at that distance
    seconds = (9 * (4.0 + 1.0 / 2) * chord**2 / (8 * power))**(1 / 3)
    found = bound_by_power(MotionFacts(problem_of(task))).seconds
    assert found == pytest.approx(seconds, rel=1e-5)


def test_lifting_takes_the_time_of_its_work() -> None:
    # 0.3 kg and 1 m of link, 2 kg, from -1.2 to 1.2 rad: m g h in the power of 40 N m at 0.2 rad/s
    task = with_motor(lifted_to(1.2, 5.0, payload_mass=2.0), stall_torque=40.0, no_load_speed=0.2)
    task = replace(task, start_positions=[-1.2])
    work, power = (2 + 0.15) * G * 2 * math.sin(1.2), 40 * 0.2 / 4
    proof = find_proof(problem_of(task))
    assert proof is not None
    assert (f'bringing the arm with 2 kg to the energy of its goal takes at least '
            f'{work / power:.4g} s') in proof.sentence
    found = bound_payload(problem_of(task))
    assert found.payload == pytest.approx(power * 5 / (G * 2 * math.sin(1.2)) - 0.15, rel=1e-5)


def test_payload_that_cannot_be_held_is_named_with_its_joint() -> None:
    task = lifted_to(0.3, 2.0)
    found = bound_payload(problem_of(task))
    limit = 6 / (G * math.cos(0.3)) - 0.15
    assert found.payload == pytest.approx(limit, rel=1e-5)
    assert found.payload >= limit
    assert found.proof is not None
    assert (found.joint, found.proof.name) == (0, ProofName.HOLDING)
    assert found.proof.sentence == f'joint 1 can hold no more than {limit:.6g} kg at the goal'


def test_refused_goal_is_a_proof() -> None:
    task = lifted_to(0.0, 2.0, payload_mass=6.0)
    with pytest.raises(HoldingError) as raised:
        problem_of(task)
    proof = prove_not_held(raised.value, task.payload_mass)
    assert (proof.name, proof.sentence) == (ProofName.HOLDING, (
        'joint 1 needs 60.33 N m to hold 6 kg at the goal, its motor gives 6: no motion can end '
        'there'))


# Motions that exist


@pytest.mark.parametrize(('links', 'motors', 'ends', 'duration', 'payload'), [
    # random counter-examples to limits found by search: these payloads are carried
    (((0.693, 3.384), (0.402, 5.717)), ((12.089, 7.765), (0.759, 3.882)),
     ((93, -43), (26, -112)), 1.65, 1.9746),
    (((0.609, 4.518), (0.326, 10.135)), ((14.022, 3.618), (1.24, 5.304)),
     ((-3, -13), (-63, 184)), 2.19, 30.80)])
def test_payloads_that_are_carried_are_not_excluded(
        links: tuple[tuple[float, float], ...], motors: tuple[tuple[float, float], ...],
        ends: tuple[tuple[float, float], ...], duration: float, payload: float) -> None:
    arm = Arm(name='two', links=tuple(Link(length=L, linear_density=rho) for L, rho in links),
              joints=tuple(Joint(motor=Motor(stall_torque=stall, no_load_speed=speed))
                           for stall, speed in motors))
    problem = problem_of(Task(arm=arm, start_positions=np.radians(ends[0]), payload_mass=payload,
                              goal_positions=np.radians(ends[1]), duration=duration))
    found = bound_payload(problem)
    assert found.proof is not None
    assert found.proof.name is ProofName.ENERGY
    # within the factor that was found: 5.3 and 22.2
    assert payload < found.payload < 23 * payload
    assert 0.25 * duration < bound_duration(problem) < duration
    assert find_proof(problem, thorough=True) is None


@pytest.mark.parametrize('name', HEAVIEST)
def test_limits_of_the_paper_are_not_excluded(request: pytest.FixtureRequest, name: str,
                                              paper_task: TaskFactory) -> None:
    arm = request.getfixturevalue(f'{name}_arm')
    assert bound_payload(problem_of(paper_task(arm, HEAVIEST[name]))).payload > HEAVIEST[name]
    problem = problem_of(paper_task(arm, duration=SHORTEST[name]))
    assert 0.2 * SHORTEST[name] < bound_duration(problem) < SHORTEST[name]
    assert find_proof(problem, thorough=True) is None


@pytest.mark.parametrize(('task', 'close'), [
    (with_motor(one_link(1.6), 0.1, no_load_speed=2.5), 1.04), (two_links(), 16.0),
    (two_links(payload_inertia=0.05, duration=0.7), 28.0)], ids=['one', 'two', 'inertia'])
def test_payloads_that_ipopt_finds_are_not_excluded(task: Task, close: float) -> None:
    problem = problem_of(task)
    direct = DirectProblem(problem.model, DirectSettings(intervals=24, degree=4, tolerance=1e-7))
    # a high price: nearly the largest payload, near the straight line that it starts from
    found = direct.solve(problem.parameters, problem.start, problem.goal, task.duration,
                         free=Free.PAYLOAD, price=1e5)
    assert found.converged
    # the factors are those that were found: bounds of two links are far
    assert found.payload < bound_payload(problem).payload < close * found.payload
    heavy = problem_of(replace(task, payload_mass=found.payload))
    assert 0.2 * task.duration < bound_duration(heavy) < task.duration


def test_duration_that_ipopt_finds_for_a_data_sheet_arm_is_nearly_its_bound() -> None:
    motor = Motor(stall_torque=6.0, no_load_speed=5.0, max_torque=3.0, gear_ratio=50.0,
                  rotor_inertia=5e-5)
    body = Link(length=0.6, linear_density=2.0, center_of_mass=(0.2, 0.1), inertia=0.02)
    arm = Arm(name='body', links=(body,), payload_com=[0.05, -0.1], joints=(
        Joint(motor=motor, viscous_friction=0.1, coulomb_friction=0.3),))
    problem = problem_of(Task(arm=arm, start_positions=[0.2], goal_positions=[1.4], duration=1.0,
                              payload_mass=1.5))
    direct = DirectProblem(problem.model, DirectSettings(intervals=24, degree=4, tolerance=1e-7))
    found = direct.solve(problem.parameters, problem.start, problem.goal, 1.0,
                         free=Free.DURATION, price=1e5)
    assert found.converged
    # what Coulomb friction takes from driving is not in the bound
    assert 0.9 * found.duration < bound_duration(problem) <= found.duration


def drawn_arm(rng: np.random.Generator) -> Arm:
    """Return an arm with some of everything."""
    flexible, n = rng.random() < 0.3, int(rng.integers(1, 5))
    modes = [int(flexible)] * n
    links = tuple(Link(
        length=rng.uniform(0.3, 1.2), linear_density=10**rng.uniform(-1, 1), modes=count,
        flexural_rigidity=10**rng.uniform(0, 1) if count else inf,
        mode_family=str(rng.choice(list(FAMILIES)))) for count in modes[:2 if flexible else n])
    joints = tuple(Joint(
        motor=Motor(stall_torque=10**rng.uniform(0, 1),
                    no_load_speed=float(rng.choice([inf, 10**rng.uniform(-0.5, 1.3)])),
                    max_torque=inf),
        viscous_friction=float(rng.choice([0.0, 0.5]))) for _ in links)
    nodes = tuple(Node(mass=rng.uniform(0, 2), inertia=rng.uniform(0, 0.2))
                  for _ in range(len(links) + 1))
    return Arm(name='drawn', links=links, joints=joints, nodes=nodes,
               gravity=rng.choice([0.0, 7.0]) * rng.normal(size=2))


def drawn_data_sheet(rng: np.random.Generator) -> Arm:
    """Return such an arm with some of everything that data sheets have."""
    arm, elastic = drawn_arm(rng), rng.random() < 0.2
    joints = tuple(replace(
        joint, motor=replace(joint.motor, gear_ratio=50, max_torque=rng.choice(
            [inf, joint.motor.stall_torque * rng.uniform(0.2, 1.2)]),
                             rotor_inertia=1e-4 * max(elastic, rng.integers(2))),
        coulomb_friction=float(rng.choice([0.0, 0.4])), housing=Node(mass=1.0, inertia=0.02),
        elasticity=Elasticity(stiffness=800.0, damping=0.1) if elastic else None)
        for joint in arm.joints)
    halves = BeamSection(share=0.5, density=1.5), BeamSection(share=0.5, density=0.5,
                                                              rigidity=0.4)
    links = tuple(replace(link, sections=halves) if link.modes or rng.random() < 0.5 else replace(
        link, center_of_mass=tuple(rng.uniform(-0.3, 0.8, 2)), inertia=0.02)
        for link in arm.links)
    return replace(arm, links=links, joints=joints,
                   payload_com=rng.choice([0.0, 0.2]) * rng.normal(size=2))


def drive(task: Task, rng: np.random.Generator) -> tuple[Array, float]:
    """Return the state after a motion with motors on their limits, and its duration."""
    problem, model = problem_of(task), LightModel(task.arm)
    n, n_t = task.arm.n_joints, task.arm.n_coordinates
    limits = problem.parameters.torque_limits
    stall = limits.standstill
    rate, x = model.state_rate(problem.p), problem.start.copy()
    inertia = np.diag(model.mass_and_energy(x[None], problem.p)[0][0])[:n]
    duration = float(np.sqrt((inertia / stall).mean()) * 10**rng.uniform(-0.8, 0.0))
    signs, turn = rng.choice([-1.0, 1.0], n), rng.uniform(0.4, 0.9)
    for sign, part in ((1.0, turn), (-1.0, 1 - turn)):
        x = solve_ivp(lambda t, state, side=sign * signs * inf: rate(
            state, limits.bound(side, state[n_t:n_t + n])), (0, part * duration), x,
            method='LSODA', rtol=1e-9, atol=1e-9).y[:, -1]
    return x, duration


@pytest.mark.parametrize('draw', [drawn_arm, drawn_data_sheet])
@pytest.mark.parametrize('seed', range(24))
def test_motion_of_driven_arm_is_not_called_impossible(
        draw: Callable[[np.random.Generator], Arm], seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm = draw(rng)
    n, n_t = arm.n_joints, arm.n_coordinates
    start = rng.uniform(-3, 3, n)
    task = Task(arm=arm, start_positions=start, goal_positions=start, duration=1.0,
                payload_mass=float(10**rng.uniform(-2, 1)), goal_velocity_weights=[0.0] * n,
                start_velocities=rng.choice([0.0, 1.0]) * rng.normal(size=n))
    end, duration = drive(task, rng)
    reached = replace(task, goal_positions=end[:n], duration=duration,
                      goal_velocities=end[n_t:], goal_velocity_weights=[inf] * n_t)
    problem = problem_of(reached)
    problem.goal = end  # bent as it is
    # bounds of one link are reached to 1e-4, the motion is exact to 1e-8
    assert 0 <= bound_duration(problem) <= duration
    assert bound_payload(problem).payload >= reached.payload_mass
    assert find_proof(problem, thorough=True) is None
    assert find_proof(problem_of(replace(task, time_weight=1.0)), thorough=True) is None


# Premises


def test_bounds_follow_what_they_depend_on() -> None:
    task = two_links()
    payloads = [bound_duration(problem_of(replace(task, payload_mass=m))) for m in (0, 1, 10, 1e3)]
    durations = [bound_payload(problem_of(replace(task, duration=T))).payload
                 for T in (0.3, 0.5, 1.0, 4.0)]
    for values in (payloads, durations):
        assert (np.diff(values) > 0).all()
    # the same statement both ways: what is too heavy for a duration takes longer
    heaviest = durations[2]
    heavy = replace(task, duration=1.0, payload_mass=1.001 * heaviest)
    assert bound_duration(problem_of(heavy)) > 0.999
    assert bound_duration(problem_of(replace(heavy, payload_mass=0.95 * heaviest))) < 1.0


@pytest.mark.parametrize(('changes', 'duration', 'payload'), [
    ({'goal_position_weights': [1.0, 1.0]}, False, False),
    ({'goal_position_weights': [inf, 1.0]}, True, False),  # a joint still has its way to go
    ({'goal_velocity_weights': [0.0, 0.0]}, True, True),  # driven, not braked
    ({'goal_positions': [0.2, 1.0]}, False, False),
    ({'time_weight': 1.0}, True, False)], ids=str)
def test_bound_needs_its_premises(changes: dict[str, Any], duration: bool,
                                  payload: bool) -> None:
    problem, whole = problem_of(two_links(**changes)), problem_of(two_links())
    assert (bound_duration(problem) > 0) == duration
    assert bound_duration(problem) <= bound_duration(whole)
    found = bound_payload(problem)
    assert (found.payload < inf) == (found.proof is not None) == payload
    assert found.payload >= bound_payload(whole).payload


@pytest.mark.parametrize('motor', [{'stall_torque': inf}, {}], ids=str)
def test_motor_without_limit_bounds_nothing(motor: dict[str, float]) -> None:
    task = two_links()
    joints = (task.arm.joints[0], Joint(motor=Motor(**motor)))
    problem = problem_of(replace(task, arm=replace(task.arm, joints=joints)))
    assert (bound_duration(problem), bound_payload(problem).payload) == (0.0, inf)


def test_power_needs_speed_limits_and_torque_does_not() -> None:
    task = with_motor(two_links(duration=0.4), stall_torque=4.0)
    found = bound_payload(problem_of(task))
    assert found.proof is not None
    assert found.proof.name is ProofName.ENERGY
    assert 'the torque of the motors can bring no more than' in found.proof.sentence


def test_gravity_leaves_flexible_links_without_a_bound_of_energy() -> None:
    link = Link(length=0.5, linear_density=3.0, flexural_rigidity=20.0, modes=1,
                mode_family='clamped_free')
    task = two_links()
    arm = replace(task.arm, links=(link, link), gravity=[0.0, -1.0])
    assert bound_payload(problem_of(replace(two_links(), arm=arm))).payload == inf


def test_torques_are_looked_at_where_power_is_scarce_or_the_motion_hasty() -> None:
    problem = problem_of(two_links())
    seconds = bound_duration(problem)
    shorter = problem.with_changes(duration=0.98 * seconds)
    proof = find_proof(shorter)
    assert proof is not None
    assert proof.name is ProofName.ENERGY
    assert proof.sentence == ('within the torque of the motors turning joint 1 by 68.8 deg takes '
                              f'at least {bound_duration(shorter):.4g} s, and '
                              f'{0.98 * seconds:.4g} s were asked for')
    # a quick motor is limited by its torque: its power does not tell
    quick = problem_of(with_motor(two_links(duration=0.2), stall_torque=0.5, no_load_speed=1e4))
    hasty = find_proof(quick)
    assert hasty is not None
    assert hasty.name is ProofName.ENERGY
    enough = quick.with_changes(duration=1.01 * bound_duration(quick))
    assert find_proof(enough, thorough=True) is None


# What is asked for less often


@pytest.mark.parametrize('carried', [0.1, 0.8, 1.5])
def test_bound_that_begins_at_what_is_carried_is_as_close(carried: float) -> None:
    problem = problem_of(with_motor(one_link(1.6), 0.1, no_load_speed=2.5))
    exact, found = bound_payload(problem).payload, bound_payload(problem, carried).payload
    assert carried < exact
    assert found == pytest.approx(exact, rel=6e-3)  # each is within 5e-3 of the least excluded


@pytest.mark.parametrize('carried', [0.0, 0.1, 1.5])
def test_bound_takes_few_payloads(carried: float, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[float] = []

    def limits(facts: MotionFacts, payload: float, *rest: Any, **options: Any) -> EnergyLimits:
        tried.append(payload)
        return energy_limits(facts, payload, *rest, **options)

    monkeypatch.setattr(payload_bounds, 'energy_limits', limits)
    found = bound_payload(problem_of(with_motor(one_link(1.6), 0.1, no_load_speed=2.5)), carried)
    assert found.payload in tried
    assert max(payload for payload in tried if payload < found.payload) > found.payload / 1.0051
    assert len(tried) <= 9  # halving the ratio of the bracket takes 12 and more


@pytest.mark.parametrize('task', [
    two_links(), with_motor(two_links(duration=0.4), stall_torque=4.0), one_link(1.6),
    with_motor(two_links(), stall_torque=inf)])
def test_it_is_known_whether_there_is_a_bound_before_it_is(task: Task) -> None:
    problem = problem_of(task)
    assert is_payload_bounded(problem) is bool(np.isfinite(bound_payload(problem).payload))


@pytest.mark.parametrize(('duration', 'doubted'), [
    # the even motion takes 3 T for the first; rigid links cannot do it in 3 T for the last
    (1.0, False), (0.3, False), (0.05, True)])
def test_doubt_is_the_same_without_an_even_motion(duration: float, doubted: bool,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    links = tuple(replace(link, modes=1, flexural_rigidity=50.0) for link in two_links().arm.links)
    task = two_links(duration=duration)
    problem = problem_of(replace(
        task, arm=replace(task.arm, links=links), position_weights=np.zeros(4),
        **{name: np.zeros(4) for name in ('velocity_weights', 'start_velocities',
                                          'goal_velocities')},
        **{name: np.full(4, inf) for name in ('goal_position_weights',
                                              'goal_velocity_weights')}))
    assert (find_doubt(problem) is not None) is doubted
    monkeypatch.setattr(short_durations, '_moves_evenly', lambda problem, duration: False)
    assert (find_doubt(problem) is not None) is doubted
