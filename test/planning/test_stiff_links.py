"""Links and joints that follow a motion quasi-statically, certified with all vibrations free."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Elasticity, Joint, Link, Motor
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.collocation import Solver
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.plan_problem import plan_problem
from flex_planner.planning.ringing import FastVibrations, price_rest
from flex_planner.planning.stiff_links import find_stiff_links
from flex_planner.planning.warnings import WarningKind
import numpy as np
import pytest


def arm_with(*rigidities: float) -> Arm:
    """Return an arm of two links with these E I; 0 for a rigid one."""
    links = tuple(Link(length=0.5, linear_density=6.0, flexural_rigidity=value, modes=1)
                  if value else Link(length=0.5, linear_density=6.0) for value in rigidities)
    motor = Motor(stall_torque=8.0, no_load_speed=3.5)
    return Arm(name='stiff', links=links, joints=(Joint(motor=motor),) * 2)


def plan(*rigidities: float, duration: float = 1.0) -> Plan:
    return plan_path(Task(arm=arm_with(*rigidities), start_positions=[0.2, 0.5], payload_mass=1.0,
                          goal_positions=[0.8, 1.0], duration=duration),
                     monitor=Monitor(time_limit=60))


def stiffness_warnings(found: Plan) -> list[float | None]:
    return [warning.value for warning in found.warnings if warning.kind is WarningKind.STIFF_LINKS]


@pytest.fixture(scope='module')
def rigid() -> Plan:
    return plan(0.0, 0.0)


@pytest.mark.parametrize('rigidity', [1e5, 5e5, 1e9])
def test_the_plan_of_stiff_links_is_that_of_rigid_ones(rigid: Plan, rigidity: float) -> None:
    found = plan(rigidity, rigidity)
    assert found.solved
    assert found.cost == pytest.approx(rigid.cost, rel=1e-6)
    assert found.arm.n_modes == 2
    # the torque is that of rigid links, the certificate that of links that bend
    assert found.certificate.tip_error < 1e-6
    assert found.certificate.residual_vibration < 1e-6
    assert len(stiffness_warnings(found)) == 1


def test_the_bending_is_what_the_links_load_makes_of_it() -> None:
    found = plan(5e5, 5e5)
    samples = found.sample(np.linspace(0, 1, 21))
    bends = samples.coordinates[:, 2:]
    assert np.abs(bends).max() == pytest.approx(stiffness_warnings(found)[0], rel=0.1)
    # modes follow their load without vibration: they accelerate as slowly as the joints
    assert np.abs(samples.accelerations[:, 2:]).max() < 1e-4


def test_links_that_bend_are_planned_as_they_are(rigid: Plan) -> None:
    found = plan(1e3, 1e3)
    assert found.solved
    assert stiffness_warnings(found) == []
    assert found.cost - rigid.cost > 1e-5


def steady(rigidity: float, gravity: float = 0.0, damping: float = 0.0) -> Task:
    """Return a motion on which no motor meets its limit."""
    link = Link(length=0.5, linear_density=6.0, flexural_rigidity=rigidity, modes=1,
                damping_ratio=damping) if rigidity else Link(length=0.5, linear_density=6.0)
    arm = Arm(name='steady', links=(link, link), gravity=[0.0, -gravity],
              joints=(Joint(motor=Motor(stall_torque=200.0)),) * 2)
    return Task(arm=arm, start_positions=[-0.8, 0.5], goal_positions=[-0.2, 1.0], duration=1.0,
                payload_mass=1.0)


def problem_of(task: Task) -> MotionProblem:
    return MotionProblem(ArmModel.of(task.arm), task, task_parameters(task))


def plan_fast(task: Task) -> Plan:
    return plan_path(task, search='fast', monitor=Monitor(time_limit=60))


@pytest.mark.parametrize('rigidity', [5e3, 5e4, 5e5])
def test_stiff_links_take_the_work_of_rigid_ones(rigidity: float) -> None:
    found, rigid = plan_fast(steady(rigidity)), plan_fast(steady(0.0))
    assert found.solved
    assert found.iterations == rigid.iterations
    assert found.mesh_intervals == rigid.mesh_intervals


@pytest.mark.parametrize('rigidity', [5e3, 1e4])
def test_the_arm_as_it_is_costs_more_by_what_brings_it_to_rest(rigidity: float) -> None:
    task = steady(rigidity)
    found, full = plan_fast(task), plan_problem(problem_of(task), Solver())
    assert stiffness_warnings(full) == []
    assert found.solution is not None
    path = found.sample(np.linspace(0, 1, 9)).coordinates
    path[[0, -1]] = found.problem.start[:4], found.problem.goal[:4]
    along = [FastVibrations.about(found.problem, np.concatenate([q, np.zeros(4)]),
                                  np.arange(4) > 1) for q in path]
    left = [along[k].amplitudes(found.solution.nodes[k, :4] - path[k]) for k in (0, -1)]
    # by the phase in which the vibrations come to the goal
    assert 0 < full.cost - found.cost < 2 * price_rest(along, left[0], left[1])
    assert full.cost == pytest.approx(found.cost, rel=1e-5)


def test_what_is_missed_falls_with_the_stiffness() -> None:
    """Bending, tip and vibration are of the order of the inverse square of the frequency."""
    softer, stiffer = (plan_fast(steady(rigidity)) for rigidity in (5e3, 5e5))
    bends = [stiffness_warnings(found)[0] for found in (softer, stiffer)]
    assert bends[0] == pytest.approx(100 * (bends[1] or 0.0), rel=1e-3)
    # by a hundred, times what the phase at the goal makes of it
    for name in ('tip_error', 'residual_vibration'):
        first, second = (getattr(found.certificate, name) for found in (softer, stiffer))
        assert 30 < first / second < 300


def test_damping_is_that_of_the_arm() -> None:
    """What the start sets ringing has died out; the jump at the goal has not."""
    free, damped = (plan_fast(steady(5e3, damping=ratio)) for ratio in (0.0, 0.05))
    assert damped.cost == pytest.approx(free.cost, rel=1e-6)
    assert damped.certificate.boundary_error < 1e-3 * free.certificate.boundary_error


def test_what_cannot_be_certified_is_planned_as_it_is() -> None:
    """With a motor on its limit no torque is left for what gravity bends."""
    task = steady(5e3, gravity=9.81)
    motor = Motor(stall_torque=42.0, no_load_speed=3.5)
    task = replace(task, arm=replace(task.arm, joints=(Joint(motor=motor),) * 2))
    assert find_stiff_links(problem_of(task), Solver()) is not None
    found = plan_fast(task)
    assert found.solved
    assert stiffness_warnings(found) == []
    assert found.certificate.tip_error < 1e-9


def test_a_stiff_elastic_joint_is_planned_as_rigid() -> None:
    motor = Motor(stall_torque=200.0, rotor_inertia=0.2)
    rigid = steady(0.0)
    rigid = replace(rigid, arm=replace(rigid.arm, joints=(Joint(motor=motor),) * 2))
    joint = Joint(motor=motor, elasticity=Elasticity(stiffness=1e8))
    elastic = Task(arm=replace(rigid.arm, joints=(joint,) * 2), payload_mass=1.0, duration=1.0,
                   start_positions=rigid.start_positions, goal_positions=rigid.goal_positions)
    found, known = plan_fast(elastic), plan_fast(rigid)
    assert found.solved
    assert found.cost == pytest.approx(known.cost, rel=1e-6)
    assert found.iterations == known.iterations
    [told] = [one for one in found.warnings if one.kind is WarningKind.STIFF_LINKS]
    assert told.sentence.startswith('elastic joints 1 and 2: too stiff')
    assert ' rad; they follow quasi-statically' in told.sentence


def test_a_plan_says_what_follows_and_what_rest_would_cost() -> None:
    [told] = [one for one in plan_fast(steady(5e3)).warnings
              if one.kind is WarningKind.STIFF_LINKS]
    assert told.sentence.startswith('links 1 and 2: too stiff to vibrate with the motion, which '
                                    'bends by up to ')
    assert 'they follow quasi-statically. To bring their vibrations to rest' in told.sentence
    assert told.sentence.endswith('that of the arm with all vibrations free')


def test_a_stiff_link_beside_a_soft_one_is_rigid_alone() -> None:
    found, known = plan(1e9, 50.0), plan(0.0, 50.0)
    assert found.solved
    assert found.cost == pytest.approx(known.cost, rel=1e-6)
    assert found.certificate.residual_vibration < 1e-6
    assert len(stiffness_warnings(found)) == 1


def test_the_largest_payload_of_stiff_links_is_that_of_rigid_ones() -> None:
    payloads = [find_max_payload(
        Task(arm=arm, start_positions=[0.4, -0.8], goal_positions=[0.9, -0.5], duration=1.0),
        monitor=Monitor(time_limit=60), search='fast')
        for arm in (arm_with(0.0, 0.0), arm_with(1e9, 1e9))]
    assert payloads[1].plan is not None
    assert payloads[1].plan.arm.n_modes == 2
    assert payloads[1].payload == pytest.approx(payloads[0].payload, rel=1e-6)


def test_the_shortest_duration_is_that_of_rigid_links_within_its_bracket() -> None:
    """Where J differs by more than a plan may, its price makes little of it in seconds."""
    rigid, found = (find_min_duration(
        Task(arm=arm, start_positions=[0.4, -0.8], goal_positions=[0.9, -0.5], duration=1.0),
        monitor=Monitor(time_limit=60), search='fast')
        for arm in (arm_with(0.0, 0.0), arm_with(2e4, 2e4)))
    assert found.solved
    assert found.iterations == rigid.iterations
    assert found.duration == pytest.approx(rigid.duration, abs=0.1 * rigid.bracket_width)
    assert found.plan is not None
    assert len(stiffness_warnings(found.plan)) == 1
    assert found.plan.certificate.tip_error < 1e-5
