"""Diagnostics and markers of the planner node."""

from __future__ import annotations

from collections.abc import Iterator

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from factories import PlanFactory
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.kinematics import link_points
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.ros.messages.markers import motion_markers
from flex_planner.ros.planner.diagnostics import Record, SUBSCRIBERS
from flex_planner_interfaces.msg import PlanReport
import numpy as np
import pytest
from ros_support import LONG, Planner
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import Marker, MarkerArray

OK, WARN = DiagnosticStatus.OK, DiagnosticStatus.WARN


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    folder = tmp_path_factory.mktemp('status')
    with Planner(folder, 'korayem_ei50', record=False, base_frame='shoulder') as planner:
        yield planner
        assert planner.process.process.poll() is None
        assert 'Traceback' not in planner.log()


@pytest.fixture(scope='module')
def heard(planner: Planner) -> list[DiagnosticArray]:
    return planner.listen(DiagnosticArray, '/diagnostics', 10)


def next_status(planner: Planner, heard: list[DiagnosticArray]) -> DiagnosticStatus:
    heard.clear()
    planner.wait('diagnostics', lambda: bool(heard))
    status, stream = heard[-1].status
    assert (stream.name, stream.message) == ('flex_planner: reference states', 'ready')
    assert stream.level == OK
    return status


def values(status: DiagnosticStatus) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


def test_status_comes_once_a_second_with_uptime_and_memory(planner: Planner,
                                                           heard: list[DiagnosticArray]) -> None:
    planner.wait('diagnostics', lambda: bool(heard))
    heard.clear()
    planner.wait('four diagnostics', lambda: len(heard) >= 4)
    stamps = [m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in heard]
    # on a machine that is busy single ones come late, but none is left out or comes twice
    assert stamps[-1] - stamps[0] == pytest.approx(len(stamps) - 1, abs=0.5)
    told = [values(message.status[0]) for message in heard]
    uptimes = [float(each['uptime [s]']) for each in told]
    # one clock, rounded to tenths, read twice in a callback
    assert uptimes[-1] - uptimes[0] == pytest.approx(stamps[-1] - stamps[0], abs=0.3)
    assert all(30 < float(each['memory [MB]']) < 1000 for each in told)


def test_status_tells_how_many_wait_for_trajectories(planner: Planner,
                                                     heard: list[DiagnosticArray]) -> None:
    assert values(next_status(planner, heard))[SUBSCRIBERS] == '0'
    topic = '/flex_planner/joint_trajectory'
    one = planner.node.create_subscription(JointTrajectory, topic, lambda message: None, 1)
    planner.wait('its count', lambda: values(next_status(planner, heard))[SUBSCRIBERS] == '1')
    planner.node.destroy_subscription(one)
    planner.wait('its end', lambda: values(next_status(planner, heard))[SUBSCRIBERS] == '0')


def test_status_counts_the_requests_and_warns_of_the_last_that_failed(
        planner: Planner, heard: list[DiagnosticArray]) -> None:
    planner.report()
    before = next_status(planner, heard)
    assert (before.level, before.message) == (OK, 'idle')
    assert before.name == 'flex_planner: planner'
    assert before.hardware_id == 'Korayem 2009 two-link arm, EI = 50 N m^2'
    planner.report(duration=-1.0)
    after = next_status(planner, heard)
    assert after.level == WARN
    assert after.message.startswith('idle; the last request failed: duration is -1.0')
    assert values(after)['last error code'] == '103'
    assert int(values(after)['requests failed']) == int(values(before)['requests failed']) + 1
    assert values(after)['requests solved'] == values(before)['requests solved']
    planner.report()
    assert next_status(planner, heard).level == OK


def test_status_tells_the_phase_and_the_queue(planner: Planner,
                                              heard: list[DiagnosticArray]) -> None:
    goals = [planner.plan_goal(**LONG), planner.plan_goal()]
    planner.spin(0.3)
    status = next_status(planner, heard)
    told = values(status)
    assert told['state'].startswith('planning: ')
    assert status.message.startswith(told['state'])
    assert told['requests waiting'] == '1'
    for goal in goals[::-1]:
        assert goal.cancel()
    canceled = int(told['requests canceled']) + 2
    planner.wait('state idle', lambda: values(next_status(planner, heard))['state'] == 'idle')
    assert values(next_status(planner, heard))['requests canceled'] == str(canceled)


def test_canceled_request_is_no_failure() -> None:
    record = Record()
    for code in (PlanReport.NONE, PlanReport.CANCELED):
        record.add(PlanReport(error_code=code))
    assert (record.solved, record.failed, record.canceled) == (1, 0, 1)
    assert record.error_code == PlanReport.NONE


# Markers


def points(marker: Marker) -> np.ndarray:
    return np.array([(point.x, point.y) for point in marker.points])


def test_markers_show_the_bent_links_of_the_plan(plan_of: PlanFactory) -> None:
    plan = plan_of('ei50')
    reference = sample_plan(plan, SamplingSettings())
    markers = motion_markers(plan.arm, reference, 'base').markers
    assert markers[0].action == Marker.DELETEALL
    links = [marker for marker in markers if marker.ns == 'links']
    assert [marker.id for marker in links] == list(range(18))
    assert {marker.type for marker in links} == {Marker.LINE_STRIP}
    for first, state in ((0, plan.problem.start), (16, plan.problem.goal)):
        expected = link_points(plan.arm, state[:6], 20)
        for i in range(2):
            assert points(links[first + i]) == pytest.approx(expected[i], abs=1e-12)
    alphas = [marker.color.a for marker in links]
    assert alphas == sorted(alphas)
    assert 0 < alphas[0] < alphas[-1] == pytest.approx(1)


def test_markers_show_the_way_of_the_tip(plan_of: PlanFactory) -> None:
    plan = plan_of('ei50')
    reference = sample_plan(plan, SamplingSettings(longest_step=1e-3))
    found = {marker.ns: marker for marker in motion_markers(plan.arm, reference, 'base').markers}
    path = points(found['tip_path'])
    assert len(path) == 500
    assert path[[0, -1]] == pytest.approx(np.array([[0.5, 0.0], [0.5, 0.5]]), abs=1e-6)
    start, goal = found['start'].pose.position, found['goal'].pose.position
    assert (start.x, start.y, goal.x, goal.y) == pytest.approx((0.5, 0, 0.5, 0.5), abs=1e-6)


def test_markers_are_latched_in_the_base_frame(planner: Planner) -> None:
    planner.report(publish=True)
    message = planner.latched(MarkerArray, f'{planner.name}/markers')
    assert {marker.header.frame_id for marker in message.markers} == {'shoulder'}
    keys = [(marker.ns, marker.id) for marker in message.markers[1:]]
    assert len(set(keys)) == len(keys) == 9 * load_arm('korayem_ei50').n_joints + 3
