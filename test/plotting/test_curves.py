"""Each curve is seen, and axes show no rounding errors."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, Joint, Motor
from flex_planner.base.colours import COORDINATES, hides_another
from flex_planner.plotting import draw_modes, draw_motion, draw_tip, draw_torques
from flex_planner.plotting.curves import draw_columns, limits_beside, settle_limits
from flex_planner.plotting.motion import draw_angles, Motion
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
from plotting_support import motion
import pytest

TIMES = np.linspace(0, 1, 21)


@pytest.fixture
def axes() -> Axes:
    return Figure().subplots()


def test_curve_upon_another_is_dashed(axes: Axes) -> None:
    wave = np.sin(6 * TIMES)
    values = np.column_stack([wave, wave + 1e-3, -wave, 0 * wave])
    draw_columns(axes, TIMES, values, 'abcd', COORDINATES[:4])
    assert [line.get_linestyle() for line in axes.lines] == ['-', '--', '-', '-']


@pytest.mark.parametrize(('share', 'hidden'), [(0.0, True), (0.25, True), (0.5, False)])
def test_curve_hides_another_where_most_of_it_does(share: float, hidden: bool) -> None:
    other = np.where(TIMES < share, 1.0, 0.0)
    assert hides_another(np.column_stack([0 * TIMES, other]), 1) is hidden


def test_constant_value_with_rounding_is_a_line_in_the_middle(axes: Axes) -> None:
    axes.plot(TIMES, 30 + 1e-12 * np.sin(99 * TIMES))
    settle_limits(axes, 0.1)
    low, high = axes.get_ylim()
    assert (low + high) / 2 == pytest.approx(30)
    assert high - low == pytest.approx(0.1)
    axes.figure.canvas.draw()
    assert axes.yaxis.get_major_formatter().get_offset() == ''


def test_bounds_that_are_near_are_shown_and_far_ones_cut_off() -> None:
    torques = np.array([-1.0, 3.0])
    assert limits_beside(torques, np.array([-2.0, 4.0]), 0.1) == pytest.approx((-2.48, 4.48))
    low, high = limits_beside(torques, np.array([-200.0, 400.0]), 0.1)
    assert (low, high) == pytest.approx((-1.32, 3.32))
    assert limits_beside(torques, np.array([-np.inf, np.inf]), 0.1) == (low, high)
    assert np.ptp(limits_beside(0 * torques, np.array([-9.0, 9.0]), 0.1)) == pytest.approx(0.1)


def strong(arm: Arm, torque: float) -> Motion:
    joints = (Joint(motor=Motor(stall_torque=torque)),) * arm.n_joints
    return motion(replace(arm, joints=joints))


@pytest.mark.parametrize(('torque', 'legend'), [
    (1.4, {'shoulder', 'elbow', 'bounds of the torques'}),
    (500.0, {'shoulder', 'elbow', 'bounds of shoulder: -500 to 500 N m',
             'bounds of elbow: -500 to 500 N m'})])
def test_torques_fill_their_diagram(rigid_arm: Arm, axes: Axes, torque: float,
                                    legend: set[str]) -> None:
    drawn = strong(rigid_arm, torque)
    draw_torques(axes, drawn)
    low, high = axes.get_ylim()
    assert np.ptp(drawn.torques) > 0.2 * (high - low)
    assert set(axes.get_legend_handles_labels()[1]) == legend


def test_angles_are_in_degrees(rigid_arm: Arm, axes: Axes) -> None:
    drawn = motion(rigid_arm)
    draw_angles(axes, drawn)
    assert axes.get_ylabel() == 'angle [deg]'
    np.testing.assert_allclose(axes.lines[0].get_ydata(),
                               np.degrees(drawn.coordinates[:, 0]))


def test_modes_have_other_colours_than_joints(ei50_arm: Arm) -> None:
    figure = draw_motion(motion(ei50_arm))
    angles, modes = figure.axes[0], figure.axes[4]
    colours = [line.get_color() for one in (angles, modes) for line in one.lines]
    assert colours == list(COORDINATES[:len(colours)])


def test_tip_moves_by_so_little_that_nothing_is_seen_of_it(rigid_arm: Arm, axes: Axes) -> None:
    still = replace(motion(rigid_arm), tip=np.full((TIMES.size, 2), 0.1)
                    + 1e-13 * np.arange(2 * TIMES.size).reshape(-1, 2))
    draw_tip(axes, still)
    assert np.ptp(axes.get_ylim()) > 1e-2  # [m]


def test_bending_of_a_nanometre_is_no_curve(ei50_arm: Arm, axes: Axes) -> None:
    drawn = motion(ei50_arm)
    draw_modes(axes, replace(drawn, coordinates=1e-9 * drawn.coordinates))
    assert np.ptp(axes.get_ylim()) >= 1e-2  # [mm]


def test_notebooks_get_a_png(rigid_arm: Arm) -> None:
    assert draw_motion(motion(rigid_arm))._repr_png_().startswith(b'\x89PNG')
