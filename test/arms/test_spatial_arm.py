"""Spatial arms as data: what is refused, what beams are, where links are."""

from __future__ import annotations

from dataclasses import replace
import math
from typing import Any

from flex_planner.arms.arm_files import arm_from_mapping, arm_from_plain, load_arm, plain_arm
from flex_planner.arms.joint import Node
from flex_planner.arms.kinematics import (
    bent_distances,
    link_points,
    payload_position,
    payload_velocity,
    tip_jacobian,
    tip_position,
    tip_velocity,
)
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_beam import SpatialBeam, TwistModes
from flex_planner.arms.spatial_body import join_bodies, place_body, SpatialBody, turn_rpy
from flex_planner.arms.spatial_joint import SpatialJoint
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.yaml_text import format_yaml, parse_yaml
from flex_planner.dynamics.cache_key import describe_fields
import numpy as np
from presets import SPATIAL_PRESETS
import pytest
from spatial_arms import flexible_3r, oblique, tudor, yaw_pitch

BEAM: dict[str, Any] = {'linear_density': 1.0, 'flexural_rigidity': (10.0, 20.0), 'modes': (1, 1)}


@pytest.mark.parametrize(('make', 'message'), [
    (lambda: SpatialJoint(axis=(0, 0, 0)), r'axis is .* must be a direction, not 0'),
    (lambda: SpatialJoint(rotation=((1, 0, 0), (0, 1, 0), (0, 0, -1))),
     'rotation is .* must be a rotation'),
    (lambda: SpatialJoint(housing=Node(mass=1.0)), "housing is 'given', but must be left out"),
    (lambda: SpatialBody(mass=-1.0), 'mass is -1.0, but must be a number >= 0 kg'),
    (lambda: SpatialBody(mass=1.0, inertia=((1, 0, 0), (0, 1, 0), (0, 0, -1))),
     'inertia is .* must be without negative principal moments'),
    (lambda: SpatialBody(mass=1.0, inertia=((1, 2, 0), (0, 1, 0), (0, 0, 1))),
     'inertia is .* must be symmetric'),
    (lambda: SpatialBeam(linear_density=1.0, modes=(1, 0)),
     r'flexural_rigidity\[0\] is inf, .*needed for modes in this plane'),
    (lambda: SpatialBeam(**{**BEAM, 'twist_modes': 1, 'torsional_rigidity': 5.0}),
     'polar_inertia is 0.0, but must be > 0 kg m with modes of twisting'),
    (lambda: SpatialBeam(**{**BEAM, 'mode_family': 'pinned_pinned'}),
     'mode_family is .* must be clamped_free or clamped_mass'),
    (lambda: SpatialBeam(**{**BEAM, 'modes': (1, 9)}), r'modes\[1\] is 9'),
    (lambda: SpatialLink(beam=SpatialBeam(**BEAM)), 'end is .* apart from the joint'),
    (lambda: SpatialLink(end=(0, 0, 2), beam=SpatialBeam(**BEAM, across=(0, 0, 1))),
     'beam.across is .* must be a direction across the beam'),
    (lambda: replace(yaw_pitch(), gravity=[0, -9.81]), 'gravity has 2 numbers, .* 3 numbers'),
    (lambda: replace(yaw_pitch(), joints=()), 'number of joints is 0, but must be 2'),
    (lambda: replace(yaw_pitch(), nodes=(Node(),)), "nodes is 'given', but must be left out"),
    (lambda: SpatialArm.of_planar(load_arm('korayem_ei50')),
     r"links\[0\] is 'no uniform clamped beam'"),
])
def test_bad_values_are_refused(make: Any, message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        make()


def test_planes_of_a_beam_are_named_by_the_frame_of_its_link() -> None:
    beam = SpatialBeam(**BEAM)
    for end, across in (((2, 0, 0), (0, 1, 0)), ((0, -1, 0), (0, 0, 1)), ((0, 0, 3), (1, 0, 0))):
        axes = SpatialLink(end=end, beam=beam).axes()
        np.testing.assert_allclose(axes[:, 0], np.array(end) / np.linalg.norm(end), atol=1e-15)
        np.testing.assert_allclose(axes[:, 1], across, atol=1e-15)
        assert np.linalg.det(axes) == pytest.approx(1)
    slanting = SpatialLink(end=(1, 1, 0), beam=replace(beam, across=(0, 0, 2))).axes()
    np.testing.assert_allclose(slanting[:, 1], (0, 0, 1), atol=1e-15)


def test_twisting_rods_meet_their_frequency_equation() -> None:
    free, loaded = TwistModes.of(2.0, 3, 0.0), TwistModes.of(2.0, 3, 4.0)
    np.testing.assert_allclose(free.waves, (np.arange(3) + 0.5) * math.pi)
    b = loaded.waves
    np.testing.assert_allclose(np.cos(b) - 4 * b * np.sin(b), 0, atol=1e-12)
    x = np.array([0.3, 1.7])
    slope = (loaded.turn(x + 1e-6) - loaded.turn(x - 1e-6)) / 2e-6
    np.testing.assert_allclose(loaded.slope(x), slope, rtol=1e-8, atol=1e-9)


def test_bodies_are_joined_and_placed() -> None:
    one = SpatialBody(mass=2.0, center_of_mass=(0.1, 0, 0), inertia=(0.01, 0.02, 0.03))
    other = SpatialBody(mass=1.0, center_of_mass=(-0.2, 0.3, 0), inertia=(0.02, 0.01, 0.02))
    turn, place = turn_rpy(0.1, 0.2, 0.3), np.array([0.5, -0.1, 0.2])
    together = place_body(join_bodies(one, other), place, turn)
    apart = join_bodies(place_body(one, place, turn), place_body(other, place, turn))
    assert together.mass == apart.mass == 3.0
    np.testing.assert_allclose(together.center_of_mass, apart.center_of_mass, atol=1e-15)
    np.testing.assert_allclose(together.inertia, apart.inertia, atol=1e-15)


@pytest.mark.parametrize('make', [lambda: flexible_3r(1, 1, foreshortening=True), oblique, tudor])
def test_velocities_are_those_of_finite_differences(make: Any) -> None:
    arm, h = make(), 1e-6
    rng = np.random.default_rng(0)
    q = np.concatenate([rng.uniform(-2, 2, arm.n_joints), 0.02 * rng.normal(size=arm.n_passive)])
    rates = rng.normal(size=(2, q.size))
    for move, velocity in ((tip_position, tip_velocity), (payload_position, payload_velocity)):
        expected = [(move(arm, q + h * v) - move(arm, q - h * v)) / (2 * h) for v in rates]
        np.testing.assert_allclose(velocity(arm, np.stack([q, q]), rates), expected, atol=1e-8)
    np.testing.assert_allclose(tip_jacobian(arm, q) @ rates.T,
                               tip_velocity(arm, np.stack([q, q]), rates).T, atol=1e-14)


def test_links_end_where_the_next_begin() -> None:
    arm = flexible_3r(2, 1)
    q = np.concatenate([[0.3, -0.5, 1.0], 0.02 * np.random.default_rng(1).normal(size=10)])
    points = link_points(arm, q, 5)
    assert points.shape == (3, 5, 3)
    np.testing.assert_allclose(points[:-1, -1], points[1:, 0], atol=1e-14)
    np.testing.assert_allclose(points[-1, -1], tip_position(arm, q), atol=1e-14)
    bent = bent_distances(arm, 1, q[None, arm.modal_slices[1]], 5)
    straight = link_points(arm, np.where(np.arange(13) < 3, q, 0), 5)
    np.testing.assert_allclose(bent[0], np.linalg.norm(points[1] - straight[1], axis=-1),
                               atol=1e-14)


def test_coordinates_have_names() -> None:
    assert flexible_3r(1, 1).passive_names == (
        'link2_y1', 'link2_z1', 'link2_twist1', 'link3_y1', 'link3_z1', 'link3_twist1')


def test_rigid_arm_keeps_masses_and_reach() -> None:
    arm = flexible_3r()
    rigid = arm.rigid()
    assert rigid.n_passive == 0
    assert rigid.reach == arm.reach == pytest.approx(1.9)
    assert sum(link.mass for link in rigid.links) == sum(link.mass for link in arm.links)


@pytest.mark.parametrize('name', SPATIAL_PRESETS)
def test_presets_say_where_they_come_from(name: str) -> None:
    arm = load_arm(name)
    assert isinstance(arm, SpatialArm)
    assert 'estimate' in arm.source


def test_preset_is_the_arm_of_the_tests() -> None:
    preset, arm = load_arm('spatial_3r'), flexible_3r()
    q = np.concatenate([[0.3, -0.5, 1.0], [0.01, 0.02, -0.01, 0.03]])
    np.testing.assert_allclose(tip_position(preset, q), tip_position(arm, q), atol=1e-12)
    np.testing.assert_allclose(preset.flexural_rigidities(), arm.flexural_rigidities(),
                               rtol=1e-12)


THIRD: dict[str, Any] = {
    'name': 'third form', 'kind': 'spatial',
    'joints': [{'axis': [0, 0, 1]}, {'xyz': [0, 0, 0.5], 'axis': [0, 1, 0]}],
    'tip': {'xyz': [0.6, 0, 0]},
    'links': [{'inertial': {'mass': 2.0, 'inertia': [0.1, 0.1, 0.1]}},
              {'section': {'width': 0.03, 'thickness': 0.01}, 'youngs_modulus': 7.0e10,
               'density': 2700.0, 'modes': {'across': 1, 'across2': 2, 'twist': 1}}]}


def changed(**fields: Any) -> dict[str, Any]:
    return {**THIRD, **fields}


def test_third_form_is_read() -> None:
    arm = arm_from_mapping(THIRD)
    assert isinstance(arm, SpatialArm)
    beam = arm.links[1].beam
    assert beam is not None
    assert (beam.modes, beam.twist_modes) == ((1, 2), 1)
    assert beam.linear_density == pytest.approx(2700 * 3e-4)
    assert beam.flexural_rigidity == pytest.approx((7e10 * 0.03 * 0.01**3 / 12,
                                                    7e10 * 0.01 * 0.03**3 / 12))
    # a strip three times as wide as thick: 0.263 b t^3 (Timoshenko and Goodier 1951)
    assert beam.torsional_rigidity == pytest.approx(7e10 / 2.6 * 0.263 * 0.03 * 0.01**3, rel=3e-3)
    assert beam.polar_inertia == pytest.approx(
        2700 * (0.03 * 0.01**3 + 0.01 * 0.03**3) / 12)
    assert arm.gravity.tolist() == [0, 0, -9.81]
    assert arm.links[0].end == (0, 0, 0.5)


@pytest.mark.parametrize(('content', 'message'), [
    (changed(kind='flat'), "kind is 'flat', but must be 'planar' or 'spatial'"),
    (changed(links=THIRD['links'][:1]), 'links has 1 link, but must be 2, one per joint'),
    (changed(joints=[{'axis': [0, 0, 1], 'typ': 'prismatic'}]),
     r'joints\[0\].typ is .* no such field'),
    (changed(tip={'xyz': [0, 0, 0]}), r"links\[1\].modes is 'given', but must be left out"),
    (changed(links=[THIRD['links'][0], {'modes': {'across': 1}, 'mass': 1.0}]),
     r'links\[1\].flexural_rigidity, or section and youngs_modulus is missing'),
    (changed(links=[THIRD['links'][0], {**THIRD['links'][1], 'mass': 1.0}]),
     r'links\[1\].linear_density or mass or density is .*exactly one of them'),
    (changed(links=[{'inertial': {'mass': 2.0, 'inertia': [1, 1, -1]}}, THIRD['links'][1]]),
     r'links\[0\].inertial.inertia\[2\] is -1.0'),
    (changed(gravity=[0, -9.81]), 'gravity has 2 numbers'),
])
def test_bad_files_are_refused_by_path(content: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        arm_from_mapping(content)


@pytest.mark.parametrize('name', ['spatial_3r', 'tudor_like', 'ur5_elastic'])
def test_recordings_keep_every_field(name: str) -> None:
    arm = load_arm(name)
    again = arm_from_plain(parse_yaml(format_yaml(plain_arm(arm))))
    assert isinstance(again, SpatialArm)
    assert describe_fields(again) == describe_fields(arm)
