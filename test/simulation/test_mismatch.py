"""What is different about a simulated arm has the effect that mechanics say it has."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.base.errors import InvalidSizeError, InvalidValueError, NotFiniteError
from flex_planner.control.joint_controller import Gains
from flex_planner.control.joint_reference import JointReference
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.simulation.joint_control import Disturbance
from flex_planner.simulation.mismatch import Mismatch
from flex_planner.simulation.plant import Control, Plant
import numpy as np
import pytest

LENGTH, DENSITY, PAYLOAD, FRICTION, TORQUE = 0.8, 2.0, 0.5, 0.4, 0.3
INERTIA = DENSITY * LENGTH**3 / 3 + PAYLOAD * LENGTH**2  # about the joint


def rod() -> Arm:
    """Return a rigid link that turns freely, in no gravity."""
    return Arm(name='rod', links=(Link(length=LENGTH, linear_density=DENSITY),),
               joints=(Joint(),))


def turned(seconds: float, mismatch: Mismatch | None = None, payload_mass: float = PAYLOAD,
           torque: float = TORQUE, disturbance: Disturbance | None = None) -> Plant:
    """Return the rod after a torque has turned it."""
    plant = Plant(ArmDynamics((mismatch or Mismatch()).apply(rod())),
                  Control(gains=Gains.of(1, 0, 0), disturbance=disturbance or Disturbance()),
                  payload_mass=payload_mass, positions=np.zeros(1))
    plant.advance(0.05)  # at rest before it is told to move
    plant.follow(JointReference.hold(np.zeros(1), np.array([torque])))
    plant.advance(0.05 + seconds)
    return plant


def test_payload_slows_the_arm_down_as_its_inertia_does() -> None:
    light, heavy = (turned(1.0, payload_mass=mass).state[0] for mass in (PAYLOAD, 2 * PAYLOAD))
    assert light == pytest.approx(TORQUE / INERTIA / 2, rel=1e-9)
    assert heavy == pytest.approx(TORQUE / (INERTIA + PAYLOAD * LENGTH**2) / 2, rel=1e-9)


def test_added_friction_brakes_as_in_the_closed_form() -> None:
    plant = turned(1.0, Mismatch(added_friction=np.array([FRICTION])))
    speed = TORQUE / FRICTION * (1 - np.exp(-FRICTION / INERTIA))
    assert plant.state[1] == pytest.approx(speed, rel=1e-8)
    assert speed < 0.8 * TORQUE / INERTIA


@pytest.mark.parametrize(('start', 'duration'), [(0.1, 0.2), (0.1004, 0.0003), (0.0333, 0.1118)])
def test_disturbance_gives_its_impulse_whatever_the_period(start: float,
                                                           duration: float) -> None:
    pulse = Disturbance(joint=1, torque=-5.0, start=start, duration=duration)
    before, after = (turned(time, torque=0.0, disturbance=pulse).state
                     for time in (start - 1e-3, 0.5))
    assert before.tolist() == [0.0, 0.0]
    assert after[1] == pytest.approx(-5.0 * duration / INERTIA, rel=1e-9)


def test_disturbance_is_no_torque_of_the_motor() -> None:
    pulse = Disturbance(joint=1, torque=5.0, duration=1.0)
    assert turned(0.5, disturbance=pulse).torque.tolist() == [TORQUE]


def test_sag_and_frequencies_follow_the_stiffness(workshop_arm: Arm) -> None:
    soft = Mismatch(rigidity_scale=0.81).apply(workshop_arm)
    posture, found = np.array([-1.3, 0.3]), []
    for arm in (workshop_arm, soft):
        model, parameters = ArmDynamics(arm), Parameters.of(arm, payload_mass=0.3)
        rest, _ = equilibrium(model, posture, parameters)
        found.append((rest[2:], natural_modes(model, rest, parameters, locked=True)[0]))
    # the load of pinned links does not depend on their bending: the sag is linear
    np.testing.assert_allclose(found[1][0], found[0][0] / 0.81, rtol=1e-10)
    np.testing.assert_allclose(found[1][1], found[0][1] * 0.9, rtol=1e-10)


def test_more_modes_are_those_of_the_beam(ei5_arm: Arm) -> None:
    arm = Mismatch(modes=3).apply(ei5_arm)
    model, parameters = ArmDynamics(arm), Parameters.of(arm)
    rates, _ = natural_modes(model, np.zeros(8), parameters, locked=True)
    # (j pi / L)^2 sqrt(E I / rho) of a supported beam, once for each link
    expected = (np.array([1, 1, 2, 2, 3, 3]) * np.pi / 0.5)**2 * np.sqrt(5 / 6)
    np.testing.assert_allclose(rates, expected, rtol=1e-10)
    assert Mismatch(modes=0).apply(ei5_arm).n_modes == 0


def test_nothing_is_changed_by_default(workshop_arm: Arm) -> None:
    same = Mismatch().apply(workshop_arm)
    assert same.links == workshop_arm.links
    assert same.joints == workshop_arm.joints


def test_rigid_link_stays_rigid(ei5_arm: Arm) -> None:
    stiff = Link(length=0.5, linear_density=6.0)
    arm = replace(ei5_arm, links=(stiff, ei5_arm.links[1]))
    changed = Mismatch(modes=4, rigidity_scale=0.5).apply(arm)
    assert changed.links[0] == stiff
    assert changed.links[1].modes == 4
    assert changed.links[1].flexural_rigidity == 2.5


@pytest.mark.parametrize(('values', 'error', 'text'), [
    ({'modes': 9}, InvalidValueError, 'modes is 9'),
    ({'modes': -2}, InvalidValueError, 'modes is -2'),
    ({'rigidity_scale': 0.0}, InvalidValueError, 'rigidity_scale is 0.0'),
    ({'rigidity_scale': np.nan}, NotFiniteError, 'rigidity_scale is nan'),
    ({'added_friction': [0.1, -0.1]}, InvalidValueError, r'added_friction\[1\] is -0.1'),
    ({'added_friction': [0.1]}, InvalidSizeError, 'added_friction has 1 number,')])
def test_bad_mismatch_is_refused(ei5_arm: Arm, values: dict[str, Any],
                                 error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        Mismatch(**values).apply(ei5_arm)
