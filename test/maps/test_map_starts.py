"""Motions that a map keeps, and who starts from them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from factories import TaskFactory
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.maps.block_solver import blocks, solve_block
from flex_planner.maps.cell_results import CellCode
from flex_planner.maps.kept_motions import distances, KeptMotion, signature, signature_fields
from flex_planner.maps.map_starts import MapStarts
from flex_planner.maps.store import MapStore, MapStoreError
from flex_planner.maps.study import load_study, StudyError
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import postures_from_points, Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.strategies.initial_guesses import WARM_START
from map_support import filled, STUDY
import numpy as np
import pytest
import xarray as xr


@pytest.fixture(scope='module')
def payloads(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return filled(tmp_path_factory.mktemp('payloads'))[1]


@pytest.fixture(scope='module')
def efforts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return filled(tmp_path_factory.mktemp('efforts'), 'min_effort', more='payload_mass: 1\n')[1]


def task_to(arm: Arm, x: float, y: float, **changes: Any) -> Task:
    start, goal = postures_from_points(arm, (0.5, 0.0), (x, y), elbow=-1)
    return Task(arm=arm, start_positions=start, goal_positions=goal, **{
        'duration': 1.0, 'effort_weights': [0.125, 0.125], **changes})


def test_search_near_a_cell_starts_there_and_finds_the_same(payloads: Path, rigid_arm: Arm,
                                                            rigid_model: ArmModel) -> None:
    task = task_to(rigid_arm, 0.49, 0.49)
    cell = MapStarts(payloads, rigid_arm).near(task, searched=True)
    assert cell is not None
    assert cell.place == 'goal_x = 0.5 m, goal_y = 0.5 m of map.zarr'
    cold = find_max_payload(task, model=rigid_model)
    warm = find_max_payload(task, model=rigid_model, start_from=cell.motion.start())
    assert warm.warm
    assert not cold.warm
    assert warm.payload == pytest.approx(cold.payload, abs=1e-3)
    assert warm.iterations < cold.iterations / 2


def test_plan_near_a_cell_starts_there_and_is_the_same(efforts: Path, rigid_arm: Arm,
                                                       rigid_model: ArmModel) -> None:
    task = task_to(rigid_arm, 0.41, 0.46, payload_mass=1.05)
    cell = MapStarts(efforts, rigid_arm).near(task)
    assert cell is not None
    assert cell.place.startswith('goal_x = 0.4 m, goal_y = 0.45 m')
    plan = plan_path(task, model=rigid_model, start_from=cell.motion.solution())
    assert plan.strategy == WARM_START
    assert plan.cost == pytest.approx(plan_path(task, model=rigid_model).cost, rel=1e-6)


@pytest.mark.parametrize('changes', [
    {'duration': 1.2}, {'payload_mass': 1.5}, {'payload_inertia': 0.1},
    {'velocity_weights': [1.0, 0.0]}, {'position_weights': [1.0, 0.0]},
    {'effort_weights': [0.125, 0.5]}])
def test_task_that_differs_in_anything_is_not_near(efforts: Path, rigid_arm: Arm,
                                                   changes: dict[str, Any]) -> None:
    starts = MapStarts(efforts, rigid_arm)
    assert starts.near(task_to(rigid_arm, 0.4, 0.45, payload_mass=1.0)) is not None
    assert starts.near(task_to(rigid_arm, 0.4, 0.45, **{'payload_mass': 1.0, **changes})) is None


def test_goal_or_start_elsewhere_is_not_near(efforts: Path, rigid_arm: Arm) -> None:
    starts, near = MapStarts(efforts, rigid_arm), task_to(rigid_arm, 0.4, 0.45, payload_mass=1.0)
    assert starts.near(task_to(rigid_arm, -0.4, 0.45, payload_mass=1.0)) is None
    turned = near.start_positions + [0.25, 0.0]
    assert starts.near(replace(near, start_positions=turned)) is None


def test_payload_and_weights_do_not_matter_to_a_search(payloads: Path, rigid_arm: Arm) -> None:
    starts = MapStarts(payloads, rigid_arm)
    asked = task_to(rigid_arm, 0.5, 0.5, payload_mass=3.0, velocity_weights=[100.0, 100.0])
    assert starts.near(asked, searched=True) is not None
    assert starts.near(replace(asked, duration=2.0), searched=True) is None


def test_maps_of_payloads_serve_searches_and_others_plans(payloads: Path, efforts: Path,
                                                          rigid_arm: Arm) -> None:
    task = task_to(rigid_arm, 0.5, 0.5, payload_mass=1.0)
    assert MapStarts(payloads, rigid_arm).near(task) is None
    assert MapStarts(efforts, rigid_arm).near(task, searched=True) is None


def test_cells_that_failed_are_no_starts(payloads: Path, rigid_arm: Arm) -> None:
    assert len(MapStarts(payloads, rigid_arm)) == 4


def test_xarray_reads_the_map_as_if_there_were_no_motions(payloads: Path) -> None:
    opened = xr.open_zarr(payloads, chunks=None)
    assert set(opened.sizes) == {'goal_x', 'goal_y'}
    assert (opened.code == CellCode.SOLVED).sum() == 4


def test_motion_is_packed_and_unpacked_to_single_precision(
        ei5_model: ArmModel, paper_task: TaskFactory) -> None:
    task = paper_task(ei5_model.arm)
    plan = plan_path(task, model=ei5_model)
    assert plan.solution is not None
    kept = KeptMotion.of(plan.problem, plan.solution, 2.5)
    again = KeptMotion.unpack(kept.signature, kept.pack())
    assert len(kept.pack()) % 4 == 0
    assert (again.payload, again.price) == (1.0, 2.5)
    assert again.mesh == pytest.approx(plan.solution.mesh, rel=1e-6)
    scale = np.abs(plan.solution.nodes).max(axis=0)
    assert np.abs(again.nodes - plan.solution.nodes).max(axis=0) == pytest.approx(0 * scale,
                                                                                  abs=1e-6)


def test_nodes_too_close_for_single_precision_become_one(ei5_model: ArmModel,
                                                         paper_task: TaskFactory) -> None:
    problem = MotionProblem(ei5_model, paper_task(ei5_model.arm),
                            task_parameters(paper_task(ei5_model.arm)))
    mesh = np.array([0.0, 0.5, 0.5 + 1e-10, 1.0])
    kept = KeptMotion(signature=signature(problem.task), payload=1.0, price=0.0, mesh=mesh,
                      nodes=np.zeros((4, problem.size)))
    assert KeptMotion.unpack(kept.signature, kept.pack()).mesh.tolist() == [0.0, 0.5, 1.0]


def test_signature_has_a_name_for_every_entry(ei50_arm: Arm, paper_task: TaskFactory) -> None:
    task = paper_task(ei50_arm, 1.25, 3.0)
    names, values = signature_fields(task), signature(task)
    assert len(names) == values.size

    def of(name: str) -> list[float]:
        return [value for entry, value in zip(names, values, strict=True) if entry == name]

    assert of('payload_mass') == [1.25]
    assert of('duration') == [1.0]
    assert of('goal_positions') == task.goal_positions.tolist()
    assert of('velocity_weights') == [3.0, 3.0, 0.0, 0.0, 0.0, 0.0]
    assert of('rigidity') == [50.0, 50.0]
    assert of('stall_torque') == [8.0, 8.0]


def test_infinite_limits_are_equal_to_themselves_and_far_from_others() -> None:
    names, own = ['stall_torque'], np.array([np.inf])
    apart = distances(np.array([[np.inf], [8.0], [np.nan]]), own, names, searched=True)
    assert apart.tolist() == [0.0, np.inf, np.inf]


@pytest.mark.parametrize(('quantity', 'more'), [
    ('max_payload', 'keep_motions: false\n'), ('min_duration', '')])
def test_map_without_motions_is_no_start(tmp_path: Path, rigid_arm: Arm, quantity: str,
                                         more: str) -> None:
    text = STUDY.format(quantity=quantity, arm='korayem_rigid') + more
    if quantity == 'min_duration':
        text = text.replace('[0.45, 0.5, 1.5]', '[0.5]').replace('goal_y: 3', 'goal_y: 1')
    (tmp_path / 'study.yaml').write_text(text)
    study = load_study(tmp_path / 'study.yaml')
    with MapStore.of(tmp_path / 'map.zarr', study) as store:
        results = solve_block(study, blocks(study)[0])
        assert {result.motion for result in results} == {None}
        store.write(blocks(study)[0], results)
    with pytest.raises(MapStoreError, match=r'map\.zarr keeps no motions to start from'):
        MapStarts(tmp_path / 'map.zarr', rigid_arm)


def test_map_of_another_arm_is_refused_saying_what_differs(payloads: Path, rigid_arm: Arm) -> None:
    with pytest.raises(MapStoreError, match='is of another arm .*: links differ from those of'):
        MapStarts(payloads, load_arm('korayem_ei50'))
    MapStarts(payloads, replace(rigid_arm, name='the same under another name'))


def test_keep_motions_is_true_or_false(tmp_path: Path) -> None:
    (tmp_path / 'study.yaml').write_text(STUDY.format(quantity='max_payload', arm='korayem_rigid')
                                         + 'keep_motions: 1\n')
    with pytest.raises(StudyError, match='keep_motions is 1, but must be true or false'):
        load_study(tmp_path / 'study.yaml')
