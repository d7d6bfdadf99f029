"""Plans that a controller carries out over its action, with the real node and a server of ours."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
import os
from pathlib import Path
import time
from typing import Any

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from control_msgs_support import BUILD, environment
from diagnostic_msgs.msg import DiagnosticArray
from flex_planner.recording import definition_folder, MessageTypes, read_recording
from flex_planner.reports.recording.contents import RecordedRequest
from flex_planner.ros.messages.times import time_message, time_ns
from flex_planner.ros.runtime.processes import NodeProcess
from flex_planner_interfaces import action
from flex_planner_interfaces.msg import PlanReport
from geometry_msgs.msg import Point
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.action import ActionServer
from rclpy.parameter import Parameter
from rclpy.task import Future
from ros_support import Planner, STARTING, SUPPORT
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

CONTROLLER = '/fake_controller'
ACTION = f'{CONTROLLER}/follow_joint_trajectory'
AGAIN = 5.0  # [s], until a controller that does not answer is asked again
TIMEOUT = 1.5  # [s], of the planner for each answer


class Arena(Planner):
    """A planner and a controller, each in a process of its own."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, 'korayem_rigid', execute_action=ACTION, execute_timeout=TIMEOUT)
        self.server = NodeProcess('fake_controller', log=folder / 'controller.log')
        self.events = self.listen(String, f'{CONTROLLER}/events', 100)
        self.published = self.listen(JointTrajectory, f'{self.name}/joint_trajectory')

    def behave(self, behaviour: str) -> None:
        """Tell the controller how to behave."""
        change = Parameter('behaviour', value=behaviour).to_parameter_msg()
        request = SetParameters.Request(parameters=[change])
        asked: list[tuple[float, Future]] = []

        def answered() -> bool:
            # after a restart, what is known at first may be what is left of the one before
            if not asked or time.monotonic() > asked[-1][0] + AGAIN:
                asked.append((time.monotonic(), self.send(
                    SetParameters, f'{CONTROLLER}/set_parameters', request)))
            return any(future.done() for _, future in asked)

        self.wait('an answer of the controller', answered)
        answer = next(future.result() for _, future in asked if future.done())
        assert answer.results[0].successful
        self.events.clear()
        self.published.clear()

    def meet(self) -> None:
        """Wait until the planner knows the controller, which it may discover after this client."""
        self.behave('refuse')
        self.wait('the planner to discover the controller', lambda: self.report(
            publish=True).error_code == PlanReport.EXECUTION_REFUSED, STARTING)

    def heard(self, text: str) -> None:
        """Wait until the controller says something."""
        self.wait(text, lambda: any(text in event.data for event in self.events))

    def restart(self, folder: Path) -> None:
        """Start the controller again."""
        self.server.stop()
        self.server = NodeProcess('fake_controller', log=folder / 'controller.log')
        parameters = self._services[f'{CONTROLLER}/set_parameters']
        self.wait('the controller', parameters.service_is_ready, STARTING)


@pytest.fixture(scope='module')
def arena(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Arena]:
    folder = tmp_path_factory.mktemp('execution')
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment().items():
            patch.setenv(name, value)
        patch.setenv('PYTHONPATH', os.pathsep.join([str(SUPPORT), os.environ['PYTHONPATH']]))
        with Arena(folder) as arena:
            try:
                arena.meet()
                yield arena
                assert 'Traceback' not in arena.log()
            finally:
                arena.server.stop()


def test_plan_is_carried_out_and_recorded(arena: Arena) -> None:
    arena.behave('carry_out')
    accepted = arena.listen(JointTrajectory, f'{CONTROLLER}/accepted', 10)
    answer = arena.plan(publish=True)
    report = answer.report
    assert (report.error_code, report.error_msg) == (PlanReport.NONE, '')
    assert report.execution_accepted
    assert report.execution_time.sec + report.execution_time.nanosec > 0
    arena.wait('the plan at the controller', lambda: bool(accepted))
    assert accepted[0] == answer.trajectory.joint_trajectory
    arena.wait('the plan on the topic', lambda: bool(arena.published))
    recorded = RecordedRequest.read(report.execution_recording)
    assert recorded.report.execution_accepted
    assert Path(report.recording) != Path(report.execution_recording)


def test_plan_that_is_not_to_be_published_is_not_carried_out(arena: Arena) -> None:
    arena.behave('carry_out')
    report = arena.report()
    assert (report.error_code, report.execution_accepted) == (PlanReport.NONE, False)
    assert not report.execution_recording
    assert not arena.events


@pytest.mark.parametrize(('behaviour', 'code', 'accepted', 'words'), [
    ('refuse', PlanReport.EXECUTION_REFUSED, False, 'refused the plan'),
    ('silent', PlanReport.EXECUTION_NO_ANSWER, False, 'did not say within 1.5 s'),
    ('abort', PlanReport.EXECUTION_ABORTED, True, 'PATH_TOLERANCE_VIOLATED: joint2 is 0.3 rad'),
    ('wrong', PlanReport.EXECUTION_ABORTED, True, 'GOAL_TOLERANCE_VIOLATED'),
    ('hang', PlanReport.EXECUTION_NO_ANSWER, True, 'did not end it within 2.5 s'),
])
def test_each_failure_of_the_controller_has_its_sentence(
        arena: Arena, behaviour: str, code: int, accepted: bool, words: str) -> None:
    arena.behave(behaviour)
    answer = arena.plan(publish=True)
    report = answer.report
    assert report.error_code == code, report.error_msg
    assert words in report.error_msg
    assert ACTION in report.error_msg
    assert report.execution_accepted == accepted
    assert answer.trajectory.points
    assert _recorded(report.execution_recording) == code
    assert bool(arena.published) == accepted
    if behaviour == 'hang':
        arena.heard('cancel')


def test_plan_that_is_accepted_too_late_is_canceled(arena: Arena) -> None:
    arena.behave('slow')
    report = arena.report(publish=True)
    assert report.error_code == PlanReport.EXECUTION_NO_ANSWER
    arena.heard('cancel')
    assert not arena.published


def test_cancellation_passes_on_to_the_controller(arena: Arena) -> None:
    arena.behave('hang')
    status = arena.listen(DiagnosticArray, '/diagnostics', 10)
    goal = arena.plan_goal(publish=True, duration=4.0)
    arena.heard('accepted')
    arena.wait('the status', lambda: any(
        message.status[0].message.startswith('carrying out a plan') for message in status))
    arena.wait('feedback', lambda: any(
        message.phase == 'carrying out the plan' for _, message in goal.feedback))
    assert goal.cancel()
    arena.heard('cancel')
    status, result = goal.end()
    assert (status, result.report.error_code) == (GoalStatus.STATUS_CANCELED, PlanReport.CANCELED)
    assert 'ended the motion' in result.report.error_msg
    assert result.report.execution_accepted
    assert _recorded(result.report.execution_recording) == PlanReport.CANCELED


def test_motion_that_somebody_cancels_at_the_controller_is_no_success(arena: Arena) -> None:
    arena.behave('hang')
    plan = arena.send_plan(publish=True)
    arena.heard('accepted')
    arena.call(CancelGoal, f'{ACTION}/_action/cancel_goal', CancelGoal.Request())  # all of them
    arena.wait('the answer', plan.done)
    report = plan.result().report
    assert report.error_code == PlanReport.EXECUTION_CANCELED
    assert f'somebody else canceled the motion at {ACTION}' in report.error_msg


def test_controller_that_does_not_cancel_is_named(arena: Arena) -> None:
    arena.behave('stubborn')
    goal = arena.plan_goal(publish=True)
    arena.heard('accepted')
    assert goal.cancel()
    status, result = goal.end()
    assert (status, result.report.error_code) == (
        GoalStatus.STATUS_ABORTED, PlanReport.EXECUTION_NO_ANSWER)
    assert 'may move still' in result.report.error_msg


def test_controller_that_leaves_and_one_that_is_not_there(arena: Arena, tmp_path: Path) -> None:
    arena.behave('leave')
    report = arena.report(publish=True)
    assert report.error_code in (PlanReport.EXECUTION_SERVER_GONE,
                                 PlanReport.EXECUTION_NO_ANSWER), report.error_msg
    assert report.execution_accepted
    arena.published.clear()
    arena.server.stop()
    report = arena.report(publish=True)
    assert report.error_code == PlanReport.EXECUTION_NO_SERVER, report.error_msg
    assert f'there is no action {ACTION}' in report.error_msg
    assert not arena.published
    other = ActionServer(arena.node, action.PlanPath, ACTION, lambda goal: None)
    arena.spin(0.5)
    report = arena.report(publish=True)
    other.destroy()
    assert report.error_code == PlanReport.EXECUTION_NO_SERVER, report.error_msg
    assert 'but its type is flex_planner_interfaces/action/PlanPath' in report.error_msg
    arena.restart(tmp_path)
    arena.behave('carry_out')
    codes = {PlanReport.EXECUTION_NO_SERVER}  # the planner discovers it a moment after this client
    for _ in range(10):
        codes.add(arena.report(publish=True).error_code)
        if PlanReport.NONE in codes:
            break
    assert codes == {PlanReport.EXECUTION_NO_SERVER, PlanReport.NONE}


def test_node_with_a_name_that_cannot_be_says_so_and_ends(arena: Arena, tmp_path: Path) -> None:
    check_refusals(tmp_path, [
        ({'execute_action': 'no name!'}, 'must be the name of an action'),
        ({'execute_action': '/flex_planner/follow_joint_trajectory'}, 'every plan twice'),
        ({'joint_states_topic': '/a//b'}, 'must be the name of a topic')])


def test_node_without_control_msgs_says_so_and_ends(tmp_path: Path,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    if not environment():
        pytest.skip('control_msgs is installed')
    others = [path for path in os.environ['PYTHONPATH'].split(os.pathsep)
              if BUILD not in Path(path).parents]
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join(others))
    check_refusals(tmp_path, [({'execute_action': ACTION}, 'install ros-jazzy-control-msgs')])


def check_refusals(folder: Path, wrong: list[tuple[dict[str, Any], str]]) -> None:
    """Require that nodes with such parameters do not start, and say why; all start at once."""
    with ExitStack() as stack:
        nodes = [stack.enter_context(NodeProcess(
            'flex_planner.ros.planner.node', {'arm': 'korayem_rigid', **parameters},
            log=folder / f'{k}.log')) for k, (parameters, _) in enumerate(wrong)]
        assert [node.process.wait(STARTING) for node in nodes] == [1] * len(wrong)
    for k, (_, words) in enumerate(wrong):
        log = (folder / f'{k}.log').read_text()
        assert words in log
        assert 'Traceback' not in log


def test_plan_that_is_replaced_in_motion_ends_at_once_and_another_goes_on(arena: Arena) -> None:
    arena.behave('hang')
    accepted = arena.listen(JointTrajectory, f'{CONTROLLER}/accepted', 10)
    first = arena.plan_goal(publish=True, duration=20.0)
    arena.wait('the plan on the topic', lambda: bool(arena.published))
    arena.wait('its identifier', lambda: bool(
        first.feedback and first.feedback[-1][1].plan_id))
    newest = first.feedback[-1][1].plan_id
    lead = arena.node.get_clock().now().nanoseconds + 3 * 10**9
    second = arena.plan_goal(publish=True, replaces=newest, duration=0.0, payload_mass=0.0,
                             effort_weights=[], space=2, goal_point=Point(x=0.5, y=0.4),
                             start_time=time_message(lead))
    status, result = first.end()
    assert status == GoalStatus.STATUS_ABORTED
    assert result.report.error_code == PlanReport.EXECUTION_REPLACED
    assert result.report.plan_id == newest
    arena.wait('the new plan', lambda: len(accepted) == 2)
    assert time_ns(accepted[0].header.stamp) == 0 < time_ns(accepted[1].header.stamp) < lead
    assert second.cancel()
    assert second.end()[1].report.error_code == PlanReport.CANCELED
    report = arena.report(replaces=newest, duration=0.0, payload_mass=0.0, effort_weights=[],
                          space=2, goal_point=Point(x=0.5, y=0.4), publish=True)
    assert report.error_code == PlanReport.INVALID_TASK  # nothing is carried out any more


def test_planner_that_ends_while_the_arm_moves_ends_in_good_order(arena: Arena) -> None:
    arena.behave('hang')
    arena.plan_goal(publish=True)
    arena.heard('accepted')
    assert arena.stop() == 0
    assert 'Traceback' not in arena.log()


def _recorded(path: str) -> int:
    """Return the error code in a recording of an execution."""
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    reports = [entry.message for entry in read_recording(path, types)
               if entry.topic.type_name.endswith('PlanReport')]
    assert len(reports) == 1
    return int(reports[0].error_code)
