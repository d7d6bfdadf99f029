"""What must not bring the planner node down, in a process of its own."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator
import os
import signal
from typing import Any

from flex_planner_interfaces.msg import FlexibleTrajectory, MotionTask, PlanReport
import pytest
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters
from ros_support import LONG, Planner, SUPPORT
from trajectory_msgs.msg import JointTrajectory

QUEUE = 8
BIG = array('d', [1.0]) * 10**6


class FaultyPlanner(Planner):
    """The node of test/support/faulty_planner.py."""

    module = 'faulty_planner'


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    folder = tmp_path_factory.mktemp('robust')
    paths = [str(SUPPORT), os.environ.get('PYTHONPATH', '')]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('PYTHONPATH', os.pathsep.join(paths))
        planner = FaultyPlanner(folder, 'korayem_rigid', record=False, queue_length=QUEUE)
    with planner:
        yield planner
        assert planner.process.process.poll() is None


def check_that_it_serves(planner: Planner) -> None:
    report = planner.report()
    assert (report.error_code, report.error_msg) == (PlanReport.NONE, '')


def test_hundred_requests_at_once_are_all_answered(planner: Planner) -> None:
    check_that_it_serves(planner)
    futures = [planner.send_plan(payload_mass=0.01 * k) for k in range(100)]
    planner.wait('all answers', lambda: all(future.done() for future in futures))
    codes = Counter(future.result().report.error_code for future in futures)
    assert set(codes) == {PlanReport.NONE, PlanReport.BUSY}
    assert codes[PlanReport.NONE] >= QUEUE
    solved = [future.result().trajectory.payload_mass for future in futures
              if future.result().report.error_code == PlanReport.NONE]
    assert solved == sorted(solved)


def test_hundred_goals_in_a_row_all_end(planner: Planner) -> None:
    goals = [planner.plan_goal(payload_mass=0.01 * k) for k in range(100)]
    codes = Counter(goal.end()[1].report.error_code for goal in goals)
    assert set(codes) <= {PlanReport.NONE, PlanReport.BUSY}
    assert codes[PlanReport.NONE] >= QUEUE
    check_that_it_serves(planner)


@pytest.mark.parametrize(('fields', 'sentence'), [
    ({'payload_mass': 13.0}, 'ZeroDivisionError: while planning'),
    ({'payload_mass': 17.0}, 'MemoryError'),
    ({'duration': 2.0, 'publish': True}, "KeyError: 'while publishing'"),
], ids=str)
def test_exception_that_nobody_foresaw_is_an_answer(planner: Planner, fields: dict[str, Any],
                                                    sentence: str) -> None:
    answer = planner.plan(**fields)
    assert answer.report.error_code == PlanReport.UNKNOWN
    assert sentence in answer.report.error_msg
    assert answer.trajectory == FlexibleTrajectory()
    result = planner.plan_goal(**fields).end()[1]
    assert result.report.error_code == PlanReport.UNKNOWN
    check_that_it_serves(planner)


def test_exception_while_publishing_publishes_nothing(planner: Planner) -> None:
    before = planner.plan(publish=True).trajectory
    assert planner.report(duration=2.0, publish=True).error_code == PlanReport.UNKNOWN
    name = f'{planner.name}/joint_trajectory'
    assert planner.latched(JointTrajectory, name) == before.joint_trajectory


@pytest.mark.parametrize('field', ['effort_weights', 'max_joint_speeds'])
def test_million_numbers_are_refused(planner: Planner, field: str) -> None:
    fields = {'space': MotionTask.JOINT, 'start_positions': [0.0, 1.0],
              'goal_positions': [0.5, 0.7], field: BIG}
    report = planner.report(**fields)
    assert report.error_code == PlanReport.INVALID_SIZE
    assert report.error_msg.startswith(field)
    assert len(report.error_msg) < 300


@pytest.mark.parametrize('wrong', [
    Parameter(name='tolerance', value=ParameterValue(type=99)),
    Parameter(name='tolerance', value=ParameterValue(type=0)),
    Parameter(name='tolerance', value=ParameterValue(type=8, double_array_value=BIG)),
    Parameter(name='no_such_parameter', value=ParameterValue(type=4, string_value='x' * 10**6)),
], ids=['type 99', 'type 0', 'a million numbers', 'unknown'])
def test_parameter_that_makes_no_sense_changes_nothing(planner: Planner, wrong: Parameter) -> None:
    future = planner.send(SetParameters, f'{planner.name}/set_parameters',
                          SetParameters.Request(parameters=[wrong]))
    assert planner.parameter('tolerance') == 1e-3
    assert not future.done() or not future.result().results[0].successful
    check_that_it_serves(planner)


@pytest.fixture(scope='module')
def flooded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[signal.Signals, Planner]]:
    """Start both nodes that will be ended at once."""
    folders = [tmp_path_factory.mktemp('flooded') for _ in range(2)]
    with Planner(folders[0], 'korayem_ei50', 'flooded_int') as first, \
            Planner(folders[1], 'korayem_ei50', 'flooded_term') as second:
        yield {signal.SIGINT: first, signal.SIGTERM: second}


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_node_ends_in_good_order_while_requests_pour_in(
        flooded: dict[signal.Signals, Planner], number: signal.Signals) -> None:
    planner = flooded[number]
    planner.plan(duration=-1.0)
    planner.plan_goal(duration=-1.0).end()
    planner.send_plan(**LONG)
    planner.spin(0.3)  # it is at work from here on
    for _ in range(20):
        planner.send_plan(**LONG)
        planner.send_search(**LONG)
    planner.plan_goal(**LONG)
    assert planner.stop(number) == 0
    assert 'Traceback' not in planner.log()
    assert not list(planner.recordings.glob('.*'))
