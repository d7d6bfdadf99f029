"""Slacks of limits on the way: what they measure, their derivatives, what they refuse."""

from __future__ import annotations

from dataclasses import replace
import math

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points, tip_position
from flex_planner.base.errors import InvalidValueError
from flex_planner.optimal_control.path_constraints import (
    BendingMoment,
    Capsule,
    Circle,
    Deflection,
    HalfPlane,
    JointRange,
    JointSpeed,
    KeepOut,
    limits_of_arm,
    PathConstraint,
    PathSlacks,
    SelfClearance,
)
from flex_planner.optimal_control.task import Task
import numpy as np
import pytest

POST = Circle(center=(0.3, 0.4), radius=0.2)
WALL = Capsule(start=(0.1, 0.7), end=(0.9, 0.6), radius=0.05)
FLOOR = HalfPlane(point=(0.0, -0.5), normal=(0.0, 2.0))
EVERY: dict[str, PathConstraint] = {
    'range': JointRange(joint=2, lower=-2.0, upper=1.5),
    'one side': JointRange(joint=1, upper=1.5),
    'speed': JointSpeed(joint=1, limit=0.8),
    'circle': KeepOut(region=POST, stations=3, tip_radius=0.05, link_radius=0.02),
    'capsule': KeepOut(region=WALL),
    'half-plane': KeepOut(region=FLOOR, stations=1),
    'self': SelfClearance(base_radius=0.1, link_radius=0.02, stations=2),
    'moment': BendingMoment(link=2, limit=0.4),
    'deflection': Deflection(link=1, limit=0.05)}


@pytest.fixture(scope='module')
def states(ei50_arm: Arm) -> np.ndarray:
    """Return random states with links that bend by centimetres."""
    n, n_t = ei50_arm.n_joints, ei50_arm.n_coordinates
    size = np.concatenate([np.ones(n), np.full(n_t - n, 0.02), np.ones(n_t)])
    return np.random.default_rng(3).uniform(-1, 1, (6, 2 * n_t)) * size


@pytest.mark.parametrize('name', EVERY)
def test_derivatives_are_those_of_the_slacks(name: str, ei50_arm: Arm,
                                             states: np.ndarray) -> None:
    slacks = PathSlacks(ei50_arm, (EVERY[name],))
    lam = np.random.default_rng(4).uniform(0.5, 2, (len(states), slacks.count))
    values, slopes, curvature = slacks.linearise(states, lam)
    np.testing.assert_allclose(values, slacks(states), atol=1e-14)
    step = 1e-6
    for j in range(states.shape[1]):
        moved = states + step * np.eye(states.shape[1])[j]
        back = states - step * np.eye(states.shape[1])[j]
        np.testing.assert_allclose(
            slopes[..., j], (slacks(moved) - slacks(back)) / (2 * step), atol=1e-7)
        pulls = [(lam[:, None] @ slacks.linearise(x, lam)[1])[:, 0] for x in (moved, back)]
        # rounding, by the step: second derivatives are up to 1e3
        np.testing.assert_allclose(curvature[..., j], (pulls[0] - pulls[1]) / (2 * step),
                                   atol=1e-5)


def test_slacks_measure_what_they_say(ei50_arm: Arm, states: np.ndarray) -> None:
    n_t = ei50_arm.n_coordinates
    q, rates = states[:, :n_t], states[:, n_t:]
    tip, points = tip_position(ei50_arm, q), link_points(ei50_arm, q, 4)
    np.testing.assert_allclose(PathSlacks(ei50_arm, (EVERY['range'],))(states),
                               np.stack([1.5 - q[:, 1], q[:, 1] + 2.0], -1) / 3.5)
    np.testing.assert_allclose(PathSlacks(ei50_arm, (EVERY['speed'],))(states),
                               np.stack([1 - rates[:, 0] / 0.8, 1 + rates[:, 0] / 0.8], -1))
    np.testing.assert_allclose(PathSlacks(ei50_arm, (EVERY['half-plane'],))(states)[:, 0],
                               tip[:, 1] + 0.5)
    outside = PathSlacks(ei50_arm, (EVERY['circle'],))(states)
    away = np.linalg.norm(points[:, :, 1:] - np.array(POST.center), axis=-1).reshape(6, -1)
    np.testing.assert_array_equal(outside[:, 0] > 0, away[:, -1] > 0.25)
    np.testing.assert_array_equal(outside[:, 1:] > 0, away[:, :-1] > 0.22)


def test_slack_of_a_keep_out_is_zero_on_its_edge_and_grows_with_the_distance(
        rigid_arm: Arm) -> None:
    # the arm stretched out: its tip is 1 m from the base
    state = np.zeros((1, 4))
    for region, edge in ((Circle(center=(1.3, 0.0), radius=0.3), 0.3),
                         (Capsule(start=(1.2, -1.0), end=(1.2, 1.0), radius=0.2), 0.2)):
        assert PathSlacks(rigid_arm, (KeepOut(region=region),))(state)[0, 0] == pytest.approx(
            0.0, abs=1e-12)
        nearer = KeepOut(region=replace(region, radius=0.9 * edge))
        assert 0 < PathSlacks(rigid_arm, (nearer,))(state)[0, 0] < 0.2


def test_moment_and_deflection_are_those_of_the_modes(ei50_arm: Arm, states: np.ndarray) -> None:
    link, modal = ei50_arm.links[1], states[:, ei50_arm.modal_slices[1]]
    shapes, x = link.mode_shapes(), np.array([0.25, 0.5, 0.75]) * link.length
    moments = link.flexural_rigidity * modal @ shapes.curvature(x).T
    # without that at the joint, where a supported link has none
    found = PathSlacks(ei50_arm, (EVERY['moment'],))
    np.testing.assert_allclose(found(states)[:, ::2], 1 - moments / 0.4, atol=1e-12)
    assert [label.name for label in found.labels][::2] == [
        f'bending moment of link 2 at {share} of its length' for share in (0.25, 0.5, 0.75)]
    bend = states[:, ei50_arm.modal_slices[0]] @ ei50_arm.links[0].mode_shapes().shape(x).T
    np.testing.assert_allclose(PathSlacks(ei50_arm, (EVERY['deflection'],))(states)[:, ::2],
                               1 - bend / (0.05 * link.length), atol=1e-12)


def test_another_value_compiles_nothing(rigid_arm: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    state = np.zeros((1, 4))
    first = PathSlacks(rigid_arm, (KeepOut(region=POST),))(state)
    monkeypatch.setattr(f'{PathSlacks.__module__}._build', None)
    other = PathSlacks(rigid_arm, (KeepOut(region=replace(POST, radius=0.1)),))(state)
    assert other[0, 0] > first[0, 0]


def test_limits_of_an_arm_are_those_of_its_file(ei50_arm: Arm) -> None:
    assert limits_of_arm(ei50_arm) == ()
    joint, link = ei50_arm.joints[0], ei50_arm.links[1]
    arm = replace(ei50_arm, links=(ei50_arm.links[0], replace(link, allowable_moment=0.5)),
                  joints=(replace(joint, lower_limit=-1.0,
                                  motor=replace(joint.motor, max_speed=2.0)),
                          ei50_arm.joints[1]))
    assert limits_of_arm(arm) == (JointRange(joint=1, lower=-1.0), JointSpeed(joint=1, limit=2.0),
                                  BendingMoment(link=2, limit=0.5))


@pytest.mark.parametrize(('make', 'said'), [
    (lambda: JointRange(joint=1), 'upper is inf'),
    (lambda: JointRange(joint=1, lower=1.0, upper=0.5), 'upper is 0.5'),
    (lambda: JointSpeed(joint=1, limit=0.0), 'limit is 0'),
    (lambda: Circle(center=(0.0, math.nan), radius=1.0), r'center\[1\] is nan'),
    (lambda: Circle(center=(0.0, 0.0), radius=-1.0), 'radius is -1'),
    (lambda: Capsule(start=(0.0, 1.0), end=(0.0, 1.0), radius=0.1), 'another point than start'),
    (lambda: HalfPlane(point=(0.0, 1.0), normal=(0.0, 0.0)), 'a direction, not zero'),
    (lambda: KeepOut(region='post'), 'a Circle, a Capsule or a HalfPlane'),
    (lambda: KeepOut(region=POST, stations=51), 'stations is 51'),
    (lambda: SelfClearance(base_radius=0.0), 'base_radius is 0'),
    (lambda: BendingMoment(link=1, limit=1.0, stations=()), 'at least one share'),
    (lambda: Deflection(link=1, limit=0.1, stations=(1.5,)), r'stations\[0\] is 1.5')])
def test_nonsense_is_refused(make: object, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        make()  # type: ignore[operator]


@pytest.mark.parametrize(('constraint', 'said'), [
    (JointRange(joint=3, upper=1.0), r'path_constraints\[0\].joint is 3'),
    (BendingMoment(link=1, limit=1.0), 'a link with modes'),
    ('a wall', 'a PathConstraint, such as KeepOut')])
def test_limits_that_an_arm_cannot_have_are_refused(rigid_arm: Arm, constraint: PathConstraint,
                                                    said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        Task(arm=rigid_arm, start_positions=[0, 0], goal_positions=[1, 1], duration=1.0,
             path_constraints=(constraint,))
