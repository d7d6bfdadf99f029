"""Motions and arms in space are drawn in three dimensions."""

from __future__ import annotations

from flex_planner.arms.kinematics import tip_position
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.plotting import draw_arm, draw_motion
import numpy as np
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


def test_arm_in_space_is_drawn_at_rest_and_in_its_natural_modes() -> None:
    model, postures = ArmModel.of(yaw_pitch()), [np.zeros(2), np.array([0.5, -0.4])]
    figure = draw_arm(model, postures, 0.4)
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[:2] == ['at (0, 0) deg', 'at (28.65, -22.92) deg']
    assert [title.startswith('natural mode') for title in titles] == [False] * 2 + [True] * 2
    rest, _ = equilibrium(model, postures[1], Parameters.of(model.arm, payload_mass=0.4))
    (line,) = (one for one in figure.axes[1].lines if one.get_label() == 'flexible')
    drawn = np.array(line.get_data_3d()).T  # type: ignore[attr-defined]
    np.testing.assert_allclose(drawn[-1], tip_position(model.arm, rest), atol=1e-12)
    # what the lines are stands beside the diagrams
    figure.draw_without_rendering()
    (legend,) = figure.subfigs[0].legends
    box = legend.get_window_extent()
    assert not any(box.overlaps(axes.get_tightbbox()) for axes in figure.axes)
