"""Forward kinematics: frames, bent links, the tip and how fast it moves."""

from __future__ import annotations

from flex_planner.arms.arm import Arm, Joint, Link
from flex_planner.arms.kinematics import (
    frame_angles,
    jacobian,
    link_points,
    tip_jacobian,
    tip_position,
    tip_velocity,
)
from hypothesis import given
from hypothesis import strategies as st
import numpy as np


def build_arm(*lengths: float) -> Arm:
    links = tuple(Link(length=length, linear_density=1.0) for length in lengths)
    return Arm(name='test', links=links, joints=(Joint(),) * len(links))


ANGLES = st.floats(-np.pi, np.pi)


@given(positions=st.lists(ANGLES, min_size=1, max_size=4))
def test_jacobian_agrees_with_a_complex_step(positions: list[float]) -> None:
    arm = build_arm(*(0.3 + 0.1 * i for i in range(len(positions))))
    steps = np.array(positions) + 1e-20j * np.eye(len(positions))
    # a complex step has no subtraction and no truncation: rounding alone is left
    np.testing.assert_allclose(jacobian(arm, np.array(positions)),
                               tip_position(arm, steps).imag.T / 1e-20, atol=1e-14)


def test_bent_links_join_where_one_ends_and_the_next_begins(workshop_arm: Arm) -> None:
    rng = np.random.default_rng(1)
    coordinates = rng.uniform(-1, 1, (5, 5)) * [3, 3, 0.05, 0.05, 0.05]
    points = link_points(workshop_arm, coordinates, stations=7)
    assert points.shape == (5, 2, 7, 2)
    # rounding of sin(pi)
    np.testing.assert_allclose(points[:, 0, -1], points[:, 1, 0], atol=1e-15)
    assert np.array_equal(points[:, 0, 0], np.zeros((5, 2)))
    assert np.array_equal(points[:, 1, -1], tip_position(workshop_arm, coordinates))


def test_bent_link_follows_eq_18(ei50_arm: Arm) -> None:
    theta_1, theta_2, q_11, q_12, q_21, q_22 = q = np.array([0.4, -1.1, 0.02, 0.01, -0.03, 0.02])
    x, L = np.linspace(0, 0.5, 9), 0.5
    v_1, v_2 = (a * np.sin(np.pi * x / L) + b * np.sin(2 * np.pi * x / L)
                for a, b in ((q_11, q_12), (q_21, q_22)))
    c_1, s_1 = np.cos(theta_1), np.sin(theta_1)
    c_12, s_12 = np.cos(theta_1 + theta_2), np.sin(theta_1 + theta_2)
    expected = np.array([
        [x * c_1 - v_1 * s_1, x * s_1 + v_1 * c_1],
        [L * c_1 + x * c_12 - v_2 * s_12, L * s_1 + x * s_12 + v_2 * c_12]])
    points = link_points(ei50_arm, q, stations=9)
    np.testing.assert_allclose(points.swapaxes(1, 2), expected, atol=1e-15)  # rounding


def test_frame_angles_add_up_along_the_chain() -> None:
    arm = build_arm(0.5, 0.4, 0.3)
    angles = frame_angles(arm, np.array([[0.1, 0.2, 0.3], [1.0, -1.0, 0.5]]))
    np.testing.assert_allclose(angles, [[0.1, 0.3, 0.6], [1.0, 0.0, 0.5]], atol=1e-15)


def test_unbent_tip_does_not_depend_on_the_modes(rigid_arm: Arm, ei50_arm: Arm) -> None:
    q = np.array([0.4, -1.1])
    flexible = tip_position(ei50_arm, np.concatenate([q, [0.05, 0.0, 0.05, 0.0]]))
    # v(L) = 0 for pinned links: bending does not move the tip
    np.testing.assert_allclose(flexible, tip_position(rigid_arm, q), atol=1e-15)


def test_clamped_link_carries_the_next_one_on_its_bent_tip(crane_arm: Arm) -> None:
    q = np.array([0.4, -1.1, 0.02, -0.01, 0.03])
    shapes = crane_arm.links[0].mode_shapes()
    bend, slope = q[2:4] @ shapes.tip_deflection, q[2:4] @ shapes.tip_slope
    c, s = np.cos(0.4), np.sin(0.4)
    points = link_points(crane_arm, q, stations=5)
    joint = np.array([0.6 * c - bend * s, 0.6 * s + bend * c])
    np.testing.assert_allclose(points[0, -1], joint, atol=1e-15)  # rounding
    np.testing.assert_allclose(points[1, 0], joint, atol=1e-15)
    np.testing.assert_allclose(frame_angles(crane_arm, q), [0.4, 0.4 + slope - 1.1], atol=1e-15)
    assert min(abs(bend), abs(slope)) > 1e-3


def test_jacobian_of_the_bent_arm_is_the_derivative_of_its_tip(crane_arm: Arm) -> None:
    q = np.random.default_rng(4).normal(size=crane_arm.n_coordinates)
    steps = q + 1e-20j * np.eye(q.size)  # complex step: exact
    np.testing.assert_allclose(tip_jacobian(crane_arm, q),
                               tip_position(crane_arm, steps).imag.T / 1e-20, atol=1e-14)


def test_tip_velocity_is_the_rate_of_the_tip_position(crane_arm: Arm, workshop_arm: Arm) -> None:
    rng = np.random.default_rng(4)
    for arm in (crane_arm, workshop_arm):
        q = rng.uniform(-1, 1, (20, 5)) * [3, 3, 0.05, 0.05, 0.05]
        rates = rng.uniform(-1, 1, (20, 5)) * [4, 4, 1, 1, 1]
        expected = tip_position(arm, q + 1e-20j * rates).imag / 1e-20  # complex step: exact
        np.testing.assert_allclose(tip_velocity(arm, q, rates), expected, atol=1e-13)


def test_tip_velocity_of_the_unbent_arm_is_the_jacobian_times_the_speeds() -> None:
    arm, q = build_arm(0.5, 0.4, 0.3), np.array([0.3, -0.7, 1.9])
    speeds = np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(tip_velocity(arm, q, speeds), jacobian(arm, q) @ speeds,
                               atol=1e-15)  # rounding
