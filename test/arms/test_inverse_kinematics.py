"""Inverse kinematics, joint limits, and condition (I) of the paper."""

from __future__ import annotations

import math

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.arms.inverse_kinematics import (
    check_angle_limits,
    check_singularity,
    inverse_kinematics,
    workspace,
)
from flex_planner.arms.kinematics import jacobian, tip_position
from flex_planner.base.errors import InvalidValueError, SingularError, UnreachableError
from hypothesis import assume, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.optimize import minimize

FREE = (-math.inf, math.inf)


def build_arm(*lengths: float, limits: tuple[tuple[float, float], ...] = ()) -> Arm:
    links = tuple(Link(length=length, linear_density=1.0) for length in lengths)
    joints = tuple(Joint(lower_limit=lower, upper_limit=upper)
                   for lower, upper in limits or (FREE,) * len(lengths))
    return Arm(name='test', links=links, joints=joints)


UNEVEN = build_arm(0.6, 0.35)
ANGLES = st.floats(-np.pi, np.pi)
LENGTHS = st.floats(0.1, 3.0)
ELBOWS = st.sampled_from([-1, 1])


@pytest.mark.parametrize(('point', 'degrees'), [
    # eq. (28); its theta_2(0) = -60 deg is a slip
    ((0.5, 0.0), (60.0, -120.0)), ((0.5, 0.5), (90.0, -90.0))])
def test_points_of_the_paper_have_the_angles_of_eq_28(rigid_arm: Arm, point: tuple[float, float],
                                                      degrees: tuple[float, float]) -> None:
    angles = np.degrees(inverse_kinematics(rigid_arm, point, elbow=-1))
    np.testing.assert_allclose(angles, degrees, atol=1e-12)  # rounding


@given(first=LENGTHS, second=LENGTHS, share=st.floats(0, 1), angle=ANGLES, elbow=ELBOWS)
def test_inverse_kinematics_puts_the_tip_where_it_was_asked(
        first: float, second: float, share: float, angle: float, elbow: int) -> None:
    arm = build_arm(first, second)
    nearest, farthest = abs(first - second), first + second
    radius = nearest + share * (farthest - nearest)
    point = radius * np.array([np.cos(angle), np.sin(angle)])
    try:
        positions = inverse_kinematics(arm, point, elbow)
    except SingularError:
        # only near the edges of the workspace: |det J| = L_1 L_2 |sin theta_2|
        cosine = (radius**2 - first**2 - second**2) / (2 * first * second)
        assert first * second * np.sqrt(max(1 - cosine**2, 0)) <= 1.0001e-3 * arm.reach**2
        return
    # rounding, magnified by 1 / sin(theta_2) <= 1e3 for lengths within a factor of 30
    np.testing.assert_allclose(tip_position(arm, positions), point, atol=1e-10)
    assert np.sign(positions[1]) == elbow
    assert -np.pi <= positions[0] <= np.pi


@given(positions=st.tuples(ANGLES, ANGLES))
def test_inverse_kinematics_returns_the_angles_of_a_posture(
        positions: tuple[float, float]) -> None:
    assume(abs(np.sin(positions[1])) > 0.05)
    point = tip_position(UNEVEN, np.array(positions))
    found = inverse_kinematics(UNEVEN, point, elbow=1 if positions[1] > 0 else -1)
    # modulo full turns; rounding, magnified by 1 / sin(theta_2) = 20
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * np.array(positions)), atol=1e-12)


@pytest.mark.parametrize('point', [(0.9501, 0.0), (0.0, -2.0), (0.2499, 0.0), (0.0, 0.0)])
def test_point_too_far_or_too_near_is_unreachable(point: tuple[float, float]) -> None:
    with pytest.raises(UnreachableError, match=r'reaches from 0\.25 m to 0\.95 m'):
        inverse_kinematics(UNEVEN, point, elbow=1)


@pytest.mark.parametrize('elbow', [-1, 1])
@pytest.mark.parametrize('point', [(0.95, 0.0), (0.0, 0.25), (-0.2500001, 0.0)])
def test_edge_of_the_workspace_is_singular(point: tuple[float, float], elbow: int) -> None:
    with pytest.raises(SingularError, match='stretched out or folded'):
        inverse_kinematics(UNEVEN, point, elbow)


def test_base_is_singular_for_links_of_equal_length(rigid_arm: Arm) -> None:
    with pytest.raises(SingularError, match='stretched out or folded'):
        inverse_kinematics(rigid_arm, (0.0, 0.0), elbow=1)


def test_singularity_is_measured_against_the_reach() -> None:
    # L_1 L_2 sin(theta_2) = 1e-3 (L_1 + L_2)^2, at any size of the arm
    threshold = np.arcsin(1e-3 * 0.95**2 / (0.6 * 0.35))
    for scale in (1e-3, 1.0, 1e3):
        arm = build_arm(0.6 * scale, 0.35 * scale)
        check_singularity(arm, np.array([0.3, 1.001 * threshold]))
        with pytest.raises(SingularError):
            check_singularity(arm, np.array([0.3, 0.999 * threshold]))


def test_three_links_are_singular_only_when_all_are_aligned() -> None:
    arm = build_arm(0.5, 0.4, 0.3)
    check_singularity(arm, np.array([0.1, 0.0, 1.0]))
    for last in (0.0, np.pi):
        with pytest.raises(SingularError, match=r'\(5\.73, 0\.00, '):
            check_singularity(arm, np.array([0.1, 0.0, last]))


def test_one_link_is_never_refused() -> None:
    check_singularity(build_arm(0.5), np.array([0.1]))


@pytest.mark.parametrize('elbow', [0, 2, -2])
def test_elbow_is_a_sign(elbow: int) -> None:
    with pytest.raises(InvalidValueError, match=rf'elbow is {elbow}, but must be \+1 or -1'):
        inverse_kinematics(UNEVEN, (0.5, 0.5), elbow)


@pytest.mark.parametrize(('lengths', 'expected'), [
    ((0.5,), (0.5, 0.5)), ((0.6, 0.35), (0.25, 0.95)), ((0.35, 0.6), (0.25, 0.95)),
    ((0.5, 0.4, 0.3), (0.0, 1.2)), ((2.0, 0.4, 0.3), (1.3, 2.7))])
def test_workspace_is_a_ring(lengths: tuple[float, ...], expected: tuple[float, float]) -> None:
    np.testing.assert_allclose(workspace(build_arm(*lengths)), expected, atol=1e-15)  # rounding


@given(angle=ANGLES, elbow=ELBOWS)
def test_one_link_points_at_the_point(angle: float, elbow: int) -> None:
    point = 0.5 * np.array([np.cos(angle), np.sin(angle)])
    found = inverse_kinematics(build_arm(0.5), point, elbow)
    np.testing.assert_allclose(np.exp(1j * found), np.exp([1j * angle]), atol=1e-15)  # rounding


@pytest.mark.parametrize('point', [(0.51, 0.0), (0.3, 0.3)])
def test_one_link_reaches_a_circle_only(point: tuple[float, float]) -> None:
    with pytest.raises(UnreachableError, match=r'the arm reaches only 0\.5 m'):
        inverse_kinematics(build_arm(0.5), point, elbow=1)


@settings(max_examples=60)
@given(lengths=st.lists(st.floats(0.2, 1.0), min_size=3, max_size=4), share=st.floats(0.1, 0.9),
       angle=ANGLES, elbow=ELBOWS)
def test_three_and_four_links_reach_every_point_well_inside(
        lengths: list[float], share: float, angle: float, elbow: int) -> None:
    arm = build_arm(*lengths)
    near, far = workspace(arm)
    point = (near + share * (far - near)) * np.array([np.cos(angle), np.sin(angle)])
    positions = inverse_kinematics(arm, point, elbow)
    # what the solver asks of a posture
    assert np.abs(tip_position(arm, positions) - point).max() <= 1e-9 * arm.reach
    assert -np.pi <= positions[0] <= np.pi


def test_longer_arms_bend_to_the_side_of_the_elbow() -> None:
    arm = build_arm(0.5, 0.4, 0.3, 0.2)
    left, right = (inverse_kinematics(arm, (0.8, 0.0), elbow) for elbow in (1, -1))
    assert (left[1:] > 0).all()
    np.testing.assert_allclose(right, -left, atol=1e-6)  # of the solver: a mirror image


@settings(max_examples=40)
@given(near=st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3), shift=ANGLES)
def test_three_links_stay_near_a_posture(near: list[float], shift: float) -> None:
    arm, posture = build_arm(0.5, 0.4, 0.3), np.array(near)
    J = jacobian(arm, posture)
    assume(np.linalg.svd(J)[1][1] > 0.1)
    step = 0.02 * np.array([np.cos(shift), np.sin(shift)])
    found = inverse_kinematics(arm, tip_position(arm, posture) + step, 1, near=posture)
    nearest = minimize(
        lambda q: ((q - posture) ** 2).sum(), posture, method='SLSQP', constraints=[{
            'type': 'eq', 'fun': lambda q: tip_position(arm, q) - tip_position(arm, found)}])
    assert nearest.success
    # the solver's weight on nearness vanishes: it may end a little farther than the nearest
    assert np.linalg.norm(found - posture) <= 1.05 * np.linalg.norm(nearest.x - posture) + 1e-6


def test_first_joint_takes_the_turn_nearest_to_a_posture() -> None:
    for turns in (-6, -1, 0, 3, 12):
        near = np.array([2 * np.pi * turns + 0.3, 1.0])
        found = inverse_kinematics(UNEVEN, tip_position(UNEVEN, near), 1, near=near)
        np.testing.assert_allclose(found, near, atol=1e-12)  # rounding of up to 75 rad


def test_first_joint_turns_into_its_limits() -> None:
    arm = build_arm(0.6, 0.35, limits=((np.pi, 3 * np.pi), FREE))
    posture = np.array([2 * np.pi - 0.4, 1.0])
    found = inverse_kinematics(arm, tip_position(arm, posture), 1)
    np.testing.assert_allclose(found, posture, atol=1e-13)  # rounding


@pytest.mark.parametrize(('limits', 'elbow', 'message'), [
    (((0.0, 1.0), FREE), 1, 'joint 1 would have to be at -0.9273 rad, outside its limits 0 to 1'),
    ((FREE, (-0.5, 2.0)), -1, 'joint 2 would have to be at -1.571 rad, outside its limits -0.5')])
def test_limit_that_keeps_two_links_from_a_point_is_named(
        limits: tuple[tuple[float, float], ...], elbow: int, message: str) -> None:
    # 3-4-5: the elbow is square, the first link 0.9273 rad to the side of the point
    arm = build_arm(0.3, 0.4, limits=limits)
    with pytest.raises(UnreachableError, match=message):
        inverse_kinematics(arm, (0.5, 0.0), elbow)


@settings(max_examples=30)
@given(posture=st.tuples(st.floats(-0.9, 0.9), st.floats(0.3, 1.4), st.floats(-1.4, -0.3)))
def test_three_links_reach_within_their_limits(posture: tuple[float, float, float]) -> None:
    arm = build_arm(0.5, 0.4, 0.3, limits=((-1.0, 1.0), (0.2, 1.5), (-1.5, -0.2)))
    point = tip_position(arm, np.array(posture))
    found = inverse_kinematics(arm, point, 1, near=np.array([0.0, 0.85, -0.85]))
    check_angle_limits(arm, 'found', found)
    assert np.abs(tip_position(arm, found) - point).max() <= 1e-9 * arm.reach


def test_three_links_kept_away_by_their_limits_say_so() -> None:
    arm = build_arm(0.5, 0.4, 0.3, limits=((0.0, 0.1), (-0.1, 0.1), (-0.1, 0.1)))
    with pytest.raises(UnreachableError, match=r'no posture within the joint limits .* \(-0.7, 0'):
        inverse_kinematics(arm, (-0.7, 0.0), 1)


@pytest.mark.parametrize('lengths', [(0.5, 0.4, 0.3), (0.5, 0.4, 0.3, 0.2)])
def test_longer_arms_are_singular_where_they_are_stretched(lengths: tuple[float, ...]) -> None:
    with pytest.raises(SingularError, match='stretched out or folded'):
        inverse_kinematics(build_arm(*lengths), (sum(lengths), 0.0), elbow=1)


def test_angles_beyond_their_limits_are_named() -> None:
    arm = build_arm(0.5, 0.4, limits=(FREE, (-1.0, 2.0)))
    check_angle_limits(arm, 'start_positions', np.array([99.0, 2.0]))
    with pytest.raises(InvalidValueError) as caught:
        check_angle_limits(arm, 'start_positions', np.array([0.0, 2.1]))
    assert str(caught.value) == ('start_positions[1] is 2.1, but must be within the limits of the '
                                 'joint, -1 to 2 rad')
