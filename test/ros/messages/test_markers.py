"""Regions that are kept free, and via points, as markers."""

from __future__ import annotations

from factories import PlanFactory
from flex_planner.optimal_control.path_constraints import Circle, JointSpeed, KeepOut
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.ros.messages.markers import motion_markers
import numpy as np
import pytest


def test_regions_are_outlines_of_their_own(plan_of: PlanFactory) -> None:
    plan = plan_of('rigid')
    sampled = sample_plan(plan, SamplingSettings())
    limits = (JointSpeed(joint=1, limit=3.0),
              KeepOut(region=Circle(center=(0.5, 0.2), radius=0.1)))
    markers = motion_markers(plan.arm, sampled, 'base', limits).markers
    (outline,) = (marker for marker in markers if marker.ns == 'keep_out')
    assert outline.header.frame_id == 'base'
    points = np.array([(point.x, point.y) for point in outline.points])
    np.testing.assert_allclose(np.linalg.norm(points - [0.5, 0.2], axis=1), 0.1)
    assert len(motion_markers(plan.arm, sampled, 'base').markers) == len(markers) - 1


@pytest.mark.parametrize('hold', [0.0, 0.5])
def test_via_points_are_balls_where_the_tip_passes(plan_of: PlanFactory, hold: float) -> None:
    plan = plan_of('rigid')
    sampled = sample_plan(plan, SamplingSettings(start_hold=hold))
    k = sampled.times_ns.size // 2
    times = [1e-9 * sampled.times_ns[j] - hold for j in (k, k + 3)]
    found = [marker for marker in motion_markers(
        plan.arm, sampled, 'base', via_times=times).markers if marker.ns == 'via_points']
    assert [marker.id for marker in found] == [0, 1]
    places = [(marker.pose.position.x, marker.pose.position.y) for marker in found]
    np.testing.assert_array_equal(places, sampled.samples.tip[[k, k + 3]])
    assert not [marker for marker in motion_markers(plan.arm, sampled, 'base').markers
                if marker.ns == 'via_points']
