"""Links that no motion bends: planned as rigid, certified as they are."""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Joint, Link, Motor
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
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
