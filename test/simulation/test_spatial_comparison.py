"""Planning with flexible links against planning with rigid ones, and gains, of an arm in space."""

from __future__ import annotations

from flex_planner.optimal_control.task import Task
from flex_planner.planning.feedback.find_gains import find_feedback_gains
from flex_planner.planning.plan_path import plan_path
from flex_planner.plotting import draw_comparison
from flex_planner.reports.comparison import comparison_rows
from flex_planner.simulation.comparison import compare
from flex_planner.simulation.execution import ExecutionMode
from flex_planner.simulation.mismatch import Mismatch
import numpy as np
import pytest
from spatial_arms import yaw_pitch

TASK = Task(arm=yaw_pitch(), start_positions=[0, -0.2], goal_positions=[1.2, 0.3], duration=0.8,
            payload_mass=0.4, payload_inertia=1e-3)


@pytest.mark.thorough
def test_gains_are_found_and_hold_in_the_simulation_of_another_module() -> None:
    found = find_feedback_gains(plan_path(TASK, search='fast'))
    assert found.found, found.message
    assert found.joints is not None
    assert len(found.differences) == 7  # the model, four corners, more modes twice
    worst = found.records['joints'].worst
    assert 1e-3 < worst < 1e-2
    carried = compare(TASK, gains=found.joints, settling=0.5,
                      mismatch=Mismatch(rigidity_scale=0.9), payload_mass=0.44)
    # as the corner of the box, but for the payload's inertia and encoders that round
    assert 1e-3 < carried.of(ExecutionMode.FLEXIBLE).residual.tip < 1.3 * worst


@pytest.mark.thorough
def test_flexible_plan_brings_an_arm_in_space_to_rest_and_a_rigid_one_does_not() -> None:
    found = compare(TASK, settling=0.5)
    assert found.solved
    assert found.goal.shape == (3,)
    flexible, rigid = (found.of(mode) for mode in (ExecutionMode.FLEXIBLE, ExecutionMode.RIGID))
    np.testing.assert_allclose(found.goal, flexible.execution.tip[-1], atol=1e-5)
    assert flexible.residual.tip < 2e-5
    assert rigid.residual.tip > 5e-3  # by ten millimetres and more
    rows = dict(comparison_rows(found))
    assert rows['goal of the tip'].count(',') == 2
    figure = draw_comparison(found)
    (axes,) = (one for one in figure.axes if 'path of the tip' in one.get_title())
    assert axes.name == '3d'
