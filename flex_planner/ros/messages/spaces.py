"""How a request gives start and goal, which its result repeats."""

from __future__ import annotations

from flex_planner.planning.warnings import WarningKind
from flex_planner.ros.messages.classes import MotionTask, PlanReport

SPACES = {MotionTask.JOINT: 'JOINT', MotionTask.CARTESIAN: 'CARTESIAN',
          MotionTask.CARTESIAN_GOAL: 'CARTESIAN_GOAL'}


def add_space(report: PlanReport, message: MotionTask) -> None:
    """Add to a report how start and goal were read, with a word where that may not be meant."""
    report.space = SPACES.get(message.space, '')
    if message.space != MotionTask.JOINT or not _means_points(message):
        return
    sentence = ('space is 0, as in a request without it, so that JOINT was assumed: '
                'start_positions and goal_positions count, points do not. For points set it to '
                'CARTESIAN (1) or CARTESIAN_GOAL (2)')
    if report.error_code == PlanReport.NONE:
        report.warning_kinds = [*report.warning_kinds, WarningKind.SPACE_ASSUMED.name]
        report.warnings = [*report.warnings, sentence]
    else:
        report.error_msg = f'{report.error_msg}; {sentence}'


def _means_points(message: MotionTask) -> bool:
    """Return whether a request has points, or lacks joint angles."""
    points = (message.start_point, message.goal_point)
    return (not (message.start_positions and message.goal_positions)
            or any(point.x or point.y or point.z for point in points))
