"""Limits on the way and via points in pictures of a motion."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm
from flex_planner.optimal_control.path_constraints import (
    Capsule,
    Circle,
    HalfPlane,
    JointRange,
    JointSpeed,
    KeepOut,
)
from flex_planner.planning.constraint_margins import ConstraintMargin
from flex_planner.planning.region_outlines import outline_region
from flex_planner.plotting import draw_motion
import numpy as np
from plotting_support import motion

POST = KeepOut(region=Circle(center=(0.5, 0.2), radius=0.1), name='post')


def test_outlines_are_those_of_the_regions() -> None:
    circle = outline_region(Circle(center=(1, 2), radius=0.5), 9.0)
    np.testing.assert_allclose(np.linalg.norm(circle - [1, 2], axis=1), 0.5)
    np.testing.assert_allclose(circle[0], circle[-1], atol=1e-12)
    capsule = outline_region(Capsule(start=(0, 0), end=(3, 4), radius=0.5), 9.0)
    along = np.clip(capsule @ [0.6, 0.8] / 5, 0, 1)[:, None] * [3, 4]
    np.testing.assert_allclose(np.linalg.norm(capsule - along, axis=1), 0.5)
    np.testing.assert_array_equal(capsule[0], capsule[-1])
    plane = outline_region(HalfPlane(point=(0, 1), normal=(0, -2)), 2.0)
    assert plane[:, 1].min() == 1 and plane[:, 1].max() == 3  # y > 1 is not allowed
    assert np.ptp(plane[:, 0]) == 4


def test_regions_bounds_and_active_times_are_drawn(rigid_arm: Arm) -> None:
    margin = ConstraintMargin(name='tip from post', constraint=2, unit='m', margin=0.0, slack=0.0,
                              time=0.5, active=((0.4, 0.6),))
    limits = (JointSpeed(joint=1, limit=0.17), JointSpeed(joint=2, limit=50.0),
              JointRange(joint=2, upper=0.1), POST)
    drawn = draw_motion(replace(motion(rigid_arm), constraints=limits, margins=(margin,)))
    plain = draw_motion(motion(rigid_arm))
    angles, speeds, torques, tip, *_ = drawn.axes
    assert len(tip.patches) == 1 and not plain.axes[3].patches
    for axes, before, lines in ((angles, plain.axes[0], 1), (speeds, plain.axes[1], 1),
                                (torques, plain.axes[2], 0)):
        assert len(axes.patches) == len(before.patches) + 1
        bounds = [line for line in axes.lines if line.get_linestyle() == '--'
                  and len(line.get_xdata()) == 2]
        assert len(bounds) == lines  # one of 50 rad/s is too far away to be shown
    (legend,) = drawn.legends
    names = {text.get_text() for text in legend.get_texts()}
    assert {'post', 'at its limit: tip from post', 'limits on the way'} <= names


def test_via_points_are_marked_in_time_and_on_the_path(rigid_arm: Arm) -> None:
    shown = motion(rigid_arm)
    drawn = draw_motion(replace(shown, via_times=np.array([shown.times[4], 0.725])))
    angles, speeds, torques, tip, *_ = drawn.axes
    for axes in (angles, speeds, torques):
        marks = [line.get_xdata()[0] for line in axes.lines if line.get_label() == 'via points']
        assert marks == [shown.times[4], 0.725]
    (dots,) = (line for line in tip.lines if line.get_label() == 'via points')
    np.testing.assert_allclose(np.array(dots.get_xydata()), [
        shown.tip[4], (shown.tip[14] + shown.tip[15]) / 2])
    assert 'via points' in {text.get_text() for text in drawn.legends[0].get_texts()}
