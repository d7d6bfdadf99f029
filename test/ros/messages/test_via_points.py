"""Via points in messages, and on the command line, which writes the same messages."""

from __future__ import annotations

import argparse
from dataclasses import replace
import math
from typing import Any

from flex_planner.base.errors import InvalidValueError
from flex_planner.cli.request import Request, translate_errors
from flex_planner.cli.via_options import add_via_points, via_points
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.paper.cases import paper_arm, point_to_point
from flex_planner.planning.plan_path import plan_path
from flex_planner.ros.messages.classes import MotionTask, Point
from flex_planner.ros.messages.plans import report_from_plan, task_from_message
from flex_planner.ros.messages.via_points import fill_via_points, via_points_from_message
from flex_planner.ros.settings.planner import PlannerSettings
import numpy as np
import pytest

ARM = paper_arm(math.inf)
VIAS = (ViaPoint(point=[0.55, 0.2]), ViaPoint(positions=[math.nan, -2.0], time=0.6),
        ViaPoint(positions=[1.4, -1.95], time=0.7))


def same(one: ViaPoint, other: ViaPoint) -> bool:
    return (one.time == other.time and np.array_equal(one.point, other.point)
            and np.array_equal(one.positions, other.positions, equal_nan=True))


def test_via_points_survive_a_message() -> None:
    message = MotionTask()
    fill_via_points(message, replace(point_to_point(ARM, 1.0), via_points=VIAS))
    assert list(message.via_times) == [0.0, 0.6, 0.7]
    found = via_points_from_message(message, ARM)
    assert all(same(one, other) for one, other in zip(found, VIAS, strict=True))
    fill_via_points(message := MotionTask(), point_to_point(ARM, 1.0))
    assert via_points_from_message(message, ARM) == ()


@pytest.mark.parametrize(('fields', 'sentence'), [
    ({'via_times': [0.5]}, 'via_times is .* empty where'),
    ({'via_times': [0.5], 'via_positions': [1.0]}, 'via_positions has 1 entries'),
    ({'via_positions': [1.0, 2.0]}, 'via_positions has 2 entries'),
    ({'via_times': [0.5, 0.6], 'via_points': [Point()]}, 'via_points has 1 entries'),
    ({'via_times': [-0.5], 'via_points': [Point(x=0.5)]}, r'via_times\[0\] is -0.5'),
    ({'via_times': [math.nan], 'via_points': [Point(x=0.5)]}, r'via_times\[0\] is nan'),
    ({'via_times': [0.5] * 101, 'via_points': [Point()] * 101}, 'at most 100')])
def test_bad_via_points_are_refused_by_name(fields: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InvalidValueError, match=sentence):
        via_points_from_message(MotionTask(**fields), ARM)


def test_a_request_is_planned_and_its_report_says_when_via_points_are_passed() -> None:
    message = MotionTask(start_positions=[1.047, -2.094], goal_positions=[1.571, -1.571],
                         duration=1.0, payload_mass=1.0, via_times=[0.0],
                         via_points=[Point(x=0.55, y=0.2)])
    task = task_from_message(message, ARM, PlannerSettings.for_arm(ARM))
    report = report_from_plan(plan_path(task))
    assert report.error_code == 0, report.error_msg
    assert 0.3 < report.via_times[0] < 0.6
    assert 0 < report.via_error < 1e-6


def options(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_via_points(parser)
    return parser.parse_args(arguments)


def test_options_keep_the_order_of_via_points_of_both_kinds() -> None:
    given = options('--via', '0.55,0.2', '--via-angles', '0.6:any,-114.5915590261646', '--via',
                    '0.7:0.5,0.3').via_points
    first, second, third = via_points(given, ARM)
    assert same(first, VIAS[0])
    assert second.positions == pytest.approx([math.nan, -2.0], nan_ok=True)
    assert (second.time, third.time) == (0.6, 0.7)
    assert options().via_points == []
    assert options('--via', '1,0').via_points != options().via_points == []


@pytest.mark.parametrize(('option', 'text', 'sentence'), [
    ('--via', 'x:1,2', "--via is 'x:1,2', but must be a time, a colon and numbers"),
    ('--via', '-1:1,2', 'a time > 0 s before the colon'),
    ('--via', '1,2,3', '--via has 3 numbers'),
    ('--via-angles', '0.5:1', '--via-angles has 1 number'),
    ('--via-angles', '0.5:a,1', 'numbers separated by commas')])
def test_bad_options_are_refused_by_name(option: str, text: str, sentence: str) -> None:
    with pytest.raises(InvalidValueError, match=sentence):
        via_points([(option, text)], ARM)


@pytest.mark.parametrize(('via', 'sentence'), [
    (replace(VIAS[0], time=2.0), 'via point 1 of --via and --via-angles, its time is 2.0'),
    (ViaPoint(positions=[200.0, 1.0]),
     r'via point 1 of --via and --via-angles, angles\[0\] in radians is 200')])
def test_errors_of_the_task_name_options(via: ViaPoint, sentence: str) -> None:
    with pytest.raises(InvalidValueError, match=sentence), translate_errors():
        replace(point_to_point(ARM, 1.0), via_points=[via])


def test_a_request_in_words_counts_its_via_points() -> None:
    task: Task = replace(point_to_point(ARM, 1.0), via_points=VIAS)
    request = Request(task=task, elbow=-1, time_limit=60.0)
    assert 'by 3 via points in 1 s' in str(request)
