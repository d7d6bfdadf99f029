"""The moving view of a spatial arm: its data, and what the script makes of them."""

from __future__ import annotations

from dataclasses import replace
import json
from pathlib import Path
import shutil
import subprocess
from typing import Any

from flex_planner.arms.kinematics import link_points, payload_position, tip_position
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.arms.spatial_kinematics import tip_frame
from flex_planner.reports.recording.animation import animation
from flex_planner.reports.recording.arm_tables import arm_tables
from flex_planner.reports.recording.contents import RecordedMotion
from flex_planner.reports.recording.plots import TIP_SIDES
import numpy as np
import pytest
from spatial_arms import flexible_3r, oblique

FOLDER = Path(__file__).parents[3] / 'flex_planner' / 'reports' / 'recording'


def moving(arm: SpatialArm, count: int = 41) -> RecordedMotion:
    """Return a smooth motion of joints and modes, which no dynamics have made."""
    times = np.append(np.linspace(0, 1, count), 1.01)
    share = np.append(np.linspace(0, 1, count), 1.0)[:, None]
    n, n_t = arm.n_joints, arm.n_coordinates
    ends = np.random.default_rng(3).uniform(-1, 1, (2, n_t)) * np.where(
        np.arange(n_t) < n, 1.0, 0.02)
    coordinates = ends[0] + share**2 * (3 - 2 * share) * (ends[1] - ends[0])
    nothing = np.zeros_like(coordinates)
    return RecordedMotion(
        times=times, coordinates=coordinates, rates=nothing, accelerations=nothing[:, :n],
        torques=nothing[:, :n], position_costates=nothing, velocity_costates=nothing,
        torque_costates=nothing[:, :0],
        tip=tip_position(arm, coordinates), payload_mass=0.5)


@pytest.mark.parametrize('make', [flexible_3r, oblique])
def test_view_has_the_arm_as_it_bends(make: Any) -> None:
    arm = make()
    motion = moving(arm)
    shown = animation(arm, motion)
    times = np.array(shown['times'])
    for k in (0, 77, times.size - 1):
        posture = np.array([np.interp(times[k], motion.times, column)
                            for column in motion.coordinates.T])
        points = link_points(arm, posture, 13)
        for i, link in enumerate(arm.links):
            drawn = np.array(shown['links'][k][i]).reshape(-1, 3)
            wanted = points[i] if link.modes else points[i][[0, -1]]
            np.testing.assert_allclose(drawn, 1e3 * wanted, atol=1e-2)
        np.testing.assert_allclose(shown['payload'][k], 1e3 * payload_position(arm, posture),
                                   atol=1e-2)
        axes = np.array(shown['hand'][k]).reshape(3, 3).T
        np.testing.assert_allclose(axes, tip_frame(arm, posture)[1], atol=1e-3)


def test_view_holds_all_of_the_motion_over_its_floor() -> None:
    shown = animation(flexible_3r(), moving(flexible_3r()))
    points = np.concatenate([np.array(link).reshape(-1, 3) for frame in shown['links']
                             for link in frame])
    assert np.linalg.norm(points - shown['centre'], axis=1).max() < shown['radius']
    floor = np.array(shown['floor']).reshape(-1, 3)
    np.testing.assert_allclose(floor[:, 2], shown['ground'], atol=1e-3)
    assert shown['ground'] <= points[:, 2].min() + 1e-3
    assert (floor[:, :2].min(axis=0) <= points[:, :2].min(axis=0)).all()
    assert (floor[:, :2].max(axis=0) >= points[:, :2].max(axis=0)).all()


# a document that has what the script takes of it, without a picture
DOCUMENT = """
class Node {
  constructor() { Object.assign(this, { attributes: {}, heard: {}, children: [] }); }
  setAttribute(name, value) { this.attributes[name] = value; }
  appendChild(child) { this.children.push(child); }
  insertBefore(child) { this.children.push(child); }
  addEventListener(name, act) { this.heard[name] = act; }
  get firstChild() { return { namespaceURI: '' }; }
}
const document = { createElement: () => new Node(), createElementNS: () => new Node() };
function element(tag, parent) { return new Node(); }
"""
DRAG = """
const arm = new SpatialArm(spec, new Node(), () => {});
const seen = [];
function look() {
  const { cx, cy } = arm.payload.attributes;
  seen.push([arm.azimuth, arm.elevation, cx, cy]);
}
arm.show(spec.times[60]);
look();
arm.svg.setPointerCapture = () => {};
arm.svg.heard.pointerdown({ clientX: 100, clientY: 100 });
arm.svg.heard.pointermove({ clientX: 160, clientY: 130 });
arm.svg.heard.pointerup({});
arm.svg.heard.pointermove({ clientX: 0, clientY: 0 });
look();
arm.svg.heard.keydown({ key: 'ArrowUp', preventDefault: () => {} });
look();
console.log(JSON.stringify(seen));
"""


def test_script_turns_the_view_with_the_mouse_and_with_keys() -> None:
    node = shutil.which('node')
    if node is None:
        pytest.skip('no node is installed')
    spec = animation(flexible_3r(), moving(flexible_3r()))
    script = '\n'.join(['"use strict";', DOCUMENT, *(
        (FOLDER / name).read_text(encoding='utf-8').replace("'use strict';", '')
        for name in ('player.js', 'space.js')), f'const spec = {json.dumps(spec)};', DRAG])
    told = subprocess.run([node, '-'], input=script, capture_output=True, text=True, check=True)
    seen = np.array(json.loads(told.stdout))
    np.testing.assert_allclose(np.diff(seen[:, 0]), [-0.6, 0.0])  # dragged to the right
    np.testing.assert_allclose(np.diff(seen[:, 1]), [0.3, np.pi / 36])  # down: from higher up
    for azimuth, elevation, x, y in seen:
        right = [-np.sin(azimuth), np.cos(azimuth), 0]
        eye = [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation),
               np.sin(elevation)]
        away = np.array(spec['payload'][60]) - spec['centre']
        np.testing.assert_allclose([x, -y], [away @ right, away @ np.cross(eye, right)],
                                   atol=1e-6)


def test_paths_are_seen_from_three_sides() -> None:
    assert {tuple(sorted(sides)) for _, *sides in TIP_SIDES} == {(0, 1), (0, 2), (1, 2)}


def test_tables_have_bodies_and_planes_of_bending_and_units_of_slides() -> None:
    links, joints = arm_tables(oblique())
    assert 'body at its joint' in links.columns
    moves = joints.columns.index('moves')
    told = [row[moves].split()[0] for row in joints.rows]
    assert set(told) == {'slides', 'turns'}
    assert 'stall torque [N m, N]' in joints.columns
    links, joints = arm_tables(replace(flexible_3r(), payload_tensor=[0.01, 0.03, 0.02]))
    assert links.rows[-1][-1] == (
        'centre at (0.05, 0, 0) m from the tip, principal moments 0.01, 0.02, 0.03 kg m²')
    assert {row[links.columns.index('modes')] for row in links.rows} == {
        'rigid', '1 across, 1 across2, clamped_mass'}
    assert 'stall torque [N m]' in joints.columns
