"""Blocks of a map: every cell gets its answer or its reason, whatever its neighbours are."""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path

from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.maps import block_solver
from flex_planner.maps.block_solver import blocks, solve_block
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.cell_solver import CellSolver
from flex_planner.maps.study import load_study, Study
from flex_planner.planning.plan_path import plan_path
from flex_planner.simulation.comparison import compare
from flex_planner.simulation.execution import ExecutionMode
from flex_planner.simulation.mismatch import Mismatch
import pytest

PAYLOAD = """
name: payloads
arm: korayem_rigid
quantity: max_payload
start: [0.5, 0.0]
duration: 1.0
effort_weights: [0.125, 0.125]
axes: {goal_x: {from: 0.40, to: 0.43, count: 2}, goal_y: {from: 0.40, to: 0.46, count: 4}}
block: {goal_x: 2, goal_y: 4}
"""


def study_of(folder: Path, text: str = PAYLOAD, **changes: str) -> Study:
    """Return a study from a text in which some lines are replaced."""
    lines = [line for line in text.strip().splitlines()
             if line.partition(':')[0] not in changes]
    path = folder / 'study.yaml'
    path.write_text('\n'.join([*lines, *(f'{key}: {value}' for key, value in changes.items()
                                         if value)]))
    return load_study(path)


def whole(study: Study) -> list[CellResult]:
    return sorted((result for block in blocks(study) for result in solve_block(study, block)),
                  key=lambda result: result.index)


def test_blocks_cover_the_grid_once(tmp_path: Path) -> None:
    study = study_of(tmp_path, block='{goal_x: 2, goal_y: 2}',
                     axes='{goal_x: [0.4, 0.43], goal_y: [0.40, 0.42, 0.44, 0.46, 0.48]}')
    cells = [(i, j) for block in blocks(study) for i in range(block[0].start, block[0].stop)
             for j in range(block[1].start, block[1].stop)]
    assert sorted(cells) == [(i, j) for i in range(2) for j in range(5)]
    assert len(blocks(study)) == 3


def test_cells_are_those_found_one_by_one(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    results = whole(study)
    assert [result.index for result in results] == [(i, j) for i in range(2) for j in range(4)]
    for result in results:  # of one kind
        alone = find_max_payload(study.task(result.index), accuracy=study.accuracy, search='fast')
        assert result.code is CellCode.SOLVED
        assert result.value == pytest.approx(alone.payload, abs=study.accuracy)
        assert result.value <= result.bound <= result.value + study.accuracy
        assert result.tip_error < 1e-5
        assert alone.plan is not None
        assert result.cost == pytest.approx(alone.plan.cost, rel=0.05)
        assert result.seconds > 0
    assert [result.warm for result in results] == [False] + 7 * [True]
    along = [result.iterations for result in results if result.index[1] >= 2]
    assert max(along) < results[0].iterations / 2


def test_blocks_know_nothing_of_one_another(tmp_path: Path) -> None:
    study = study_of(tmp_path, block='{goal_x: 1, goal_y: 4}')
    there, back = blocks(study), blocks(study)[::-1]
    first = {r.index: r.value for block in there for r in solve_block(study, block)}
    second = {r.index: r.value for block in back for r in solve_block(study, block)}
    assert first == second


def test_cells_out_of_reach_are_known_and_cost_nothing(tmp_path: Path) -> None:
    study = study_of(tmp_path, axes='{goal_x: [0.4], goal_y: [0.45, 0.48, 1.2, 1.5]}',
                     block='{goal_y: 4}')
    results = whole(study)
    assert [result.code for result in results] == 2 * [CellCode.SOLVED] + 2 * [
        CellCode.UNREACHABLE]
    for result in results[2:]:
        assert 'reach' in result.message
        assert math.isnan(result.value)
        assert (result.iterations, result.seconds, result.warm) == (0, 0.0, False)


def test_cells_that_no_motor_can_do_say_how_long_they_take(tmp_path: Path) -> None:
    study = study_of(tmp_path, duration='0.55',
                     axes='{goal_x: [0.4], goal_y: {from: 0.3, to: 0.6, count: 7}}',
                     block='{goal_y: 7}')
    results = whole(study)
    codes = [result.code for result in results]
    assert set(codes) == {CellCode.SOLVED, CellCode.NOT_FOUND}
    for result in results:
        shortest = find_min_duration(study.task(result.index), search='fast')
        assert (result.code is CellCode.SOLVED) == (shortest.duration < 0.55)
        if result.code is CellCode.NOT_FOUND:
            assert 'the shortest duration found with ' in result.message
            assert '0.55 s were asked for' in result.message
    late = [result.iterations for result in results if result.code is CellCode.NOT_FOUND]
    assert max(late[2:]) < 60


def test_shortest_durations(tmp_path: Path) -> None:
    study = study_of(tmp_path, quantity='min_duration', payload_mass='1.0',
                     axes='{goal_x: [0.4], goal_y: {from: 0.40, to: 0.46, count: 4}}',
                     block='{goal_x: 1, goal_y: 2}')
    for result in whole(study):
        alone = find_min_duration(study.task(result.index), accuracy=study.accuracy,
                                  search='fast')
        assert result.code is CellCode.SOLVED
        assert result.value == pytest.approx(alone.duration, abs=study.accuracy)
        assert result.value - study.accuracy <= result.bound <= result.value


def test_least_efforts_over_stiffness_and_motors(tmp_path: Path) -> None:
    study = study_of(tmp_path, arm='korayem_ei50', modes='1', quantity='min_effort',
                     goal='[0.5, 0.5]', payload_mass='1.0', block='',
                     axes='{stiffness_scale: [0.1, 1.0], motor_scale: [1.0, 2.0]}')
    results = whole(study)
    for result in results:
        alone = plan_path(study.task(result.index))
        assert result.code is CellCode.SOLVED
        assert result.value == pytest.approx(alone.cost, rel=1e-7)
        assert math.isnan(result.bound)
    assert results[0].value == pytest.approx(0.648631579, rel=1e-6)  # E I 5 N m^2, 1 mode
    assert results[2].value == pytest.approx(0.647175044, rel=1e-6)  # E I 50 N m^2, 1 mode


def test_vibration_is_that_of_the_comparison(tmp_path: Path) -> None:
    study = study_of(tmp_path, arm='korayem_ei5', modes='1', quantity='residual_vibration',
                     goal='[0.5, 0.5]', payload_mass='1.0', block='', settling='0.3',
                     mismatch='{rigidity_scale: 0.9}', axes='{payload_scale: [1.0, 1.1]}')
    results = whole(study)
    for result, carried in zip(results, (1.0, 1.1), strict=True):
        expected = compare(study.task(result.index), mismatch=Mismatch(rigidity_scale=0.9),
                           payload_mass=carried, settling=0.3)
        assert result.code is CellCode.SOLVED
        assert result.value == pytest.approx(
            expected.of(ExecutionMode.FLEXIBLE_OPEN).residual.tip, rel=1e-3)
    assert results[1].value > results[0].value > 1e-5


def test_value_out_of_bounds_is_invalid_and_costs_no_other(tmp_path: Path) -> None:
    study = study_of(tmp_path, axes='{goal_x: [0.4], goal_y: [0.45, 0.47]}', block='')
    same = replace(study.task((0, 1)), goal_positions=study.task((0, 1)).start_positions)
    assert same.duration == 1.0

    class Refusing(CellSolver):
        """Finds fault with a cell."""

        def solve(self, index: tuple[int, ...], *args: object) -> object:  # type: ignore
            if index == (0, 0):
                replace(same, duration=-1.0)
            return super().solve(index, *args)  # type: ignore

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(block_solver, 'CellSolver', Refusing)
        first, second = whole(study)
    assert (first.code, second.code) == (CellCode.INVALID, CellCode.SOLVED)
    assert first.message == 'duration is -1.0, but must be a number > 0 and <= 1000 s'


def test_error_of_the_program_is_a_code_with_its_name(tmp_path: Path) -> None:
    study = study_of(tmp_path, axes='{goal_x: [0.4], goal_y: [0.45, 0.47]}', block='')

    class Broken(CellSolver):
        """Fails as programs do."""

        def solve(self, *args: object) -> object:  # type: ignore
            raise ZeroDivisionError('x' * 1000)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(block_solver, 'CellSolver', Broken)
        results = whole(study)
    assert {result.code for result in results} == {CellCode.FAILED}
    assert all(result.message.startswith('ZeroDivisionError: xxx') for result in results)
    assert all(len(result.message) <= 300 for result in results)


def test_cell_that_takes_too_long_is_left(tmp_path: Path) -> None:
    study = study_of(tmp_path, cell_time_limit='1e-6', block='',
                     axes='{goal_x: [0.4], goal_y: [0.45]}')
    (result,) = whole(study)
    assert result.code is CellCode.TIMEOUT
    assert math.isnan(result.value)


def test_canceled_block_leaves_its_cells_pending(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    results = solve_block(study, blocks(study)[0], Monitor(canceled=lambda: True))
    assert {result.code for result in results} == {CellCode.PENDING}


def test_every_code_has_its_meaning() -> None:
    assert len({code.meaning for code in CellCode}) == len(CellCode)
