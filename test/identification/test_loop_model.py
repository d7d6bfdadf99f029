"""Derivatives of a simulated log are those of finite differences; in the plane and in space."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Link, Node
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.joint import Motor
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam
from flex_planner.arms.spatial_body import SpatialBody
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.errors import InvalidValueError
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
from flex_planner.identification.loop_model import LoopModel, steps_per_part
from flex_planner.identification.plant_parameters import (
    arm_with,
    check_identifiable,
    free_parameters,
    list_parameters,
    parameters_of,
    Quantity,
)
from flex_planner.identification.simulated_log import DriveLaw
from light_model import LightModel
import numpy as np
import pytest
from spatial_arms import flexible_3r, oblique

VALUES = np.array([0.11, 0.9, 0.01, 0.02, 0.01, 0.012, 0.003, 1.4e-3])
LAW = DriveLaw(period=1e-3, stiffness=np.array([4.0]), damping=np.array([0.3]),
               guide_stiffness=np.array([1.0]), guide_damping=np.array([0.1]), keeps=0.7)
START, STEP = 0.3, 1e-6


@pytest.fixture(scope='module')
def model() -> LoopModel:
    arm = load_arm('single_link')
    # weight makes the bending at rest depend on parameters, too
    return LoopModel(replace(arm, links=(arm.links[0].with_modes(1),), gravity=[0.0, -9.81]))


def outputs(model: LoopModel, at: np.ndarray) -> np.ndarray:
    """Return angles and torques of the guide for parameters and a start angle."""
    followed = np.zeros((300, 3))
    followed[:, 0] = START + 0.1 * np.sin(np.arange(300) * 0.02)**2
    log = model.simulate(at[-1:], followed, LAW, at[:-1], steps_per_part(1e-3, 300.0))
    return np.hstack([log.angles, log.guide])


@pytest.fixture(scope='module')
def in_space() -> LoopModel:
    beam = SpatialBeam(linear_density=0.3, flexural_rigidity=(0.9, 1.3), modes=(1, 1),
                       torsional_rigidity=0.7, polar_inertia=1e-4, twist_modes=1)
    link = SpatialLink(end=(0.5, 0, 0.1), beam=beam, tip_body=SpatialBody(
        mass=0.05, center_of_mass=(0, 0.03, 0), inertia=(1e-5,) * 3))
    return LoopModel(SpatialArm(
        name='oblique link', joints=(SpatialJoint(axis=(0.1, 0.6, 0.7), motor=Motor(
            rotor_inertia=0.01)),), links=(link,), payload_com=[0.01, 0.02, 0]))


@pytest.mark.parametrize('where', ['model', 'in_space'])
@pytest.mark.parametrize('place', range(len(VALUES) + 1))
def test_derivatives_are_those_of_finite_differences(
        request: pytest.FixtureRequest, where: str, place: int) -> None:
    model = request.getfixturevalue(where)
    at = np.append(VALUES, START)
    step = np.zeros_like(at)
    step[place] = STEP * max(at[place], 0.1) if place != 7 else 1e-7
    expected = (outputs(model, at + step) - outputs(model, at - step)) / (2 * step[place])
    followed = np.zeros((300, 3))
    followed[:, 0] = START + 0.1 * np.sin(np.arange(300) * 0.02)**2
    log = model.simulate(at[-1:], followed, LAW, VALUES, steps_per_part(1e-3, 300.0))
    found = np.hstack([log.angle_slopes[..., place], log.guide_slopes[..., place]])
    assert found == pytest.approx(expected, abs=1e-5 * np.abs(expected).max() + 1e-9)


@pytest.mark.parametrize('place', range(3))
def test_derivatives_by_a_start_in_motion_are_those_of_finite_differences(
        model: LoopModel, place: int) -> None:
    followed, away = np.full((300, 3), START), np.array([1e-3, 0.1, 0.05])
    parts = steps_per_part(1e-3, 300.0)

    def at(apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        log = model.simulate(np.array([START]), followed, LAW, VALUES, parts, apart)
        return (np.hstack([log.angles, log.guide]),
                np.concatenate([log.angle_slopes, log.guide_slopes], axis=1))

    step = STEP * np.eye(3)[place]
    expected = (at(away + step)[0] - at(away - step)[0]) / (2 * STEP)
    found = at(away)[1][..., len(VALUES) + 1 + place]
    assert found == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


def test_parameters_are_as_many_as_the_vector_has() -> None:
    assert len(list_parameters(1)) == VALUES.size


def test_planar_link_in_space_moves_the_same() -> None:
    link = Link(length=0.5, linear_density=0.3, flexural_rigidity=0.9, modes=1,
                mode_family='clamped_free')
    planar = Arm(name='one', links=(link,), joints=(Joint(motor=Motor(rotor_inertia=0.01)),),
                 nodes=(Node(inertia=0.001), Node(mass=0.05)), gravity=[0.0, -9.81])
    at = np.append(VALUES, START)
    expected, found = (outputs(LoopModel(arm), at)
                       for arm in (planar, SpatialArm.of_planar(planar)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    assert np.ptp(expected[:, 0]) > 0.05


def test_link_in_space_rests_as_statics_have_it(in_space: LoopModel) -> None:
    arm = arm_with(in_space.arm, VALUES)
    np.testing.assert_allclose(parameters_of(arm, VALUES[0], VALUES[-1])[:-2], VALUES[:-2])
    expected, _ = equilibrium(LightModel(arm), np.array([START]),  # type: ignore[arg-type]
                              PhysicalParameters.of_arm(arm, payload_mass=VALUES[0]))
    found, *_ = in_space.rest(np.array([START]), VALUES)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert np.abs(found[1:]).min() > 1e-4  # in both planes and in torsion


def test_offset_of_a_joint_that_turns_about_gravity_is_not_sought() -> None:
    upright = flexible_3r()
    offsets = frozenset([Quantity.OFFSET])
    parameters = list_parameters(3)
    assert [parameters[i].index for i in free_parameters(upright, offsets)] == [1, 2]
    leaning = replace(upright, gravity=[1.0, 0.0, -9.8])
    assert [parameters[i].index for i in free_parameters(leaning, offsets)] == [0, 1, 2]
    with pytest.raises(InvalidValueError, match=r'joints\[2\] is .*slides.* one that turns'):
        check_identifiable(oblique())
