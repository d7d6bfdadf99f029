"""Studies of maps: files as written, postures without jumps, and every mistake by its path."""

from __future__ import annotations

from collections.abc import Mapping
import copy
from dataclasses import replace
from itertools import product
import math
import os
from pathlib import Path
import pickle
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm, preset_files
from flex_planner.base.errors import (
    FlexPlannerError,
    InvalidValueError,
    SingularError,
    UnreachableError,
)
from flex_planner.base.validation import Array
from flex_planner.maps.axes import AXES, Axis, tiles
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.end_points import are_close, End
from flex_planner.maps.quantities import Quantity
from flex_planner.maps.study import load_study, Study, StudyError
from flex_planner.maps.study_motion import StudyMotion
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.task import postures_from_points, Task
from flex_planner.planning.plan_path import plan_path
from hypothesis import given
from hypothesis import strategies as some
import numpy as np
import pytest
import yaml

EXAMPLES = Path(__file__).parents[2] / 'config' / 'studies'
REMOVE = object()
COMPLETE: dict[str, Any] = {
    'name': 'a map', 'arm': 'korayem_ei50', 'modes': 1, 'quantity': 'residual_vibration',
    'start': [0.5, 0.0], 'goal': [0.5, 0.5], 'duration': 1.0, 'elbow': -1,
    'effort_weights': [0.125, 0.25], 'velocity_weights': [1.0, 2.0], 'tolerance': 1e-3,
    'axes': {'goal_x': {'from': -0.5, 'to': 0.5, 'count': 5}, 'payload_mass': [0.0, 1.0, 3.0]},
    'cell_time_limit': 30.0, 'block': {'goal_x': 2}, 'settling': 2.0,
    'mismatch': {'payload_mass': 1.5, 'rigidity_scale': 0.5, 'added_friction': 0.1, 'modes': 2},
    'gains': {'stiffness': 100.0, 'damping': [10.0, 5.0]},
}
SEARCH: dict[str, Any] = {
    'name': 'a map', 'arm': 'korayem_ei50', 'quantity': 'max_payload', 'duration': 1.0,
    'start': [0.5, 0.0], 'goal': [0.5, 0.5], 'axes': {'goal_y': [0.2, 0.5]}}
MISTAKES: list[tuple[str, object, str]] = [
    # place in COMPLETE, value put there, start of the message
    ('name', REMOVE, 'name is missing, but must be given'),
    ('nam', 'a', "nam is 'a', but must be left out: there is no such field; did you mean name?"),
    ('arm', REMOVE, 'arm is missing, but must be given'),
    ('arm', 'korayem', "arm: arm 'korayem' is neither a file"),
    ('arm', 'arms/mine.yaml', 'arm: arm file '),
    ('arm', {'name': 'x', 'links': [{'length': -1}], 'joints': [{}]}, 'arm.links[0].length is -1'),
    ('arm', 3, 'arm is 3, but must be a mapping of fields'),
    ('modes', 9, 'modes is 9, but must be an integer from 0 to 8'),
    ('quantity', 'payload', "quantity is 'payload', but must be one of max_payload, "),
    ('quantity', 'min_effort', "mismatch is {'payload_mass': 1.5, "),
    ('start', REMOVE, 'start or start_angles is missing, but must be given, exactly one of them'),
    ('start', [0.5], 'start is [0.5], but must be a point [x, y] in m'),
    ('start', 'there', "start is 'there', but must be a list of numbers"),
    ('start', [0.5, math.nan], 'start is nan, but must be a finite number'),
    ('start', [1.5, 0.0], 'start: the point (1.5, 0) m is 1.5 m from the base; the arm reaches'),
    ('start', [1.0, 0.0], 'start: the arm is stretched out or folded'),
    ('start_angles', [0.0, 1.0], 'start_angles is [0.0, 1.0], but must be left out where start'),
    ('goal', REMOVE, 'goal or goal_angles is missing'),
    ('elbow', 0, 'elbow is 0, but must be +1 or -1'),
    ('duration', REMOVE, 'duration is missing, but must be given'),
    ('duration', 0.0, 'duration is 0.0, but must be a number > 0 and <= 1000 s'),
    ('payload_mass', 1.0, 'payload_mass is 1.0, but must be left out: the axis payload_mass'),
    ('effort_weights', [1.0, 1.0, 1.0], 'effort_weights has 3 numbers'),
    ('effort_weights', [1.0, 0.0], 'effort_weights[1] is 0.0, but must be a number > 0'),
    ('velocity_weights', 1.0, 'velocity_weights has shape ()'),
    ('tolerance', 2.0, 'tolerance is 2.0'),
    ('accuracy', 0.1, 'accuracy is 0.1, but must be left out: residual_vibration is computed'),
    ('cell_time_limit', 0, 'cell_time_limit is 0.0, but must be a number > 0 and <= 3600 s'),
    ('settling', -1.0, 'settling is -1.0'),
    ('axes', REMOVE, 'axes is missing, but must be given'),
    ('axes', [1, 2], 'axes is [1, 2], but must be a mapping of fields'),
    ('axes', {}, 'number of axes is 0, but must be an integer from 1 to 4'),
    ('axes', dict.fromkeys(list(AXES)[:5], [1]), 'number of axes is 5'),
    ('axes/mass', [1.0], "axes is 'mass', but must be one of goal_x, "),
    ('axes/gaol_y', [1.0], "axes is 'gaol_y', but must be one of goal_x, goal_y, "),
    ('axes/goal_x', 0.5, 'axes.goal_x is 0.5, but must be a list of rising numbers, or from'),
    ('axes/goal_x', [], 'axes.goal_x is [], but must be a list of rising numbers'),
    ('axes/goal_x', [0.1, True], 'axes.goal_x is [0.1, True], but must be a list'),
    ('axes/goal_x', [[0.1, 0.2]], 'axes.goal_x is [[0.1, 0.2]], but must be a list'),
    ('axes/goal_x', [0.1, 0.1], 'axes.goal_x[1] is 0.1, but must be > 0.1, the value before it'),
    ('axes/goal_x', [0.1, math.nan], 'axes.goal_x[1] is nan, but must be a finite number'),
    ('axes/goal_x', {'from': 1, 'to': 1, 'count': 2}, 'axes.goal_x.to is 1.0, but must be'),
    ('axes/goal_x', {'from': 0, 'to': 1, 'count': 1}, 'axes.goal_x.count is 1, but must be'),
    ('axes/goal_x', {'from': 0, 'count': 5}, 'axes.goal_x.to is missing, but must be given'),
    ('axes/goal_x', {'from': 0, 'to': 1, 'count': 5, 'by': 1}, 'axes.goal_x.by is 1'),
    ('axes/goal_x', {'from': 0, 'to': 1, 'count': 1e8}, 'axes.goal_x.count is 100000000.0, but'),
    ('axes/duration', {'from': 1, 'to': 2, 'count': 10_000_000}, 'number of cells is 150000000'),
    ('axes/payload_mass', [-1.0, 0.0], 'axes.payload_mass[0] is -1.0, but must be a number >= 0'),
    ('axes/motor_scale', [1, 2e3], 'axes.motor_scale[1] is 2000.0, but must be'),
    ('axes/velocity_weight', [1], 'velocity_weights is [1.0, 2.0], but must be left out: '),
    ('axes/goal_y', [0.1], 'goal is [0.5, 0.5], but must be left out: the axes goal_x and goal_y'),
    ('axes/payload_scale', [1.0], 'mismatch.payload_mass is 1.5, but must be left out'),
    ('block', {'goal_y': 2}, 'block.goal_y is 2, but must be left out: there is no such field'),
    ('block', {'goal_x': 6}, 'block.goal_x is 6, but must be an integer from 1 to 5'),
    ('mismatch/payload_mass', -1, 'mismatch.payload_mass is -1.0'),
    ('mismatch/rigidity_scale', 0, 'mismatch.rigidity_scale is 0.0'),
    ('mismatch/added_friction', [1], 'mismatch.added_friction has 1 number'),
    ('mismatch/modes', -2, 'mismatch.modes is -2'),
    ('mismatch/mass', 1, 'mismatch.mass is 1, but must be left out'),
    ('gains/damping', REMOVE, 'gains.damping is missing, but must be given'),
    ('gains/stiffness', 'stiff', "gains.stiffness is 'stiff', but must be a number"),
    ('gains/stiffness', -1, 'gains.stiffness[0] is -1.0'),
]
SENSELESS: list[tuple[dict[str, Any], str]] = [
    ({'axes': {'payload_mass': [1]}}, 'axes.payload_mass is .* the payload is what is searched'),
    ({'quantity': 'min_duration', 'axes': {'duration': [1]}, 'duration': REMOVE},
     'axes.duration is .* the duration is what is searched'),
    ({'axes': {'velocity_weight': [1]}}, 'axes.velocity_weight is .* weights shape a motion'),
    ({'axes': {'payload_scale': [1]}}, 'axes.payload_scale is .* only residual_vibration'),
    ({'quantity': 'residual_vibration', 'axes': {'payload_scale': [1]}}, 'payload_mass is 0'),
    ({'arm': 'korayem_rigid', 'axes': {'stiffness_scale': [1]}}, 'every link .* is rigid'),
    ({'arm': 'korayem_rigid', 'modes': 1}, 'modes is 1, .* every link of the arm is rigid'),
    ({'arm': 'korayem_hanging', 'quantity': 'min_effort', 'axes': {'motor_scale': [1]}},
     'no motor of the arm has a limit'),
    ({'arm': 'korayem_hanging'}, 'otherwise there is no largest payload'),
    ({'arm': 'korayem_hanging', 'quantity': 'min_duration'},
     'otherwise there is no shortest duration'),
    ({'accuracy': 0.0}, r'accuracy is 0.0, but must be a number >= 1e-06 and <= 1000 kg'),
    ({'gains': {}}, 'gains is {}, but must be left out: only residual_vibration'),
    ({'goal': REMOVE, 'goal_angles': [0.0, 1.0]}, 'axes.goal_y is .* goal_angles gives the goal'),
    ({'start': REMOVE, 'start_angles': [0.0]}, 'start_angles has 1 number'),
]


def changed(place: str, value: object) -> dict[str, Any]:
    """Return COMPLETE with one value replaced, added or removed."""
    content = copy.deepcopy(COMPLETE)
    target: Any = content
    *parents, last = place.split('/')
    for part in parents:
        target = target[part]
    target[last] = value
    if value is REMOVE:
        del target[last]
    return content


def study_of(folder: Path, content: object) -> Study:
    """Return what a file with some content is read as."""
    path = folder / 'study.yaml'
    path.write_text(content if isinstance(content, str) else yaml.safe_dump(
        content, sort_keys=False))
    return load_study(path)


def over(arm: str, axes: dict[str, list[float]], block_shape: tuple[int, ...] = (),
         **fields: Any) -> Study:
    """Return a study of effort over some axes."""
    ends = {name: End(name=name, point=point) for name, point in
            (('start', (0.5, 0.0)), ('goal', (0.5, 0.5)))}
    return Study(name='', arm=load_arm(arm), quantity=Quantity.MIN_EFFORT,
                 block_shape=block_shape, motion=StudyMotion(**{**ends, **fields}),
                 axes=tuple(Axis(name=name, values=np.array(values, dtype=np.float64))
                            for name, values in axes.items()))


def tasks(study: Study) -> dict[tuple[int, ...], Task]:
    """Return the tasks of the cells that have one."""
    lost = {result.index for result in study.known_failures()}
    return {index: study.task(index) for index in product(*map(range, study.shape))
            if index not in lost}


def test_study_is_read_as_written(tmp_path: Path) -> None:
    study = study_of(tmp_path, COMPLETE)
    assert (study.name, study.quantity, study.shape) == ('a map', Quantity.RESIDUAL_VIBRATION,
                                                         (5, 3))
    assert [(axis.name, axis.unit) for axis in study.axes] == [('goal_x', 'm'),
                                                               ('payload_mass', 'kg')]
    assert study.axes[0].values.tolist() == [-0.5, -0.25, 0.0, 0.25, 0.5]
    assert [link.modes for link in study.arm.links] == [1, 1]
    assert (study.block_shape, study.cell_time_limit) == ((2, 1), 30.0)
    assert study.simulated.settling == 2.0
    assert study.simulated.mismatch.added_friction.tolist() == [0.1, 0.1]
    assert study.simulated.gains is not None
    assert study.simulated.gains.stiffness.tolist() == [100.0, 100.0]
    assert math.isnan(study.accuracy)
    assert study.text == (tmp_path / 'study.yaml').read_text()


def test_cell_is_the_task_of_its_values(tmp_path: Path) -> None:
    study = study_of(tmp_path, COMPLETE)
    task = study.task((3, 2))
    start, goal = postures_from_points(study.arm, (0.5, 0.0), (0.25, 0.5), elbow=-1)
    assert task.start_positions.tolist() == start.tolist()
    assert task.goal_positions.tolist() == goal.tolist()
    assert (task.start_point.tolist(), task.goal_point.tolist()) == ([0.5, 0.0], [0.25, 0.5])
    assert (task.arm, task.duration, task.payload_mass) == (study.arm, 1.0, 3.0)
    assert task.effort_weights.tolist() == [0.125, 0.25]
    assert task.velocity_weights.tolist() == [1.0, 2.0, 0.0, 0.0]


def test_plant_of_a_cell_differs_as_is_said(tmp_path: Path) -> None:
    arm, payload = study_of(tmp_path, COMPLETE).plant((0, 0))
    assert payload == 1.5
    assert [(link.modes, link.flexural_rigidity) for link in arm.links] == [(2, 25.0)] * 2
    assert [joint.viscous_friction for joint in arm.joints] == [0.1, 0.1]
    content = changed('axes/payload_scale', [0.5, 2.0])
    del content['mismatch']
    study = study_of(tmp_path, content)
    assert [study.plant((0, 2, i))[1] for i in range(2)] == [1.5, 6.0]


def test_axes_change_what_they_name_and_nothing_that_is_compiled() -> None:
    study = over('korayem_ei50', {'stiffness_scale': [0.5, 1.0], 'motor_scale': [2.0, 3.0],
                                  'velocity_weight': [4.0], 'duration': [0.7]})
    task = study.task((0, 1, 0, 0))
    assert [link.flexural_rigidity for link in task.arm.links] == [25.0, 25.0]
    assert [(joint.motor.stall_torque, joint.motor.no_load_speed)
            for joint in task.arm.joints] == [(24.0, 3.5)] * 2
    assert task.velocity_weights.tolist() == [4.0, 4.0, 0.0, 0.0, 0.0, 0.0]
    assert task.duration == 0.7
    assert study.task((1, 0, 0, 0)).arm.links == study.arm.links
    assert {name for name in AXES if 'scale' in name} == {'stiffness_scale', 'motor_scale',
                                                          'payload_scale'}


@pytest.mark.parametrize('path', sorted(EXAMPLES.glob('*.yaml')), ids=lambda path: path.stem)
def test_example_can_be_computed_somewhere(path: Path) -> None:
    study = load_study(path)
    assert study.quantity is Quantity.MAX_PAYLOAD
    assert len(study.known_failures()) < math.prod(study.shape) / 2


def test_capacity_map_of_the_rigid_arm_has_1600_cells_of_the_papers_motion() -> None:
    study = load_study(EXAMPLES / 'payload_map_rigid.yaml')
    task = study.task((29, 29))
    assert (study.shape, study.block_shape) == ((40, 40), (5, 5))
    assert (study.arm.n_modes, task.duration) == (0, 1.0)
    assert task.effort_weights.tolist() == [0.125, 0.125]
    modal = load_study(EXAMPLES / 'payload_map_one_mode.yaml')
    assert [link.modes for link in modal.arm.links] == [1, 1]


@pytest.fixture
def postures(monkeypatch: pytest.MonkeyPatch) -> list[Mapping[str, float]]:
    """Return the values that a posture has been looked for at, as they come."""
    seen, posture = [], End.posture

    def watched(end: End, arm: Arm, values: Mapping[str, float], *others: Any) -> Array:
        seen.append(values)
        return posture(end, arm, values, *others)

    monkeypatch.setattr(End, 'posture', watched)
    return seen


def test_unreachable_cells_are_those_out_of_the_workspace_and_are_known_at_once(
        postures: list[Mapping[str, float]]) -> None:
    study = load_study(EXAMPLES / 'payload_map_rigid.yaml')
    postures.clear()
    found = study.known_failures()
    # a closed form for each cell; the start is the same for all
    assert len(postures) == 40 * 40
    x, y = (axis.values for axis in study.axes)
    far = np.hypot(*np.meshgrid(x, y, indexing='ij')) > study.arm.reach
    assert [result.index for result in found] == [tuple(index) for index in np.argwhere(far)]
    assert {result.code for result in found} == {CellCode.UNREACHABLE}
    assert found[0].message.startswith('goal: the point (-1, -1) m is 1.41421 m from the base')


def test_known_failures_are_the_cells_without_a_task() -> None:
    study = over('korayem_rigid', {'start_x': [-1.2, 0.0, 0.5], 'duration': [1.0, 2.0],
                                   'goal_y': [-0.5, math.sqrt(0.75), 1.0]})
    refused = []
    for index in product(*map(range, study.shape)):
        try:
            study.task(index)
        except (UnreachableError, SingularError) as error:
            refused.append((index, str(error)))
    assert [(result.index, result.message) for result in study.known_failures()] == refused
    assert {text.split()[2] for _, text in refused} == {'point', 'arm'}  # too far, singular
    assert len(refused) == 16


def test_known_failures_of_a_block_are_those_inside() -> None:
    study = load_study(EXAMPLES / 'payload_map_rigid.yaml')
    block = (slice(5, 10), slice(0, 5))
    inside = [result.index for result in study.known_failures()
              if 5 <= result.index[0] < 10 and result.index[1] < 5]
    assert [result.index for result in study.known_failures(block)] == inside
    assert inside


def test_limit_of_a_joint_makes_a_cell_unreachable(tmp_path: Path) -> None:
    arm = yaml.safe_load(
        (EXAMPLES.parent / 'arms' / 'korayem_rigid.yaml').read_text())
    arm['joints'][0] |= {'lower_limit': -3.0, 'upper_limit': 1.2}
    study = study_of(tmp_path, {**SEARCH, 'arm': arm, 'axes': {'goal_y': [-0.2, 0.2]}})
    (failure,) = study.known_failures()
    assert failure.index == (1,)
    assert failure.code is CellCode.UNREACHABLE
    assert failure.message.startswith('goal: joint 1 would have to be at')


def test_postures_change_steadily_but_for_the_line_half_a_turn_away() -> None:
    grid = np.linspace(-0.98, 0.98, 50).tolist()
    study = over('korayem_rigid', {'goal_x': grid, 'goal_y': grid}, goal=End(name='goal'))
    all_tasks, cut = tasks(study), []
    for (i, j), task in all_tasks.items():
        for neighbour in ((i + 1, j), (i, j + 1)):
            other = all_tasks.get(neighbour, task)
            jump = float(np.abs(task.goal_positions - other.goal_positions).max())
            # of 4 cm; most near the folded arm, where a step turns it by a radian or so
            assert jump < 1.6 or abs(jump - 2 * np.pi) < 1.6
            assert are_close(task, other) == (jump < np.pi)
            cut += [task] if jump > np.pi else []
    turns = [abs(task.goal_positions[0] - task.start_positions[0]) for task in cut]
    assert 0 < len(cut) < 50
    assert min(turns) > np.pi - 1.6


@pytest.mark.parametrize('y', [0.0, 0.1])
def test_half_turn_is_no_border_inside_a_grid_of_starts(y: float) -> None:
    study = over('korayem_rigid', {'start_x': np.linspace(-0.8, -0.4, 9).tolist(),
                                   'start_y': np.linspace(-0.8, 0.8, 33).tolist()},
                 start=End(name='start'), goal=End(name='goal', point=(-0.5, y)))
    found = tasks(study)
    angles = np.array([task.start_positions[0] for task in found.values()])
    assert angles.min() < -np.pi < angles.max()
    for (i, j), task in found.items():
        assert are_close(task, found.get((i + 1, j), task))
        assert are_close(task, found.get((i, j + 1), task))


def test_angles_may_be_given_instead_of_points(tmp_path: Path) -> None:
    content = {key: value for key, value in SEARCH.items() if key != 'start'}
    study = study_of(tmp_path, {**content, 'start_angles': [7.0, -2.0]})
    task = study.task((1,))
    assert task.start_positions.tolist() == [7.0, -2.0]
    assert abs(task.goal_positions[0] - 7.0) < np.pi


def test_start_is_counted_from_goal_angles() -> None:
    study = over('korayem_rigid', {'start_y': [0.0, 0.1]}, goal=End(name='goal', angles=[7.0, -1]))
    assert abs(study.task((0,)).start_positions[0] - 7.0) < np.pi


def test_with_three_links_only_the_distance_is_known_beforehand(
        postures: list[Mapping[str, float]]) -> None:
    grid = np.linspace(-1.6, 1.6, 40).tolist()
    study = over('three_links', {'goal_x': grid, 'goal_y': grid}, goal=End(name='goal'))
    postures.clear()
    found = {result.index for result in study.known_failures()}
    # it costs an iteration where the goal is within reach, and is looked for at none of these
    assert len(postures) == len(found)
    assert found == {(i, j) for i, x in enumerate(grid) for j, y in enumerate(grid)
                     if math.hypot(x, y) > 1.5}


def test_study_travels_light() -> None:
    study = load_study(EXAMPLES / 'payload_map_one_mode.yaml')
    packed = pickle.dumps(study)
    again = pickle.loads(packed)
    assert len(packed) < 10_000
    assert (again.name, again.shape, again.text) == (study.name, study.shape, study.text)
    assert again.task((20, 30)).goal_positions.tolist() == study.task(
        (20, 30)).goal_positions.tolist()


def test_arm_file_lies_relative_to_the_study(tmp_path: Path) -> None:
    (tmp_path / 'arms').mkdir()
    (tmp_path / 'arms' / 'mine.yaml').write_text(
        (EXAMPLES.parent / 'arms' / 'korayem_rigid.yaml').read_text())
    assert study_of(tmp_path, {**SEARCH, 'arm': 'arms/mine.yaml'}).arm.n_modes == 0


@given(shape=some.lists(some.integers(1, 60), min_size=1, max_size=4).map(tuple))
def test_tiles_are_small_and_at_least_four(shape: tuple[int, ...]) -> None:
    sides = tiles(shape)
    count = math.prod(-(-n // side) for n, side in zip(shape, sides, strict=True))
    assert all(1 <= side <= n for side, n in zip(sides, shape, strict=True))
    assert count >= min(4, math.prod(shape))
    assert math.prod(sides) <= 49
    assert sum(side > 1 for side in sides) <= 2


@pytest.mark.parametrize(('shape', 'sides'), [
    ((40, 40), (5, 5)), ((41, 40), (6, 5)), ((40,), (10,)), ((3,), (1,)), ((3, 200), (3, 8)),
    ((10, 2, 30), (5, 1, 5)), ((1, 1), (1, 1))])
def test_tiles_are_as_square_as_can_be(shape: tuple[int, ...], sides: tuple[int, ...]) -> None:
    assert tiles(shape) == sides


@pytest.mark.parametrize(('place', 'value', 'message'), MISTAKES)
def test_mistake_is_named_by_its_path_in_the_file(tmp_path: Path, place: str, value: object,
                                                  message: str) -> None:
    with pytest.raises(StudyError) as caught:
        study_of(tmp_path, changed(place, value))
    assert str(caught.value).startswith(f'{tmp_path / "study.yaml"}: {message}')
    assert isinstance(caught.value, FlexPlannerError)


@pytest.mark.parametrize(('changes', 'message'), SENSELESS)
def test_senseless_combination_is_refused_with_the_reason(
        tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    content = {key: value for key, value in {**SEARCH, **changes}.items() if value is not REMOVE}
    with pytest.raises(StudyError, match=message):
        study_of(tmp_path, content)


@pytest.mark.parametrize('text', ['', '3', 'name: [1', 'a: !!python/object:os.system {}',
                                  'name: a\nname: b', '#' * 1_000_001])
def test_file_that_is_no_plain_yaml_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(StudyError, match='study.yaml: '):
        study_of(tmp_path, text)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match='nowhere.yaml: cannot be read'):
        load_study(tmp_path / 'nowhere.yaml')


def test_blocks_have_a_size_an_axis() -> None:
    with pytest.raises(InvalidValueError, match=r'block is \[2, 2\], but must be 1 sizes'):
        over('korayem_rigid', {'goal_x': [0.1, 0.2]}, block_shape=(2, 2))


def test_quantities_have_units_and_names_for_files() -> None:
    assert {(quantity.key, quantity.unit) for quantity in Quantity} == {
        ('max_payload', 'kg'), ('min_effort', 'N^2 m^2 s'), ('min_duration', 's'),
        ('residual_vibration', 'm')}


def test_one_compiled_model_does_for_every_cell() -> None:
    study = over('korayem_ei50', {'stiffness_scale': [0.5], 'motor_scale': [1.5]}, duration=0.8)
    task = study.task((0, 0))
    shared, own = (plan_path(task, model=ArmModel(arm)) for arm in (study.arm, task.arm))
    assert shared.solved
    assert shared.cost == own.cost
    assert shared.certificate.tip_error == own.certificate.tip_error
    assert shared.saturation.tolist() == own.saturation.tolist()
    assert shared.cost != plan_path(replace(task, arm=study.arm)).cost


@pytest.mark.parametrize(('place', 'value', 'message'), [
    ('goal', [math.inf, 0.5], 'goal is inf'),  # also where an axis gives that coordinate
    ('goal', [1e308, 0.5], 'goal is 1e+308, but must be a number >= -1000 and <= 1000 m'),
    ('axes/goal_x', {'from': -1e308, 'to': 1e308, 'count': 5}, 'axes.goal_x.from is -1e+308'),
    ('axes/payload_mass', {'from': 0, 'to': 1e308, 'count': 5}, 'axes.payload_mass.to is 1e+308'),
    ('duration', 1e-300, 'duration is 1e-300, but must be a number >= 1e-09 s'),
    ('effort_weights', [1e-300, 1.0], 'effort_weights[0] is 1e-300'),
    ('settling', 5e-324, 'settling is 5e-324, but must be a number >= 0.001'),
    ('mismatch/payload_mass', 1e308, 'mismatch.payload_mass is 1e+308')])
def test_extreme_number_is_named_with_its_range(tmp_path: Path, place: str, value: object,
                                                message: str) -> None:
    with pytest.raises(StudyError) as caught:
        study_of(tmp_path, changed(place, value))
    assert message in str(caught.value)


def test_study_and_its_arm_are_found_below_the_home_folder(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('HOME', str(tmp_path))
    (tmp_path / 'arm').write_bytes(preset_files()['korayem_ei50'].read_bytes())
    for arm in ('~/arm', './arm', 'arm'):
        study_of(tmp_path, changed('arm', arm))
        assert load_study('~/study.yaml').arm.name == load_arm('korayem_ei50').name
    with pytest.raises(StudyError, match="no home folder of a user 'no-such-user'"):
        study_of(tmp_path, changed('arm', '~no-such-user/arm.yaml'))


def test_study_comes_through_a_pipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    reader, writer = os.pipe()
    os.write(writer, yaml.safe_dump(COMPLETE).encode())
    os.close(writer)
    try:
        assert load_study(f'/dev/fd/{reader}').name == 'a map'
    finally:
        os.close(reader)


@pytest.mark.parametrize('text', ['duration: 010', 'duration: 1:30', 'duration: 1_0'])
def test_number_that_could_be_misread_is_refused(tmp_path: Path, text: str) -> None:
    content = yaml.safe_dump(changed('duration', REMOVE))
    file = tmp_path / 'study.yaml'
    file.write_text(f'{content}{text}\n')
    with pytest.raises(StudyError, match=r'cannot be read: line \d+, column 11: .* must be'):
        load_study(file)
