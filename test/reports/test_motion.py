"""Tables of what came of planning, where they differ from those of a usual success."""

from __future__ import annotations

from typing import Any
from unittest.mock import Mock

from flex_planner.arms.arm import Arm
from flex_planner.capacity.incremental import PayloadTrial
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds.clusters import KindOfMotion
from flex_planner.planning.plan import PlanStatus
from flex_planner.reports.motion import (
    columns,
    joint_rows,
    kind_rows,
    payload_rows,
    planning_row,
    search_table,
)
import pytest


def search(arm: Arm, **found: Any) -> MaxPayload:
    task = Task(arm=arm, start_positions=[0, 1], goal_positions=[1, 1], duration=1.0)
    return MaxPayload(task=task, method=PayloadMethod.DIRECT, message='', **found)


def test_columns_are_as_wide_as_they_need_to_be() -> None:
    assert columns(['a', 'long'], [['1.25', '2']]) == '   a   long\n1.25      2'


def test_joint_without_limits_has_no_shares() -> None:
    assert joint_rows([1.0], [0.0], [2.0], [0.0]) == [
        ('joint 1', 'peak speed 1.000 rad/s, peak torque 2.000 N m')]


def test_planning_that_got_nowhere_names_no_strategy() -> None:
    assert planning_row(0.5, '', '3 iterations') == ('planned in', '0.50 s (3 iterations)')


@pytest.mark.parametrize(('met', 'words'), [(1, '(met once)'), (3, '(met 3 times)')])
def test_kind_says_how_often_it_was_met(met: int, words: str) -> None:
    kind = KindOfMotion(value=2.0, sentence='straight', met=met, motion=Mock())
    assert kind_rows([kind], 16, '', ' kg') == [
        ('kinds of motion', '1 found from 16 starts'), ('  kind 1', f'2 kg: straight {words}')]


def test_failed_search_has_no_bracket(rigid_arm: Arm) -> None:
    found = search(rigid_arm, status=PlanStatus.TIMEOUT)
    assert dict(payload_rows(found))['largest payload'] == 'none found'
    assert search_table(found) == ''


def test_search_that_did_not_end_says_what_was_tried(rigid_arm: Arm) -> None:
    found = search(rigid_arm, status=PlanStatus.NOT_CONVERGED, payload=2.0, local_upper=3.0,
                   trials=(PayloadTrial(payload=3.0, step=1.0, solved=False, boundary_error=1.0,
                                        result=None),))
    assert dict(payload_rows(found))['largest payload'] == '2 kg; no solution at 3 kg'


def test_motor_that_can_hold_no_more_is_told(rigid_arm: Arm) -> None:
    found = search(rigid_arm, status=PlanStatus.SOLVED, payload=2.0, local_upper=2.0001, held=True,
                   limiting_joint=1)
    rows = dict(payload_rows(found))
    assert rows['limited by'] == 'the motor of joint 2, which can hold no more at the goal'


@pytest.mark.parametrize(('shares', 'row'), [
    ([0.0, 0.0], None), ([0.25, 0.0], 'the motor of joint 1, on its limit for 25.0% of the time')])
def test_motor_that_never_is_on_its_limit_limits_nothing(rigid_arm: Arm, shares: list[float],
                                                         row: str | None) -> None:
    found = search(rigid_arm, status=PlanStatus.TIMEOUT, payload=0.1, limiting_joint=0,
                   plan=Mock(saturation=shares, solution=None, warnings=()))
    assert dict(payload_rows(found)).get('limited by') == row
