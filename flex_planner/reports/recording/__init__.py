"""
Reports on recordings: read back into the core's terms, checked again, shown as a page.

Needs neither ROS nor the planner that made the recording, only the recording.

"""

from __future__ import annotations

from flex_planner.reports.recording.check import check_motion
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
from flex_planner.reports.recording.execution import carried_motion
from flex_planner.reports.recording.findings import CheckLimits, Finding, MotionCheck
from flex_planner.reports.recording.page import report_page, write_report
from flex_planner.reports.recording.tables import check_table, verdict

__all__ = [
    'CheckLimits',
    'Finding',
    'MotionCheck',
    'RecordedMotion',
    'RecordedRequest',
    'carried_motion',
    'check_motion',
    'check_table',
    'report_page',
    'verdict',
    'write_report',
]
