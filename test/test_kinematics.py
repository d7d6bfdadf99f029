"""Forward and inverse kinematics, and condition (I) of the paper."""

from __future__ import annotations

from flex_planner.arm import Arm, Joint, Link
from flex_planner.errors import (
    InvalidTaskError,
    InvalidValueError,
    SingularError,
    UnreachableError,
)
from flex_planner.kinematics import (
    check_singularity,
    frame_angles,
    inverse_kinematics,
    jacobian,
    link_points,
    tip_position,
)
from hypothesis import assume, given
from hypothesis import strategies as st
import numpy as np
import pytest


def build_arm(*lengths: float) -> Arm:
    links = tuple(Link(length=length, linear_density=1.0) for length in lengths)
    return Arm(name='test', links=links, joints=(Joint(),) * len(links))


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


@pytest.mark.parametrize('lengths', [(0.5,), (0.5, 0.4, 0.3)])
def test_points_determine_two_links_only(lengths: tuple[float, ...]) -> None:
    with pytest.raises(InvalidTaskError, match=f'the arm has {len(lengths)} links'):
        inverse_kinematics(build_arm(*lengths), (0.3, 0.3), elbow=1)


@pytest.mark.parametrize('elbow', [0, 2, -2])
def test_elbow_is_a_sign(elbow: int) -> None:
    with pytest.raises(InvalidValueError, match=rf'elbow is {elbow}, but must be \+1 or -1'):
        inverse_kinematics(UNEVEN, (0.5, 0.5), elbow)


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
