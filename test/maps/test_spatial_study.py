"""Maps over the three coordinates of a spatial arm's tip."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.progress import Monitor
from flex_planner.control.joint_controller import Gains
from flex_planner.maps.axes import Axis
from flex_planner.maps.cell_solver import CellSolver, NearCells
from flex_planner.maps.end_points import End
from flex_planner.maps.pictures.scene import Scene
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.simulated_arm import SimulatedArm
from flex_planner.maps.study import load_study, Study, StudyError
from flex_planner.maps.study_motion import StudyMotion
import numpy as np
import pytest
from spatial_arms import flexible_3r

NAN = float('nan')


def study(**fields: Any) -> Study:
    """Return a map of goals in a vertical plane; the corners are out of reach."""
    motion = StudyMotion(start=End(name='start', point=np.array([1.2, 0.3, 0.6])),
                         goal=End(name='goal', point=np.array([0.7, NAN, NAN])))
    values: dict[str, Any] = {
        'name': 'slice', 'arm': flexible_3r(), 'quantity': Quantity.MIN_EFFORT, 'motion': motion,
        'axes': (Axis(name='goal_y', values=np.array([-3.0, 0.0, 0.8])),
                 Axis(name='goal_z', values=np.array([0.1, 0.7])))}
    return Study(**{**values, **fields})


def test_axes_move_coordinates_of_the_goal() -> None:
    made = study()
    task = made.task((2, 1))
    np.testing.assert_allclose(task.goal_point, [0.7, 0.8, 0.7])
    bent = np.concatenate([task.goal_positions, np.zeros(task.arm.n_passive)])
    np.testing.assert_allclose(tip_position(task.arm, bent), task.goal_point, atol=1e-8)
    np.testing.assert_allclose(task.start_point, [1.2, 0.3, 0.6])
    failed = made.known_failures()
    assert [result.index for result in failed] == [(0, 0), (0, 1)]
    assert 'the arm reaches at most' in failed[0].message


def test_arm_is_shown_in_the_plane_of_the_axes() -> None:
    arm, posture = flexible_3r(), np.array([0.4, -0.3, 0.9])
    points = {sides: Scene(arm=arm, given=posture, best=None, given_name='goal',
                           sides=sides).joint_points(posture) for sides in ((0, 1), (1, 2))}
    bent = np.concatenate([posture, np.zeros(arm.n_passive)])
    tip = tip_position(arm, bent)
    np.testing.assert_allclose(points[0, 1][-1], tip[:2])
    np.testing.assert_allclose(points[1, 2][-1], tip[1:])
    np.testing.assert_allclose(points[1, 2][0], [0.0, 0.0])  # the base


FILE = """
name: slice
arm: {arm}
quantity: min_effort
duration: 1.0
start: {start}
{goal}
axes:
{axes}
"""


def read(folder: Path, arm: str, start: str, goal: str, *axes: str) -> Study:
    path = folder / 'study.yaml'
    lines = '\n'.join(f'  {name}: [0.2, 0.3]' for name in axes)
    path.write_text(FILE.format(arm=arm, start=start, goal=goal, axes=lines))
    return load_study(path)


def test_files_give_points_of_three_coordinates_or_axes(tmp_path: Path) -> None:
    made = read(tmp_path, 'spatial_3r', '[1.2, 0.3, 0.6]', '', 'goal_x', 'goal_y', 'goal_z')
    np.testing.assert_allclose(made.task((1, 0, 1)).goal_point, [0.3, 0.2, 0.3])


@pytest.mark.parametrize(('arm', 'start', 'goal', 'axes', 'message'), [
    ('spatial_3r', '[1.2, 0.3]', 'goal: [1, 0, 1]', ('payload_mass',),
     r'a point \[x, y, z\] in m'),
    ('korayem_rigid', '[0.5, 0]', 'goal: [0.5, 0.2]', ('goal_x', 'goal_z'),
     'axes.goal_z is .*the arm is planar'),
    ('spatial_3r', '[1.2, 0.3, 0.6]', 'goal_angles: [0, 0, 1]', ('goal_z',),
     'axes.goal_z is .*goal_angles gives the goal'),
    ('spatial_3r', '[1.2, 0.3, 0.6]', 'goal: [1, 0, 1]', ('goal_x', 'goal_y', 'goal_z'),
     'the axes goal_x, goal_y and goal_z give it')])
def test_what_does_not_fit_the_arm_is_refused(tmp_path: Path, arm: str, start: str, goal: str,
                                              axes: tuple[str, ...], message: str) -> None:
    with pytest.raises(StudyError, match=message):
        read(tmp_path, arm, start, goal, *axes)


def test_planar_arm_in_space_leaves_the_same_vibration() -> None:
    planar, motion = load_arm('clamped_motors'), StudyMotion(
        start=End(name='start', angles=np.array([-0.05, 0.2])),
        goal=End(name='goal', angles=np.array([0.0, 0.25])), duration=0.7, payload_mass=1.0)
    simulated = SimulatedArm(settling=0.1, gains=Gains.of(2, 40.0, 4.0))
    scales, found = np.array([0.9, 1.0]), []
    for arm in (planar, SpatialArm.of_planar(planar)):
        made = study(arm=arm, quantity=Quantity.RESIDUAL_VIBRATION, motion=motion,
                     simulated=simulated, axes=(Axis(name='payload_scale', values=scales),))
        solver = CellSolver(made)
        solution = solver.solve((0,), made.task((0,)), Monitor(), NearCells())
        found.append(solver.result((0,), solution).value)
    assert found[0] > 1e-5
    # in space directions are further apart
    assert found[1] == pytest.approx(found[0], rel=2e-3)
