"""Slacks of limits of spatial arms: against kinematics in NumPy, by differences, refused."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import bent_distances, link_points, tip_position
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.errors import InvalidValueError
from flex_planner.optimal_control.path_constraints import (
    BendingMoment,
    Circle,
    Deflection,
    HalfSpace,
    KeepOut,
    PathConstraint,
    PathSlacks,
    read_constraint,
    SelfClearance,
    SpatialCapsule,
    Sphere,
    write_constraint,
)
from flex_planner.optimal_control.path_constraints.symbolic_arm import SymbolicArm
from flex_planner.optimal_control.task import Task
import numpy as np
import pytest
from spatial_arms import flexible_3r, oblique, panda, yaw_pitch

BALL = Sphere(center=(0.5, 0.2, 0.6), radius=0.1)
PILLAR = SpatialCapsule(start=(0.4, -0.5, 0.0), end=(0.4, -0.5, 1.0), radius=0.05)
FLOOR = HalfSpace(point=(0.0, 0.0, -0.1), normal=(0.0, 0.0, 2.0))
EVERY: tuple[PathConstraint, ...] = (
    KeepOut(region=BALL, stations=2, tip_radius=0.05, link_radius=0.02), KeepOut(region=PILLAR),
    KeepOut(region=FLOOR), SelfClearance(base_radius=0.1, link_radius=0.02, stations=2),
    BendingMoment(link=2, limit=4.0, stations=(0.0, 0.5)),
    Deflection(link=2, limit=0.05, stations=(0.0, 0.5, 1.0)))


def random_states(arm: Arm, count: int = 4) -> np.ndarray:
    """Return random states with links that bend by centimetres."""
    n, n_t = arm.n_joints, arm.n_coordinates
    size = np.concatenate([np.ones(n), np.full(n_t - n, 0.02), np.ones(n_t)])
    return np.random.default_rng(3).uniform(-1, 1, (count, 2 * n_t)) * size


@pytest.mark.parametrize('arm', [
    flexible_3r(1, 1, foreshortening=True), oblique(), panda(elastic=(0, 1)), yaw_pitch()],
    ids=lambda arm: arm.name)
def test_points_of_symbols_are_those_of_rotation_matrices(arm: SpatialArm) -> None:
    q, at = random_states(arm)[:, :arm.n_coordinates], SymbolicArm.of(arm)
    expected = link_points(arm, q, 3)
    for link in range(arm.n_joints):
        for k, share in enumerate((0.0, 0.5, 1.0)):
            point = ca.Function('point', [at.coordinates], [at.point(link, share)])
            found = [point(one).full().ravel() for one in q]
            np.testing.assert_allclose(found, expected[:, link, k], atol=1e-14)


def test_slacks_measure_what_they_say() -> None:
    arm, states = yaw_pitch(), random_states(yaw_pitch(), 12)
    q = states[:, :arm.n_coordinates]
    slacks = PathSlacks(arm, EVERY)
    values, owners = slacks(states), np.array(slacks.owners())
    assert len(slacks.labels) == values.shape[1] == 4 + 1 + 1 + 2 + 2 + 2
    tip, points = tip_position(arm, q), link_points(arm, q, 3)
    ball = values[:, owners == 0]
    np.testing.assert_array_equal(ball[:, 0] > 0,
                                  np.linalg.norm(tip - BALL.center, axis=1) > 0.15)
    others = points[:, :, 1:].reshape(len(q), -1, 3)[:, :-1]
    np.testing.assert_array_equal(ball[:, 1:] > 0,
                                  np.linalg.norm(others - BALL.center, axis=2) > 0.12)
    away = np.linalg.norm(tip - np.array([0.4, -0.5, 0]) - np.clip(tip[:, 2:], 0, 1)
                          * [0, 0, 1], axis=1)
    np.testing.assert_array_equal(values[:, owners == 1][:, 0] > 0, away > 0.05)
    np.testing.assert_allclose(values[:, owners == 2][:, 0], tip[:, 2] + 0.1, atol=1e-14)
    clear = np.linalg.norm(points[:, 1, 1:] - np.array(arm.base), axis=-1)
    np.testing.assert_array_equal(values[:, owners == 3] > 0, clear > 0.12)
    bent = bent_distances(arm, 1, q[:, 2:], 3)[:, 1:] / (0.05 * 0.7)
    np.testing.assert_allclose(values[:, owners == 5],
                               np.sqrt(1.01) - np.sqrt(bent**2 + 0.01), atol=1e-12)


def test_moment_is_the_resultant_of_both_planes() -> None:
    arm, states = yaw_pitch(), random_states(yaw_pitch())
    link, modal = arm.links[1], states[:, 2:4]
    x = np.array([0.0, 0.35])
    assert link.beam is not None
    planes = [link.beam.flexural_rigidity[i] * modal[:, i:i + 1]
              * link.beam.bend(0.7, i).curvature(x)[:, 0] for i in (0, 1)]
    slacks = PathSlacks(arm, EVERY)
    found = slacks(states)[:, np.array(slacks.owners()) == 4]
    np.testing.assert_allclose(
        found, np.sqrt(1.01) - np.sqrt((planes[0]**2 + planes[1]**2) / 16 + 0.01), atol=1e-12)


def test_derivatives_are_those_of_the_slacks() -> None:
    arm = yaw_pitch()
    states, slacks, step = random_states(arm), PathSlacks(arm, EVERY), 1e-6
    lam = np.random.default_rng(4).uniform(0.5, 2, (len(states), slacks.count))
    values, slopes, curvature = slacks.linearise(states, lam)
    np.testing.assert_allclose(values, slacks(states), atol=1e-14)
    for j in range(states.shape[1]):
        both = [states + sign * step * np.eye(states.shape[1])[j] for sign in (1, -1)]
        np.testing.assert_allclose(
            slopes[..., j], (slacks(both[0]) - slacks(both[1])) / (2 * step), atol=1e-7)
        pulls = [(lam[:, None] @ slacks.linearise(x, lam)[1])[:, 0] for x in both]
        np.testing.assert_allclose(curvature[..., j], (pulls[0] - pulls[1]) / (2 * step),
                                   rtol=1e-6, atol=1e-5)


def test_links_that_meet_across_one_without_length_are_neighbours() -> None:
    # joints 1 and 2 of a Panda are at one place, and 5 and 6
    labels = SelfClearance(base_radius=0.1, link_radius=0.05, stations=1).labels(panda())
    pairs = {label.name.split(' at ')[0] + label.name.split('from')[1] for label in labels}
    assert pairs == {'link 4 link 2', 'link 6 link 2', 'link 6 link 3', 'link 7 link 2',
                     'link 7 link 3', 'link 7 link 4',
                     *(f'link {i} the base' for i in (3, 4, 6, 7))}


@pytest.mark.parametrize('text', [
    'keep_out_sphere:0.5,0.2,0.6,0.1;tip_radius=0.05;stations=2;link_radius=0.02',
    'keep_out_spatial_capsule:0.4,-0.5,0,0.4,-0.5,1,0.05;name=pillar',
    'keep_out_half_space:0,0,-0.1,0,0,1'])
def test_texts_are_read_and_written(text: str) -> None:
    constraint = read_constraint('limit', text)
    assert read_constraint('limit', write_constraint(constraint)) == constraint


@pytest.mark.parametrize(('constraint', 'said'), [
    (KeepOut(region=Circle(center=(0, 1), radius=0.1)),
     r"path_constraints\[0\].region is 'Circle', but must be a Sphere"),
    (Deflection(link=1, limit=0.1), 'a link with modes')])
def test_limits_of_another_kind_of_arm_are_refused(constraint: PathConstraint,
                                                   said: str) -> None:
    task = Task(arm=yaw_pitch(), start_positions=[0, 0], goal_positions=[1, 1], duration=1.0)
    with pytest.raises(InvalidValueError, match=said):
        replace(task, path_constraints=(constraint,))
    with pytest.raises(InvalidValueError, match=r'center has 2 numbers, but must be .* 3'):
        Sphere(center=(0.0, 1.0), radius=0.1)
