"""Errors of the model that a recorded motion forgives."""

from __future__ import annotations

from flex_planner.optimal_control.torque_offset import TorqueOffset
from flex_planner.reports.execution import millimetres
from flex_planner.reports.recording.contents import RecordedRequest
from flex_planner.reports.recording.report_table import ReportTable
import numpy as np


def recorded_offset(request: RecordedRequest) -> TorqueOffset | None:
    """Return the torque that effort was measured from; None if that was zero."""
    breaks = np.asarray(request.report.torque_offset_breaks, dtype=float)
    if not breaks.size:
        return None
    coefficients = np.asarray(request.report.torque_offset, dtype=float)
    return TorqueOffset(breaks=breaks, coefficients=coefficients.reshape(
        -1, request.arm.n_joints))


def forgiveness_tables(request: RecordedRequest) -> list[ReportTable]:
    """Return the residual vibration on arms that differ; empty if none was asked for."""
    task, report = request.task, request.report
    if not task.max_residual or not np.isfinite(report.forgiven_residual_before):
        return []
    return [ReportTable(title='Residual bending on arms that differ from the model', rows=(
        ('stiffness and payload differ by', f'{task.stiffness_error:.3g}, '
         f'{task.payload_error:.3g} of their values'),
        ('largest, with this motion', millimetres(report.forgiven_residual)),
        ('with the motion of least cost', millimetres(report.forgiven_residual_before)),
        ('asked for', f'at most {millimetres(task.max_residual)}')))]
