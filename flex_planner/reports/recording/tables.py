"""The tables of a report: text only, for the page and for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from itertools import zip_longest
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint_units import units_of
from flex_planner.base.validation import Array
from flex_planner.planning.certificate import CertificateLimits
from flex_planner.planning.warnings import WarningKind
from flex_planner.reports.execution import execution_rows, vibrations
from flex_planner.reports.recording.arm_tables import arm_tables
from flex_planner.reports.recording.contents import RecordedRequest
from flex_planner.reports.recording.execution import recorded_execution, recorded_robustness
from flex_planner.reports.recording.feedback import gain_tables
from flex_planner.reports.recording.findings import MotionCheck
from flex_planner.reports.recording.forgiveness import forgiveness_tables
from flex_planner.reports.recording.frequencies import NaturalFrequencies
from flex_planner.reports.recording.report_table import Cells, ReportTable
from flex_planner.reports.recording.way_limits import limit_tables
import numpy as np

_CERTIFICATE = {
    'collocation_residual': '', 'boundary_error': '', 'hamiltonian_drift': '', 'tip_error': ' m',
    'residual_vibration': ' m', 'state_error': '', 'costate_error': '', 'via_error': ' m'}


def verdict(request: RecordedRequest, check: MotionCheck | None = None) -> str:
    """Return the outcome of the request in a sentence."""
    report = request.report
    if not request.solved:
        return f'Failed, error {report.error_code}: {report.error_msg or "no reason is recorded"}'
    found = '' if request.search is None else f'Maximum payload {request.search.payload:.6g} kg. '
    if check is None:
        return f'{found}Solved and certified when it was planned; not checked again here.'
    failed = [finding.name for finding in check.findings if not finding.passed]
    again = f'FAILED ({", ".join(failed)})' if failed else 'passed'
    return f'{found}Solved and certified when it was planned; the check of the recording {again}.'


def tables(request: RecordedRequest, check: MotionCheck | None = None,
           frequencies: NaturalFrequencies | None = None) -> list[ReportTable]:
    """Return the tables of a report."""
    found = [_task(request), _outcome(request), *_kinds(request), *_warnings(request.report)]
    if request.solved:
        found += [_certificate(request), *_execution(request)]
    found += [*limit_tables(request), *forgiveness_tables(request), *gain_tables(request)]
    if check is not None:
        found.append(check_table(check))
    if request.motion is not None:
        found.append(_joints(request))
    if frequencies is not None:
        found.append(_frequencies(frequencies))
    if request.search is not None:
        found += [_search(request.search, request.report), *_trials(request.search)]
    if len(request.report.tried_weights):
        found.append(_objectives(request.report))
    return [*found, *arm_tables(request.arm), _settings(request), *_left_out(request)]


def check_table(check: MotionCheck) -> ReportTable:
    """Return the findings of a check."""
    return ReportTable(title='Check of the recording against the model', rows=tuple(
        (finding.name, f'{finding.value:.3g} {finding.unit}', f'{finding.limit:.3g}',
         'passed' if finding.passed else 'FAILED') for finding in check.findings),
        columns=('', 'found', 'limit', ''))


def numbers(values: Iterable[float]) -> str:
    """Return numbers in a line, or a dash."""
    return ', '.join(f'{value:.6g}' for value in values) or '–'


def _task(request: RecordedRequest) -> ReportTable:
    """Return the task of the request."""
    task = request.task
    ends = [_say_end(request, 'start', task.space == task.CARTESIAN),
            _say_end(request, 'goal', task.space != task.JOINT)]
    rows = [('start', ends[0]), *_via_points(request), ('goal', ends[1]),
            ('duration', f'{task.duration:g} s'),
            ('payload', f'{task.payload_mass:g} kg, '
             f'{task.payload_inertia or request.arm.payload_inertia:g} kg m²'),
            ('weights R', numbers(task.effort_weights)),
            ('weights W1', numbers(task.position_weights)),
            ('weights W2', numbers(task.velocity_weights)),
            ('tolerance of the boundary error', f'{request.tolerance:g}')]
    for one in getattr(task, 'goal_orientation', ()):  # older recordings have none
        parts = (one.x, one.y, one.z, one.w)
        rows.append(('orientation of the goal (x, y, z, w)', numbers(parts)))
    if task.allow_large_bending:
        rows.append(('large bending', 'allowed'))
    for name in ('start_velocities', 'start_modal_displacements'):
        if np.any(getattr(task, name)):
            rows.append((name.replace('_', ' '), numbers(getattr(task, name))))
    for name in ('max_joint_speeds', 'max_torque_shares', 'max_modal_rates',
                 'torque_rate_weight', 'max_torque_rate'):
        if len(getattr(task, name, ())):
            rows.append((name.replace('_', ' '), numbers(getattr(task, name))))
    return ReportTable(title='Task', rows=tuple(rows))


def _via_points(request: RecordedRequest) -> list[tuple[str, str]]:
    """Return the via points of the request; older recordings have none."""
    task, n = request.task, request.arm.n_joints
    times = getattr(task, 'via_times', ())
    passed = list(getattr(request.report, 'via_times', ())) or list(times)
    rows = []
    for k, (time, when) in enumerate(zip(times, passed, strict=False)):
        angles = np.asarray(task.via_positions[k * n:(k + 1) * n], dtype=np.float64)
        place = (_say_positions(request.arm, angles) if np.isfinite(angles).any()
                 else _say_point(task.via_points[k], request.arm.dimension))
        at = f' at {when:.6g} s' if when else ''
        rows.append((f'via point {k + 1}', f'{place}{at}{"" if time else " (free time)"}'))
    return rows


def _say_end(request: RecordedRequest, name: str, is_point: bool) -> str:
    """Return start or goal in words."""
    task = request.task
    if name == 'start' and int(getattr(task, 'start', False)):  # that of the arm was never known
        return 'where the arm is'
    if is_point:
        return _say_point(getattr(task, f'{name}_point'), request.arm.dimension)
    return _say_positions(request.arm, getattr(task, f'{name}_positions'))


def _say_positions(arm: Arm, positions: Sequence[float] | Array) -> str:
    """Return joint positions in words; a request that was refused may have others than n."""
    units, values = [units_of(joint) for joint in arm.joints], np.array(positions, dtype=float)
    scales = np.ones(max(len(units), values.size))
    scales[:len(units)] = [unit.scale for unit in units]
    shown = ', '.join(dict.fromkeys(unit.position for unit in units))
    return f'({numbers(scales[:values.size] * values)}) {shown}'


def _say_point(point: Any, dimension: int) -> str:
    """Return a point of a message in words."""
    values = [point.x, point.y, point.z][:dimension]
    return f'({", ".join(f"{value:g}" for value in values)}) m'


def _outcome(request: RecordedRequest) -> ReportTable:
    """Return the outcome of the request."""
    report = request.report
    seconds = report.planning_time.sec + report.planning_time.nanosec * 1e-9
    rows = [('error code', str(report.error_code))]
    if report.error_msg:
        rows.append(('error', report.error_msg))
    rows += [('planned in', f'{seconds:.3f} s'), ('strategy', report.strategy or '–'),
             ('iterations', str(report.iterations)), ('intervals', str(report.mesh_intervals))]
    if report.map_cell:
        rows.append(('started from', report.map_cell))
    rows += _arm_and_controller(request.arm, report)
    if request.motion is not None:
        rows += [('payload', f'{request.motion.payload_mass:.6g} kg'),
                 ('cost J', f'{report.cost:.6g}'), ('effort', f'{report.effort:.6g} N²m²s'),
                 ('energy', f'{report.energy:.6g} J'),
                 ('switching times [s]', numbers(report.switching_times))]
    return ReportTable(title='Outcome', rows=tuple(rows))


def _arm_and_controller(arm: Arm, report: Any) -> list[tuple[str, str]]:
    """Return where the arm was, and what its controller did; older recordings have neither."""
    rows = []
    if len(getattr(report, 'measured_positions', ())):
        rows.append(('arm measured at', _say_positions(arm, report.measured_positions)))
    took = getattr(report, 'execution_time', None)
    if took is not None and (took.sec or took.nanosec):
        accepted = 'accepted' if report.execution_accepted else 'not accepted'
        rows += [('controller', f'{accepted}, ended after {took.sec + took.nanosec * 1e-9:.3f} s, '
                  f'error {report.execution_error_code} {report.execution_error_string}'.rstrip())]
    return rows


def _kinds(request: RecordedRequest) -> list[ReportTable]:
    """Return the kinds of motion that were met; older recordings have none."""
    report = request.report
    values = report.kind_values
    if not len(values):
        return []
    rows = _side_by_side(values, report.kind_sentences, report.kind_counts)
    unit = 'J' if request.search is None else 'payload [kg]'
    return [ReportTable(
        title=f'Kinds of motion, from {report.kind_starts} starts',
        columns=(unit, 'how it moves', 'met'),
        rows=tuple((f'{value:.6g}', str(words), str(count)) for value, words, count in rows))]


def _warnings(report: Any) -> list[ReportTable]:
    """Return what is to be known of the plan; none where there is nothing."""
    kinds = getattr(report, 'warning_kinds', ())  # older reports do not have them
    told = _side_by_side(kinds, getattr(report, 'warnings', ()))
    rows = tuple((WarningKind[kind].value if kind in WarningKind.__members__ else str(kind),
                  str(sentence)) for kind, sentence in told)
    return [ReportTable(title='Warnings', rows=rows)] if rows else []


def _certificate(request: RecordedRequest) -> ReportTable:
    """Return the certificate with the limits that it was held against."""
    limits = {entry.name: getattr(CertificateLimits(), entry.name)
              for entry in fields(CertificateLimits)} | {'boundary_error': request.tolerance}
    rows = []
    for name, unit in _CERTIFICATE.items():
        value, limit = float(getattr(request.report, name, 0.0)), limits.get(name)
        if name == 'via_error' and not value:
            continue  # without via points, or older
        judged = '' if limit is None else 'passed' if value <= limit else 'FAILED'
        rows.append((name.replace('_', ' '), f'{value:.2e}{unit}',
                     '–' if limit is None else f'{limit:.0e}', judged))
    return ReportTable(title='Certificate when planned', columns=('', 'found', 'limit', ''),
                       rows=tuple(rows))


def _execution(request: RecordedRequest) -> list[ReportTable]:
    """Return what the controller makes of the trajectory, also on arms that differ."""
    certificate, robustness = recorded_execution(request), recorded_robustness(request)
    if certificate is None:
        return []
    found = [ReportTable(title='Published trajectory, carried out', rows=tuple(
        execution_rows(certificate, request.arm)))]
    if robustness is not None and request.arm.n_modes:
        found.append(ReportTable(title='Residual vibration with feedback if ...', rows=tuple(
            vibrations(robustness, request.arm))))
    return found


def _joints(request: RecordedRequest) -> ReportTable:
    """Return the peak torques and speeds of the motors."""
    report, n = request.report, request.arm.n_joints
    columns = [values if len(values) == n else np.full(n, np.nan) for values in (
        report.peak_torques, report.peak_torque_shares, report.peak_speeds,
        report.peak_speed_shares, report.saturation)]
    units = [units_of(joint) for joint in request.arm.joints]
    rows = zip(request.joint_names, units, *columns, strict=True)
    return ReportTable(
        title='Motors', columns=('', 'peak torque', 'of its limit', 'peak speed',
                                 'of no-load speed', 'time on its limit'),
        rows=tuple((name, f'{torque:.4g} {unit.torque}', _percent(part),
                    f'{speed:.4g} {unit.speed}', _percent(share), _percent(full))
                   for name, unit, torque, part, speed, share, full in rows))


def _frequencies(frequencies: NaturalFrequencies) -> ReportTable:
    """Return the natural frequencies of the arm with the payload of the plan."""
    pairs = zip(frequencies.free, frequencies.locked, strict=True)
    return ReportTable(
        title='Natural frequencies over the postures of the motion [Hz]',
        columns=('', 'joints free (marked in the spectra)', 'joints locked'),
        rows=tuple((f'f{k}', _span(*free), _span(*locked))
                   for k, (free, locked) in enumerate(pairs, 1)))


def _search(search: Any, report: Any) -> ReportTable:
    """Return method and result of the search for the maximum payload."""
    bent = getattr(report, 'barrier_gap', 0.0) > 0  # by limits on the way
    ends = 'within the limits on the way it ended near' if bent else 'this kind of motion ends at'
    return ReportTable(title='Search for the maximum payload', rows=(
        ('method', 'payload as an unknown at a rising price' if search.method == search.DIRECT
         else 'payload raised step by step'),
        ('largest payload', f'{search.payload:.6g} kg'),
        (ends if search.method == search.DIRECT
         else 'no motion was found with', f'{search.payload_upper:.6g} kg'),
        ('proved', search.proof or '–'),
        ('accuracy asked for', f'{search.payload_accuracy:g} kg'),
        ('limiting joint', '–' if search.limiting_joint < 0 else
         f'{search.limiting_joint + 1}{", which can hold no more" if search.held else ""}')))


def _trials(search: Any) -> list[ReportTable]:
    """Return the payloads that the search solved or tried."""
    found = []
    if len(search.front_payloads):
        front = _side_by_side(search.front_payloads, search.front_efforts, search.front_prices)
        found.append(ReportTable(title='Effort and price of each payload',
                                 columns=('payload [kg]', 'J [N²m²s]', 'dJ/dm [N²m²s/kg]'),
                                 rows=tuple(_cells(row) for row in front)))
    if len(search.tried_payloads):
        tried = _side_by_side(search.tried_payloads, search.tried_solved, search.tried_errors)
        rows = ((f'{payload:.6g}', 'yes' if solved == 1 else 'no', f'{error:.2g}')
                for payload, solved, error in tried)
        found.append(ReportTable(title='Payloads tried', rows=tuple(rows),
                                 columns=('payload [kg]', 'carried', 'boundary error')))
    return found


def _objectives(report: Any) -> ReportTable:
    """Return the weights tried for the objectives."""
    tried = _side_by_side(report.tried_objectives, report.tried_weights, report.tried_shares)
    return ReportTable(title='Weights tried for the objectives',
                       columns=('objective', 'weight', 'share of the limit'),
                       rows=tuple((str(name), f'{weight:.5g}', f'{share:.4f}')
                                  for name, weight, share in tried))


def _left_out(request: RecordedRequest) -> list[ReportTable]:
    """Return what the recording holds besides, if there is anything."""
    rows = tuple((channel.name, str(channel.message_count), channel.reason)
                 for channel in request.left_out)
    return [ReportTable(title='Not read', columns=('topic', 'messages', ''), rows=rows)
            ] if rows else []


def _settings(request: RecordedRequest) -> ReportTable:
    """Return the planner's parameters."""
    return ReportTable(title='Parameters of the planner', rows=tuple(
        (name, ', '.join(map(str, value)) if isinstance(value, Sequence)
         and not isinstance(value, str) else str(value))
        for name, value in request.settings.items()))


def _side_by_side(*columns: Sequence[Any]) -> Iterable[tuple[Any, ...]]:
    """Return rows; where a column is shorter, as older planners have it, there is no number."""
    return zip_longest(*columns, fillvalue=np.nan)


def _percent(share: float) -> str:
    return f'{share:.1%}' if np.isfinite(share) else '–'


def _span(low: float, high: float) -> str:
    """Return a range, or the one number that it is."""
    ends = [f'{value:.4g}' for value in (low, high)]
    return ends[0] if ends[0] == ends[1] else ' to '.join(ends)


def _cells(row: Iterable[float]) -> Cells:
    return tuple(f'{value:.6g}' for value in row)
