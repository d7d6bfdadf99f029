"""Limits on the way in studies, the same for all cells or of a number that an axis gives."""

from __future__ import annotations

from pathlib import Path

from flex_planner.maps.block_solver import blocks, solve_block
from flex_planner.maps.cell_results import CellCode, CellResult
from flex_planner.maps.study import load_study, Study, StudyError
from flex_planner.optimal_control.path_constraints import Circle, JointSpeed, KeepOut
from flex_planner.planning.plan_path import plan_path
import pytest

STUDY = """
name: round a post
arm: korayem_rigid
quantity: {quantity}
start: [0.5, 0.0]
goal: [0.5, 0.5]
duration: 1.0
payload_mass: 1.0
effort_weights: [0.125, 0.125]
limits: {limits}
axes: {axes}
"""
POST = "['keep_out:0.52,0.25,VALUE;name=post', 'joint_speed:2,5']"


def study_of(folder: Path, *, limits: str = POST, axes: str = '{limit_value: [0.02, 0.1, 0.4]}',
             quantity: str = 'min_effort') -> Study:
    path = folder / 'study.yaml'
    path.write_text(STUDY.format(limits=limits, axes=axes, quantity=quantity))
    return load_study(path)


def solved(study: Study) -> list[CellResult]:
    return [result for block in blocks(study) for result in solve_block(study, block)]


def test_axis_gives_a_number_of_a_limit(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    assert study.task((1,)).path_constraints == (
        KeepOut(region=Circle(center=(0.52, 0.25), radius=0.1), name='post'),
        JointSpeed(joint=2, limit=5.0))
    assert not study.keeps_motions  # a request without the post would take the detour, too
    inside, detour, impossible = solved(study)
    assert inside.value == pytest.approx(plan_path(study.task((0,)), search='fast').cost, rel=1e-4)
    # the paper's arm without limits, and by IPOPT with them, see docs/path_constraints.md
    assert inside.value == pytest.approx(0.646813, rel=1e-5)
    assert detour.value == pytest.approx(0.81848, rel=1e-4)
    assert impossible.code is CellCode.INFEASIBLE
    assert 'start breaks a limit' in impossible.message


def test_searches_keep_the_limits_of_a_study(tmp_path: Path) -> None:
    (found,) = solved(study_of(tmp_path, quantity='max_payload', axes='{motor_scale: [1.0]}',
                               limits="['joint_speed:1,0.8', 'joint_speed:2,0.9']"))
    # 4.536 kg is where it ends, of which a little less can be certified; without, it is 5.855 kg
    carried = found.value if found.code is CellCode.SOLVED else float(found.message.split()[0])
    assert carried == pytest.approx(4.536, abs=3e-3)


@pytest.mark.parametrize(('limits', 'axes', 'message'), [
    ("['keep_out:1']", '{motor_scale: [1.0]}', r'limits\[0\] is .keep_out:1.*with 3 numbers'),
    ("['joint_speed:3,1']", '{motor_scale: [1.0]}', r'limits\[0\].joint is 3'),
    ('3', '{motor_scale: [1.0]}', 'limits is 3, but must be a list of texts'),
    ("['joint_speed:1,2', 5]", '{motor_scale: [1.0]}', 'limits is .* a list of texts'),
    (POST, '{motor_scale: [1.0]}', 'limits is .* without VALUE, or the axis limit_value given'),
    ("['joint_speed:1,2']", '{limit_value: [1.0]}', 'axes.limit_value is .* no limit has VALUE'),
    (POST, '{limit_value: [-0.1]}', r'limits\[0\] \(keep_out\) radius is -0.1')])
def test_mistakes_in_limits_are_named(limits: str, axes: str, message: str,
                                      tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=message):
        study_of(tmp_path, limits=limits, axes=axes)


def test_value_that_makes_no_limit_is_invalid_in_its_cell(tmp_path: Path) -> None:
    study = study_of(tmp_path, limits="['joint_range:2,VALUE,-1']",
                     axes='{limit_value: [-3.0, 0.5]}')
    codes = [result.code for result in solved(study)]
    assert codes == [CellCode.SOLVED, CellCode.INVALID]
