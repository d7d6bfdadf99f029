"""Motions in space are drawn in three dimensions; arms in space are not drawn in the plane."""

from __future__ import annotations

from flex_planner.arms.planar_only import PlanarOnlyError
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.plotting import draw_arm, draw_motion
import numpy as np
import pytest
from spatial_arms import yaw_pitch


def test_path_of_the_tip_is_drawn_in_space() -> None:
    plan = plan_path(Task(arm=yaw_pitch(), start_positions=[0, -0.2], goal_positions=[1.2, 0.3],
                          duration=0.8, payload_mass=0.4), search='fast')
    figure = draw_motion(plan)
    (axes,) = (one for one in figure.axes if one.get_title() == 'path of the tip')
    (line,) = (one for one in axes.lines if one.get_label() == 'tip, planned')
    drawn = np.array(line.get_data_3d()).T  # type: ignore[attr-defined]
    np.testing.assert_allclose(drawn[[0, -1]], plan.sample([0.0, 0.8]).tip, atol=1e-12)
    limits = [getattr(axes, f'get_{name}lim')() for name in 'xyz']
    sides = np.diff(np.array(limits), axis=1)[:, 0]
    np.testing.assert_allclose(sides, sides[0])  # a length is a length in every direction


def test_arm_in_space_is_not_drawn_in_the_plane() -> None:
    with pytest.raises(PlanarOnlyError, match='pictures of arms do not know spatial arms'):
        draw_arm(ArmModel.of(yaw_pitch()), [np.zeros(2)])
