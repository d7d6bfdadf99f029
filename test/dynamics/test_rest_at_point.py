"""Inverse kinematics of bent arms: where the tip rests is what was asked for, or is refused."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Link, Node
from flex_planner.arms.inverse_kinematics import inverse_kinematics, posture_near_point
from flex_planner.arms.kinematics import tip_jacobian, tip_position
from flex_planner.base.errors import NoEquilibriumError, SingularError, UnreachableError
from flex_planner.base.validation import Array
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.rest_at_point import rest_at_point
from flex_planner.dynamics.statics import equilibrium
from hypothesis import given
from hypothesis import strategies as st
from light_model import LightModel
import numpy as np
import pytest

# what is left of the sag; the planner promises 1e-6 m
EXACT = 1e-11


def slender_arm(count: int = 2, limit: float = np.inf, rigidity: float = 6.21) -> Arm:
    """Return links like the random counter-example's: aluminium, 0.6 m x 40 mm x 3 mm, clamped."""
    length = 1.2 / count
    link = Link(length=length, linear_density=0.324, flexural_rigidity=rigidity, modes=1,
                mode_family='clamped_free')
    joint = Joint(lower_limit=-limit, upper_limit=limit)
    nodes = tuple(Node(mass=0.8, inertia=0.05) for _ in range(count))
    return Arm(name='slender', links=(link,) * count, joints=(joint,) * count,
               nodes=(*nodes, Node()), gravity=[0.0, -9.81])


MODELS = {count: LightModel(slender_arm(count)) for count in (1, 2, 3)}


def rest(arm: Arm, point: tuple[float, float], reference: Array, payload: float = 0.3,
         ) -> tuple[Array, Array]:
    return rest_at_point(MODELS[arm.n_joints], arm, np.array(point), reference,  # type: ignore
                         PhysicalParameters.of_arm(arm, payload_mass=payload))


def tip_at_rest(arm: Arm, angles: Array, payload: float = 0.3) -> Array:
    """Return where the tip comes to rest with its joints held, by the equilibrium alone."""
    parameters = PhysicalParameters.of_arm(arm, payload_mass=payload)
    q, _ = equilibrium(MODELS[arm.n_joints], angles, parameters)  # type: ignore
    return tip_position(arm, q)


def test_tip_of_the_counter_example_rests_at_its_goal() -> None:
    arm, goal = slender_arm(), (0.6, -0.6)
    unbent = posture_near_point(arm, goal, 1)
    # the goal of the unbent arm misses by this much
    assert np.linalg.norm(tip_at_rest(arm, unbent) - goal) > 0.14
    coordinates, torque = rest(arm, goal, unbent)
    np.testing.assert_allclose(tip_at_rest(arm, coordinates[:2]), goal, rtol=0, atol=EXACT)
    held = equilibrium(MODELS[2], coordinates[:2],  # type: ignore
                       PhysicalParameters.of_arm(arm, payload_mass=0.3))
    np.testing.assert_allclose(coordinates, held[0], rtol=0, atol=1e-12)  # rounding
    np.testing.assert_allclose(torque, held[1], rtol=1e-9)


@given(radius=st.floats(0.4, 1.0), angle=st.floats(-np.pi, np.pi), elbow=st.sampled_from([-1, 1]),
       payload=st.floats(0.0, 0.2), count=st.sampled_from([2, 3]))
def test_tip_rests_at_any_point_on_the_branch_asked_for(radius: float, angle: float, elbow: int,
                                                        payload: float, count: int) -> None:
    arm = slender_arm(count, rigidity=12.0)
    point = radius * np.array([np.cos(angle), np.sin(angle)])
    coordinates, _ = rest(arm, point, posture_near_point(arm, point, elbow), payload)
    found = tip_at_rest(arm, coordinates[:count], payload)
    np.testing.assert_allclose(found, point, rtol=0, atol=EXACT)
    if count == 2:
        # the triangle from joint 1 to joint 2 to the tip turns as the elbow says
        joint = tip_position(replace(arm, links=arm.links[:1], joints=arm.joints[:1],
                                     nodes=arm.nodes[:2]), coordinates[[0, 2]])
        assert np.sign(joint[0] * point[1] - joint[1] * point[0]) == elbow


@pytest.mark.parametrize('changes', [{'gravity': [0.0, 0.0]}, {'links': (Link(
    length=0.6, linear_density=0.324),) * 2}], ids=['level', 'rigid'])
def test_arm_that_gravity_does_not_bend_keeps_the_closed_form(changes: dict[str, object]) -> None:
    arm = replace(slender_arm(), **changes)  # type: ignore
    unbent = inverse_kinematics(arm, (0.6, -0.6), -1)
    assert posture_near_point(arm, (0.6, -0.6), -1).tolist() == unbent.tolist()
    coordinates, _ = rest_at_point(LightModel(arm), arm, np.array([0.6, -0.6]),  # type: ignore
                                   unbent, PhysicalParameters.of_arm(arm))
    assert coordinates.tolist() == [*unbent, *[0.0] * arm.n_modes]


def test_joints_to_spare_turn_as_little_as_they_can_at_first() -> None:
    arm, point = slender_arm(3), np.array([0.7, -0.4])
    reference = posture_near_point(arm, point, 1)
    change = rest(arm, point, reference)[0][:3] - reference
    # no part of it moves the tip of the unbent arm nowhere
    idle = np.linalg.svd(tip_jacobian(arm.rigid(), reference))[2][2]
    assert np.linalg.norm(change) > 0.01
    assert abs(change @ idle) < 1e-12


def test_joint_that_meets_its_limit_stays_there_while_others_turn() -> None:
    free, point = slender_arm(3), np.array([0.7, -0.4])
    reference = posture_near_point(free, point, 1)
    turned = rest(free, point, reference)[0][:3]
    limit = (reference[1] + turned[1]) / 2
    assert turned[1] > reference[1]  # so an upper limit between them is in its way
    arm = replace(free, joints=(Joint(), Joint(upper_limit=limit), Joint()))
    found = rest(arm, point, reference)[0][:3]
    assert found[1] == limit
    np.testing.assert_allclose(tip_at_rest(arm, found), point, rtol=0, atol=EXACT)


def test_joints_on_their_limits_need_not_be_more_exact_than_inverse_kinematics() -> None:
    # two of three joints are at limits: the third cannot take back what the search left
    rigid = slender_arm(3).rigid()
    arm = replace(rigid, joints=(Joint(), Joint(upper_limit=0.5), Joint(upper_limit=0.5)))
    angles = np.array([0.1, 0.5, 0.5])
    point = tip_position(arm, angles) + [0.0, 5e-10]
    found, _ = rest_at_point(LightModel(arm), arm, point, angles,  # type: ignore
                             PhysicalParameters.of_arm(arm))
    np.testing.assert_allclose(tip_position(arm, found), point, rtol=0, atol=1.2e-9)
    with pytest.raises(UnreachableError):
        rest_at_point(LightModel(arm), arm, point + 1e-6, angles,  # type: ignore
                      PhysicalParameters.of_arm(arm))


def test_arm_without_a_joint_to_spare_is_refused_by_its_limits() -> None:
    arm = slender_arm(limit=1.6)  # the unbent arm would be at 1.571
    reference = posture_near_point(arm, (0.6, -0.6), 1)
    with pytest.raises(UnreachableError, match='joint 2 would have to be at 1.702 rad, outside'):
        rest(arm, (0.6, -0.6), reference)


def test_bent_arm_is_asked_where_only_the_unbent_one_cannot_be() -> None:
    # held level and stretched, the tip of the sagging arm is out of the unbent one's reach
    angles = np.array([0.3, 0.35])
    point = tip_at_rest(slender_arm(), angles)
    assert np.linalg.norm(point) > 1.2
    for limit in (np.inf, 0.4):
        arm = slender_arm(limit=limit)
        with pytest.raises(UnreachableError):
            inverse_kinematics(arm, point, 1)
        found = rest(arm, point, posture_near_point(arm, point, 1))[0]
        np.testing.assert_allclose(tip_at_rest(arm, found[:2]), point, rtol=0, atol=EXACT)


def test_point_out_of_reach_of_the_bent_arm_is_named() -> None:
    arm = slender_arm()
    with pytest.raises(UnreachableError, match=r'rests with its tip at \(1.1, 0.9\) m'):
        rest(arm, (1.1, 0.9), posture_near_point(arm, (1.1, 0.9), 1))


def test_bent_arm_that_cannot_move_its_tip_every_way_is_singular() -> None:
    # bent, it is stretched out at an elbow of 0.2313 rad
    arm, angles = slender_arm(), np.array([0.3, 0.233])
    with pytest.raises(SingularError, match='stretched out or folded'):
        rest(arm, tuple(tip_at_rest(arm, angles)), angles)


def test_one_joint_reaches_the_curve_of_its_tip_and_nothing_else() -> None:
    arm = slender_arm(1, rigidity=40.0)
    point = tip_at_rest(arm, np.array([0.2]))
    assert np.linalg.norm(point) > 1.2 + 1e-3  # beside the circle of the unbent tip
    found = rest(arm, point, posture_near_point(arm, point, 1))[0]
    assert found[0] == pytest.approx(0.2, abs=1e-9)
    with pytest.raises(UnreachableError, match='with one joint it does not come to'):
        rest(arm, (1.2, 0.0), posture_near_point(arm, (1.2, 0.0), 1))


def test_links_too_soft_for_their_load_come_to_rest_nowhere() -> None:
    arm = slender_arm(rigidity=0.5)
    with pytest.raises(NoEquilibriumError):
        rest(arm, (0.0, 0.9), posture_near_point(arm, (0.0, 0.9), 1), payload=3.0)
