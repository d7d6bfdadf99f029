"""
Record a plan, read the recording back, check it again from the recording alone, report.

The planner node records every request as rosbag2-compatible MCAP: the request, its outcome, the
trajectories, and the arm. Arm and motion can be rebuilt from it without the planner. Writing a
recording needs ROS 2, reading it does not.

    tools/run python examples/replay_and_report.py

"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
import sys

from flex_planner import load_arm, plan_path, Task
from flex_planner.cli.recorder import RequestRecorder
from flex_planner.cli.request import Request
from flex_planner.planning.robustness import assess_robustness
from flex_planner.planning.sampling import sample_plan
from flex_planner.recording import definition_folder, MessageTypes, read_recording
from flex_planner.reports.recording import check_motion, RecordedRequest, verdict, write_report

FOLDER = Path('output')


def record_plan() -> Path:
    """Plan a motion, record it as the node would, and return the folder."""
    arm = load_arm('korayem_ei50')
    task = Task.between_points(arm, (0.5, 0.0), (0.5, 0.5), duration=1.0, payload_mass=1.0,
                               effort_weights=[1 / 8, 1 / 8])
    request = Request(task=task, elbow=-1, time_limit=30.0)
    plan = plan_path(task)
    if not plan.solved:
        sys.exit(plan.message)
    sampled = sample_plan(plan, request.sampling)
    sampled = replace(sampled, robustness=assess_robustness(plan, sampled))
    return RequestRecorder(request, FOLDER / 'recordings').record_plan(plan, sampled)


def main() -> None:
    """Record, read, check, report."""
    path = record_plan()
    print(f'recording: {path}')

    # as messages, in the order of their times; any rosbag2 tool reads them as well
    types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
    counts = Counter(entry.topic.name for entry in read_recording(path, types))
    print('\n'.join(f'  {count:5d} {topic}' for topic, count in counts.items()))

    # as arm, parameters and arrays, and once more through the dynamics: the recorded arm carries
    # out the recorded trajectory under its joint controller
    request = RecordedRequest.read(path)
    check = check_motion(request)
    for finding in check.findings:
        print(f'{finding.name}: {finding}')

    page = FOLDER / 'replay_and_report.html'
    write_report(page, request, check)
    print(f'{verdict(request, check)}\nreport: {page}, to be opened in any browser\n'
          f'tools/run flex-planner replay {path} publishes it again')


if __name__ == '__main__':
    main()
