"""Which links and joints are too stiff to vibrate with a motion."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Elasticity, Joint, Link, Motor, Node
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.stiff_parts import find_stiff_parts, StiffParts
import numpy as np
import pytest

MOTOR = Motor(stall_torque=8.0, no_load_speed=3.5)


def arm_of(*rigidities: float, twist: float | None = None, rotor: float = 0.2,
           family: str = 'pinned_pinned', hub: float = 0.0) -> Arm:
    """Return an arm of two links with these E I and, if wanted, an elastic first joint."""
    links = tuple(Link(length=0.5, linear_density=6.0, flexural_rigidity=value, modes=1,
                       mode_family=family) for value in rigidities)
    first = Joint(motor=MOTOR) if twist is None else Joint(
        motor=replace(MOTOR, rotor_inertia=rotor), elasticity=Elasticity(stiffness=twist))
    return Arm(name='stiff', links=links, joints=(first, Joint(motor=MOTOR)),
               nodes=(Node(inertia=hub), Node(inertia=hub), Node()))


def stiff_parts(arm: Arm, duration: float = 1.0) -> StiffParts:
    task = Task(arm=arm, start_positions=[0.2, 0.5], goal_positions=[0.8, 1.0], payload_mass=1.0,
                duration=duration)
    problem = MotionProblem(ArmModel.of(arm), task, task_parameters(task))
    return find_stiff_parts(problem, 8, 2000)


@pytest.mark.parametrize(('rigidities', 'links'), [
    ((50.0, 50.0), ()), ((500.0, 500.0), ()), ((1e4, 1e4), (0, 1)), ((1e9, 50.0), (0,)),
    ((1e4, 50.0), ())])  # the stiff link would put the soft one out of step
def test_links_are_stiff_whose_vibrations_cost_next_to_nothing(rigidities: tuple[float, ...],
                                                               links: tuple[int, ...]) -> None:
    assert stiff_parts(arm_of(*rigidities)) == StiffParts(links=links)


def test_more_time_makes_links_stiff() -> None:
    """It is the angle through which they vibrate in a motion that counts."""
    assert not stiff_parts(arm_of(500.0, 500.0))
    assert stiff_parts(arm_of(500.0, 500.0), duration=4.0).links == (0, 1)


def test_elastic_joints_are_stiff_as_links_are() -> None:
    assert stiff_parts(arm_of(1e9, 1e9, twist=1e9)) == StiffParts(links=(0, 1), joints=(0,))
    assert stiff_parts(arm_of(1e9, 1e9, twist=1e3)).joints == ()


def test_what_would_ring_beyond_a_certificate_is_not_stiff() -> None:
    """A clamped link on a joint without inertia is set ringing by the torque itself."""
    assert not stiff_parts(arm_of(1e5, 1e5, family='clamped_free'))
    assert stiff_parts(arm_of(1e6, 1e6, family='clamped_free', hub=0.2)).links == (0, 1)


def test_their_coordinates_and_the_arm_without_them() -> None:
    arm = arm_of(1e9, 50.0, twist=1e9)
    parts = StiffParts(links=(0,), joints=(0,))
    assert parts.mask(arm).tolist() == [False, False, True, True, False]
    rigid = parts.rigid(arm)
    assert rigid.elastic_joints == ()
    assert [link.modes for link in rigid.links] == [0, 1]
    assert str(parts) == 'link 1 and elastic joint 1'
    assert str(StiffParts(links=(0, 1))) == 'links 1 and 2'
    assert np.flatnonzero(StiffParts().mask(arm)).size == 0
