"""The actions of the planner node, in a process of its own, over Fast DDS."""

from __future__ import annotations

from collections.abc import Iterator
import math
from pathlib import Path
import signal
import subprocess
import sys
from typing import Any

from action_msgs.msg import GoalStatus
from flex_planner_interfaces.msg import FlexibleTrajectory, PlanReport
from geometry_msgs.msg import Point
import pytest
from ros_support import LEAVING, LONG, Planner, SUPPORT
from trajectory_msgs.msg import JointTrajectory

SUCCEEDED, ABORTED, CANCELED = (
    GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED, GoalStatus.STATUS_CANCELED)

# A program that asks for the plan that LONG makes slow, and never hears the answer.
DOOMED_CLIENT = """
import rclpy
from flex_planner_interfaces.action import PlanPath
from flex_planner_interfaces.msg import MotionTask
from rclpy.action import ActionClient
rclpy.init()
node = rclpy.create_node('doomed')
client = ActionClient(node, PlanPath, '/flex_planner/plan_path')
assert client.wait_for_server(60)
task = MotionTask(start_positions=[1.0, -2.0], goal_positions=[1.5, -1.5], duration=100.0,
                  start_modal_displacements=[0.02, 0.0, 0.02, 0.0], effort_weights=[0.1, 0.1],
                  allowed_planning_time=0.8)
accepted = client.send_goal_async(PlanPath.Goal(task=task))
rclpy.spin_until_future_complete(node, accepted)
accepted.result().get_result_async()
rclpy.spin_once(node, timeout_sec=0.2)
print('sent', flush=True)
rclpy.spin(node)
"""


@pytest.fixture(scope='module')
def planner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Planner]:
    folder = tmp_path_factory.mktemp('actions')
    with Planner(folder, 'korayem_ei50', queue_length=1) as planner:
        yield planner
        assert planner.process.process.poll() is None
        assert 'Traceback' not in planner.log()


def test_goal_succeeds_with_the_plan_of_the_service(planner: Planner) -> None:
    status, result = planner.plan_goal().end()
    assert (status, result.report.error_code) == (SUCCEEDED, PlanReport.NONE)
    assert result.trajectory == planner.plan().trajectory
    assert Path(result.report.recording).is_dir()


def test_plan_of_a_goal_is_published(planner: Planner) -> None:
    heard = planner.listen(FlexibleTrajectory, f'{planner.name}/flexible_trajectory')
    _, result = planner.plan_goal(publish=True, payload_mass=1.3).end()
    planner.wait('trajectory', lambda: result.trajectory in heard)


def test_search_succeeds_with_the_payload_of_the_service(planner: Planner) -> None:
    fields = {'payload_mass': 5.5, 'payload_accuracy': 2.0}
    status, result = planner.search_goal(**fields).end()
    assert (status, result.report.error_code) == (SUCCEEDED, PlanReport.NONE)
    assert result.payload == planner.search(**fields).payload > 5.5
    assert result.trajectory.payload_mass == result.payload


@pytest.mark.parametrize(('wrong', 'code'), [
    ({'duration': math.nan}, PlanReport.NOT_FINITE),
    ({'space': 7}, PlanReport.OUT_OF_RANGE),
    ({'goal_point': Point(x=2.0)}, PlanReport.UNREACHABLE),
    ({**LONG, 'allowed_planning_time': 0.2}, PlanReport.TIMEOUT),
], ids=str)
def test_goal_without_a_plan_is_aborted_with_the_reason(planner: Planner, wrong: dict[str, Any],
                                                        code: int) -> None:
    for send in (planner.plan_goal, planner.search_goal):
        status, result = send(**wrong).end()
        assert (status, result.report.error_code) == (ABORTED, code)
        assert result.report.error_msg
        assert result.trajectory == FlexibleTrajectory()


def test_feedback_tells_again_and_again_how_far_a_plan_is(planner: Planner) -> None:
    goal = planner.plan_goal(**LONG)
    # while something is compiled, the feedback has no residual
    planner.wait('ten messages of feedback and an iteration', lambda: bool(
        len(goal.feedback) >= 10 and math.isfinite(goal.feedback[-1][1].residual)
        and goal.feedback[-1][1].iteration > goal.feedback[0][1].iteration))
    said = [message for _, message in goal.feedback]
    assert not goal.answer.done()
    assert goal.cancel()
    goal.end()
    elapsed = [message.elapsed.sec + message.elapsed.nanosec * 1e-9 for message in said]
    assert elapsed == sorted(elapsed)
    assert [message.iteration for message in said] == sorted(m.iteration for m in said)
    last = said[-1]
    assert last.iteration > said[0].iteration
    assert last.phase
    assert last.payload == 1.0
    assert last.intervals >= 4
    assert math.isfinite(last.residual)


def test_goal_is_canceled_while_it_is_at_work(planner: Planner) -> None:
    for send in (planner.plan_goal, planner.search_goal, planner.plan_goal):
        goal = send(**LONG, publish=True)
        planner.spin(0.4)
        assert goal.cancel()
        status, result = goal.end(LEAVING)
        assert (status, result.report.error_code) == (CANCELED, PlanReport.CANCELED)
        assert result.report.error_msg == 'canceled'
        assert result.report.planning_time.nanosec > 0


def test_worker_is_free_after_a_cancellation(planner: Planner) -> None:
    goal = planner.plan_goal(**LONG)
    planner.spin(0.4)
    goal.cancel()
    answer = planner.send_plan(duration=-1.0)
    planner.wait('the next answer', answer.done, LEAVING)
    assert answer.result().report.error_code == PlanReport.OUT_OF_RANGE


def test_waiting_goal_can_be_canceled_and_leaves_its_place(planner: Planner) -> None:
    first = planner.plan_goal(**LONG)
    planner.spin(0.3)
    waiting = planner.plan_goal()
    planner.spin(0.3)
    assert waiting.feedback[-1][1].phase == 'waiting for earlier requests'
    assert waiting.feedback[-1][1].iteration == 0
    assert waiting.cancel()
    assert waiting.end()[0] == CANCELED
    assert not first.answer.done()
    last = planner.plan_goal()
    planner.spin(0.2)
    assert first.cancel()
    assert last.end()[0] == SUCCEEDED


def test_goals_beyond_the_queue_are_aborted_as_busy(planner: Planner) -> None:
    goals = [planner.plan_goal(**LONG, allowed_planning_time=0.8) for _ in range(3)]
    goals.append(planner.search_goal(**LONG, allowed_planning_time=0.8))
    ends = [goal.end() for goal in goals]
    assert {status for status, _ in ends} == {ABORTED}
    codes = [result.report.error_code for _, result in ends]
    assert codes[0] == PlanReport.TIMEOUT
    assert codes.count(PlanReport.BUSY) >= 2  # one at work, one waiting
    assert (ends[-1][1].payload_upper, ends[-1][1].limiting_joint) == (math.inf, -1)


def test_goal_that_has_ended_cannot_be_canceled(planner: Planner) -> None:
    goal = planner.plan_goal(duration=-1.0)
    assert goal.end()[0] == ABORTED
    assert not goal.cancel()
    assert planner.report().error_code == PlanReport.NONE


def test_client_that_dies_with_a_goal_leaves_the_node_serving(planner: Planner) -> None:
    with subprocess.Popen([sys.executable, '-c', DOOMED_CLIENT], stdout=subprocess.PIPE,
                          cwd=SUPPORT) as client:
        try:
            assert client.stdout is not None
            assert client.stdout.readline() == b'sent\n'
        finally:
            client.kill()
    assert client.returncode == -signal.SIGKILL
    assert planner.plan_goal().end()[0] == SUCCEEDED


def test_canceled_goal_publishes_nothing(planner: Planner) -> None:
    before = planner.plan(publish=True).trajectory
    goal = planner.plan_goal(**LONG, publish=True)
    planner.spin(0.2)
    assert goal.cancel()
    assert planner.report().error_code == PlanReport.NONE  # the worker is through with it
    late = planner.latched(JointTrajectory, f'{planner.name}/joint_trajectory')
    assert late == before.joint_trajectory
