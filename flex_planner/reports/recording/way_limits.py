"""Limits on the way of a recorded motion: how near it comes, when, and whether it keeps them."""

from __future__ import annotations

from typing import Any

from flex_planner.base.validation import Array
from flex_planner.optimal_control.path_constraints import PathSlacks
from flex_planner.planning.constraint_margins import ACTIVE, find_active
from flex_planner.reports.recording.contents import RecordedMotion, RecordedRequest
from flex_planner.reports.recording.findings import CheckLimits, Finding
from flex_planner.reports.recording.report_table import Cells, ReportTable
import numpy as np

Spans = tuple[tuple[float, float], ...]

_COLUMNS = ('', 'least left', 'share of its scale', 'at [s]', f'less than {ACTIVE:.0%} left [s]')


def find_active_limits(request: RecordedRequest,
                       motion: RecordedMotion) -> list[tuple[str, Spans]]:
    """
    Return the name of each limit with the times between which it is active; empty if none is.

    The slacks are computed anew from the recorded samples, so a limit that is met for less than
    the time between two of them may have none.

    Parameters
    ----------
    request : RecordedRequest
        Its arm and its task have the limits.
    motion : RecordedMotion
        Times are those of its samples [s].

    """
    shares = np.asarray(getattr(request.report, 'limit_shares', ()), dtype=float)
    if not (shares < ACTIVE).any():  # nothing needs to be compiled to know it
        return []
    times, (names, values) = motion.times[motion.moving], _recorded_slacks(request, motion)
    return [(name, find_active(times, column))
            for name, column in zip(names, values.T, strict=True)]


def limit_findings(request: RecordedRequest, motion: RecordedMotion,
                   limits: CheckLimits) -> list[Finding]:
    """
    Return whether the samples of a motion keep its limits on the way, as the report says.

    Parameters
    ----------
    request : RecordedRequest
        Its arm and its task have the limits, its report what is left of them.
    motion : RecordedMotion
        Its samples are looked at, not what is between them.
    limits : CheckLimits
        What must be kept.

    Returns
    -------
    list of Finding
        By how much the limit is passed that is nearest to it; and what the report says too much
        is left of any, where it is of the same limits. Empty without limits.

    """
    names, values = _recorded_slacks(request, motion)
    if not names:
        return []
    least, report = values.min(axis=0), request.report
    worst = int(least.argmin())
    found = [Finding(name=f'nearest limit, {names[worst]}, passed by', unit='',
                     limit=limits.limit_passed, value=max(-float(least[worst]), 0.0))]
    # after them a report has limits of the motors, where torques are states
    if list(getattr(report, 'limit_names', ()))[:len(names)] == names:
        said = np.asarray(report.limit_shares, dtype=np.float64)[:len(names)]
        found.append(Finding(name='limits on the way, less left than reported', unit='',
                             limit=limits.limit_difference,
                             value=max(float((said - least).max()), 0.0)))
    return found


def _recorded_slacks(request: RecordedRequest,
                     motion: RecordedMotion) -> tuple[list[str], Array]:
    """Return the names of all limits, and their slacks (k, n_c) at the samples of the motion."""
    slacks = PathSlacks(request.arm, request.path_constraints)
    states = np.hstack([motion.coordinates, motion.rates])[motion.moving]
    return [label.name for label in slacks.labels], slacks(states)


def limit_tables(request: RecordedRequest) -> list[ReportTable]:
    """Return what is left of each limit on the way; older recordings do not say."""
    report, motion = request.report, request.motion
    if not len(getattr(report, 'limit_names', ())):
        return []
    active = [] if motion is None else [[
        (first - motion.begin, last - motion.begin) for first, last in spans]
        for _, spans in find_active_limits(request, motion)]
    names = list(report.limit_names)
    # a planner of another version may know other limits
    spans = active if len(active) == len(names) else [[] for _ in names]
    rows = [_row(*row) for row in zip(
        names, report.limit_margins, report.limit_units, report.limit_shares, report.limit_times,
        spans, strict=True)]
    return [ReportTable(title='Limits on the way', columns=_COLUMNS,
                        rows=(*rows, *_resimulated(report)))]


def _row(name: str, margin: float, unit: str, share: float, time: float,
         active: list[tuple[float, float]]) -> Cells:
    """Return the row of a limit."""
    spans = ', '.join(f'{first:.4g} to {last:.4g}' for first, last in active)
    return (name, f'{margin:.3g} {unit}'.rstrip(), f'{share:.3%}', f'{time:.4g}',
            spans or ('at that moment' if share < ACTIVE else '–'))


def _resimulated(report: Any) -> list[Cells]:
    """Return the smallest share in the re-simulation of a plan that has one."""
    if not np.isfinite(report.limit_slack):
        return []
    return [('smallest when re-simulated', '', f'{report.limit_slack:.3%}', '', '')]
