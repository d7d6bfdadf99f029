"""A planner whose topics are remapped, and which keeps few recordings."""

from __future__ import annotations

from pathlib import Path

from action_msgs.msg import GoalStatus
from flex_planner.recording import read_metadata
from flex_planner.reports.recording import RecordedRequest
from flex_planner_interfaces.msg import PlanReport
from ros_support import LONG, Planner
from trajectory_msgs.msg import JointTrajectory

REMAPPED = {'~/joint_trajectory': '/controller/trajectory'}


def folders(planner: Planner) -> list[Path]:
    return sorted(path for path in planner.recordings.iterdir() if path.name[0] != '.')


def test_node_records_remapped_names_and_canceled_goals_and_keeps_few_recordings(
        tmp_path: Path) -> None:
    with Planner(tmp_path, 'korayem_ei50', remappings=REMAPPED, max_recordings=3) as planner:
        answer = planner.plan(publish=True)
        assert answer.report.error_code == PlanReport.NONE, answer.report.error_msg
        assert planner.latched(JointTrajectory, REMAPPED['~/joint_trajectory']) == (
            answer.trajectory.joint_trajectory)
        names = {entry.topic.name for entry in read_metadata(answer.report.recording).topics}
        assert {'/controller/trajectory', '/flex_planner/plan_report'} <= names
        at_work, waiting = planner.plan_goal(**LONG), planner.plan_goal(**LONG)
        planner.wait('the goal that waits', lambda: any(
            feedback.phase.startswith('waiting') for _, feedback in waiting.feedback))
        assert waiting.cancel()
        assert at_work.cancel()
        assert waiting.end()[0] == at_work.end()[0] == GoalStatus.STATUS_CANCELED
        planner.wait('both recordings', lambda: len(folders(planner)) == 3)
        codes = [RecordedRequest.read(path).report.error_code for path in folders(planner)]
        assert codes == [PlanReport.NONE, PlanReport.CANCELED, PlanReport.CANCELED]
        last = planner.report(duration=-1.0).recording
        assert len(folders(planner)) == 3
        assert str(folders(planner)[-1]) == last
        assert f'removed the recording {answer.report.recording} of' in planner.log()
