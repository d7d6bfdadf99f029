"""The straight arm by NumPy alone agrees with the compiled dynamics of the same arm."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from data_sheet_arms import data_sheet_arm, HUB, stepped_arm
from factories import model_of
from flex_planner.arms.arm import Arm, Joint
from flex_planner.arms.beam_eigenmodes import TipLoad
from flex_planner.arms.stepped_beam import Pieces, stepped_modes
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import natural_modes
from flex_planner.dynamics.unbent_arm import bending_stiffness, free_vibrations, mass_matrix
from light_model import LightModel
import numpy as np
import pytest
from spatial_arms import flexible_3r, oblique, ur5

# unlike links and nodes of every kind, pinned and clamped
ARMS = ['workshop', 'crane']
PAYLOAD, INERTIA = 0.7, 0.03
POSTURES = [(0.0, 0.0), (0.4, -1.9), (2.5, 1.1)]


@pytest.mark.parametrize('posture', POSTURES)
@pytest.mark.parametrize('name', ARMS)
def test_mass_matrix_is_that_of_the_compiled_dynamics(
        request: pytest.FixtureRequest, name: str, posture: tuple[float, ...]) -> None:
    model, positions = model_of(request, name), np.array(posture)
    parameters = PhysicalParameters.of_arm(model.arm, payload_mass=PAYLOAD,
                                           payload_inertia=INERTIA)
    x = np.concatenate([positions, np.zeros(model.arm.n_modes + model.arm.n_coordinates)])
    expected = model.mass_and_energy(x[None], parameters.physical)[0][0]
    found = mass_matrix(model.arm, positions, PAYLOAD, INERTIA)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize('arm', [stepped_arm(), data_sheet_arm(2), data_sheet_arm(3), oblique(),
                                 flexible_3r(2, 1), ur5(elastic=[0, 2])],
                         ids=lambda arm: arm.name)
def test_mass_matrix_of_data_sheet_arms_is_that_of_the_dynamics(arm: Arm) -> None:
    positions = np.random.default_rng(1).uniform(-2, 2, arm.n_joints)
    parameters = PhysicalParameters.of_arm(arm, payload_mass=PAYLOAD, payload_inertia=INERTIA)
    x = np.concatenate([positions, np.zeros(arm.n_passive + arm.n_coordinates)])
    expected = LightModel(arm).mass_and_energy(x[None], parameters.physical)[0][0]
    found = mass_matrix(arm, positions, PAYLOAD, INERTIA)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13 * np.abs(expected).max())


def test_locked_frequencies_of_a_stepped_link_are_those_of_its_modes() -> None:
    link = stepped_arm().links[-1]
    arm = Arm(name='one', links=(link,), joints=(Joint(),))
    model: Any = LightModel(arm)
    found, _ = natural_modes(model, np.zeros(4), PhysicalParameters.of_arm(arm), locked=True)
    exact = stepped_modes(Pieces(*np.array([(one.share, one.density, one.rigidity)
                                            for one in HUB]).T), 3, TipLoad())
    assert exact is not None
    unit = np.sqrt(link.flexural_rigidity / (link.linear_density * link.length**4))
    np.testing.assert_allclose(found, exact.frequencies * unit, rtol=1e-11)


@pytest.mark.parametrize('name', ARMS)
def test_frequencies_with_free_joints_are_those_of_the_compiled_dynamics(
        request: pytest.FixtureRequest, name: str) -> None:
    arm: Arm = replace(request.getfixturevalue(f'{name}_arm'), gravity=[0.0, 0.0])
    positions = np.array([0.4, -1.9])
    rest = np.concatenate([positions, np.zeros(arm.n_modes)])
    expected, _ = natural_modes(
        ArmDynamics(arm), rest, PhysicalParameters.of_arm(arm, payload_mass=PAYLOAD),
        locked=False)
    mass, stiffness = mass_matrix(arm, positions, PAYLOAD, 0.0), bending_stiffness(arm)
    found, vectors = free_vibrations(mass, stiffness, arm.n_joints)
    assert expected[:arm.n_joints].tolist() == [0.0] * arm.n_joints
    np.testing.assert_allclose(found, expected[arm.n_joints:], rtol=1e-9)
    np.testing.assert_allclose(vectors.T @ mass @ vectors, np.eye(found.size), atol=1e-9)
    np.testing.assert_allclose(vectors.T @ stiffness @ vectors, np.diag(found**2),
                               atol=1e-9 * found[-1]**2)
