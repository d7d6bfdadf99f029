"""Results of planning as tables of text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import sys

from flex_planner.arms.spatial_joint import slides
from flex_planner.base.text import printable
from flex_planner.capacity.results import MaxPayload
from flex_planner.optimal_control.via_points import say_via_points
from flex_planner.planning.certificate import Certificate
from flex_planner.planning.kinds.clusters import KindOfMotion
from flex_planner.planning.plan import Peaks, Plan
from flex_planner.planning.warnings import PlanWarning
from flex_planner.reports.limits import limit_rows
import numpy as np

Row = tuple[str, str]

_NAMES = 26


def table(rows: Iterable[Row]) -> str:
    """Return names and values as lines of text, a line each."""
    return '\n'.join(f'{name:<{_NAMES}} {printable(value, sys.maxsize)}' for name, value in rows)


def columns(names: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return lines of cells, each column as wide as it needs to be."""
    lines = [names, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return '\n'.join('   '.join(f'{cell:>{width}}' for cell, width in zip(
        line, widths, strict=True)) for line in lines)


def planning_row(seconds: float, *details: str) -> Row:
    """Return the time that planning took, with details."""
    return 'planned in', f'{seconds:.2f} s ({", ".join(detail for detail in details if detail)})'


def joint_rows(speeds: Sequence[float], speed_shares: Sequence[float], torques: Sequence[float],
               torque_shares: Sequence[float], sliding: Sequence[bool] = ()) -> list[Row]:
    """
    Return the peaks of each joint, see `Peaks`; a share of 0 means that there is no limit.

    Joints turn, unless `sliding` says of each whether it slides.

    """
    peaks = zip(speeds, speed_shares, torques, torque_shares,
                sliding or [False] * len(speeds), strict=True)
    return [(f'joint {i}', f'peak speed {speed:.3f} {"m/s" if slide else "rad/s"}'
                           f'{_share("", part, "no-load speed")}, '
                           f'peak {"force" if slide else "torque"} {torque:.3f} '
                           f'{"N" if slide else "N m"}{_share("up to ", full, "its limit")}')
            for i, (speed, part, torque, full, slide) in enumerate(peaks, 1)]


def _share(before: str, share: float, whole: str) -> str:
    return f' ({before}{share:.0%} of {whole})' if share else ''


def certificate_rows(certificate: Certificate) -> list[Row]:
    """Return the residuals of a plan; the message of a report has the same entries."""
    return [
        ('certificate', 'every plan is checked by independent means'),
        ('  collocation residual', f'{certificate.collocation_residual:.1e}'),
        ('  boundary error', f'{certificate.boundary_error:.1e}'),
        ('  Hamiltonian drift', f'{certificate.hamiltonian_drift:.1e}'),
        ('  re-simulated tip error', f'{certificate.tip_error * 1e3:.1e} mm'),
        ('  residual vibration', f'{certificate.residual_vibration * 1e3:.1e} mm'),
        *via_rows(certificate)]


def via_rows(certificate: Certificate) -> list[Row]:
    """Return by how much via points are missed; empty without any, and of older reports."""
    error = getattr(certificate, 'via_error', 0.0)
    return [('  via points missed by', f'{error * 1e3:.1e} mm')] if error else []


def plan_rows(plan: Plan) -> list[Row]:
    """Return how planning a task ended; see `motion_rows` for the motion."""
    intervals = f'{plan.mesh_intervals} intervals' if plan.mesh_intervals else ''
    rows = [('status', plan.status.value),
            planning_row(plan.planning_time, plan.strategy, f'{plan.iterations} iterations',
                         intervals)]
    rows += tried_rows(plan)
    rows += kind_rows(plan.kinds, plan.starts, 'J = ', '')
    return [*rows, *objective_rows(plan), *warning_rows(plan.warnings)]


def tried_rows(plan: Plan) -> list[Row]:
    """Return what was tried before, and for how long; empty if the first strategy did it."""
    seconds: dict[str, float] = {}
    for one in plan.tried:
        seconds[one.name] = seconds.get(one.name, 0.0) + one.seconds
    if len(seconds) < 2:
        return []
    return [('tried', ', '.join(f'{name} took {time:.2f} s' for name, time in seconds.items()))]


def motion_rows(plan: Plan, peaks: Peaks) -> list[Row]:
    """Return cost, peaks and certificate of a motion."""
    return [
        ('cost J', f'{plan.cost:.6g}'),
        ('effort', f'{plan.effort:.6g} N^2 m^2 s, the integral of the squared torques'),
        ('energy', f'{plan.energy:.6g} J, the integral of the absolute power'),
        *joint_rows(*(list(values) for values in (
            peaks.speeds, peaks.speed_shares, peaks.torques, peaks.torque_shares,
            map(slides, plan.arm.joints)))),
        ('motors on their limit', _saturation(plan)),
        *torque_rate_rows(plan.torque_rates.tolist(), list(map(slides, plan.arm.joints))),
        *(('passes', sentence) for sentence in say_via_points(plan.task.via_points,
                                                              plan.via_times)),
        *limit_rows(plan),
        *certificate_rows(plan.certificate)]


def torque_rate_rows(rates: Sequence[float], sliding: Sequence[bool] = ()) -> list[Row]:
    """Return the largest rates of torques without jumps; empty where torques may jump."""
    if not len(rates):
        return []
    each = ', '.join(f'joint {i} {rate:.4g} {"N/s" if slide else "N m/s"}' for i, (
        rate, slide) in enumerate(zip(rates, sliding or [False] * len(rates), strict=True), 1))
    return [('largest torque rates', f'{each}; no jumps, from and to the torques that hold the '
             'arm where it rests')]


def list_failures(text: str, plan: Plan) -> str:
    """Return a sentence about a plan with each strategy that failed on a line of its own."""
    for name in dict.fromkeys(one.name for one in plan.tried):
        text = text.replace(f'; {name}: ', f'\n  {name}: ')
    return text


def kind_rows(kinds: Sequence[KindOfMotion], starts: int, before: str, after: str) -> list[Row]:
    """Return the kinds of motion that were met, the best first, with what each is worth."""
    if not kinds:
        return []
    rows = [('kinds of motion', f'{len(kinds)} found from {starts} starts')]
    return rows + [(f'  kind {i}', f'{before}{kind.value:.6g}{after}: {kind.sentence} (met '
                                   f'{"once" if kind.met == 1 else f"{kind.met} times"})')
                   for i, kind in enumerate(kinds, 1)]


def _saturation(plan: Plan) -> str:
    """Return the shares of the time that the motors spend on their limits."""
    if not plan.saturation.any():
        return 'never'
    shares = ', '.join(f'joint {i} {share:.1%}' for i, share in enumerate(plan.saturation, 1))
    count = plan.switching_times.size
    return f'{shares} of the time; {count} switching time{"" if count == 1 else "s"}'


def warning_rows(warnings: Sequence[PlanWarning]) -> list[Row]:
    """Return the sentence of each warning."""
    return [('warning', one.sentence) for one in warnings]


def objective_rows(plan: Plan) -> list[Row]:
    """Return the weights that meet the objectives of a plan; empty if it has none."""
    search = plan.objectives
    if search is None or not search.objectives.limited(plan.arm):
        return []
    if not search.trials:
        return [('objectives', 'met with the weights of the task')]
    rows = [('objectives', 'met by the smallest weights' if search.met else 'not met')]
    rows += [(f'  {margin.objective.value}', f'weight {margin.weight:.4g}: {margin.share:.2%} of '
              f'the limit; {margin.relaxed_weight:.4g}: {margin.relaxed_share:.2%}')
             for margin in search.margins]
    return rows


def weights_table(plan: Plan) -> str:
    """Return the weights tried, as lines of text; empty if there are none."""
    if plan.objectives is None or not plan.objectives.trials:
        return ''
    return columns(['trial', 'objective', 'weight', 'share of the limit', 'met'], [
        [str(i), trial.objective.value, f'{trial.weight:.5g}', f'{trial.share:.4f}',
         'yes' if trial.met else 'no'] for i, trial in enumerate(plan.objectives.trials, 1)])


def payload_rows(found: MaxPayload) -> list[Row]:
    """Return the result of a search for the maximum payload; see `motion_rows` for the motion."""
    rows = [('status', found.status.value), ('method', found.method.value),
            planning_row(found.planning_time, f'{found.iterations} iterations'),
            ('largest payload', _bracket(found))]
    if found.limiting_joint is not None and _limiting_share(found) > 0:
        rows.append(('limited by', _limit(found)))
    if np.isfinite(found.proved_upper):
        rows.append(('proved', f'no motion carries more than {found.proved_upper:.6g} kg '
                               f'({found.proof})'))
    rows += kind_rows(found.kinds, found.starts, '', ' kg')
    rows += warning_rows(found.warnings)
    if found.plan is not None and found.plan.solution is not None:
        rows.append(('strategy of the motion', found.plan.strategy))
    return rows


def _bracket(found: MaxPayload) -> str:
    """Return the bracket of the largest payload."""
    below = f'{found.payload:.6g} kg' if found.payload else 'none found'
    if not np.isfinite(found.local_upper):
        return below
    if found.held:
        return f'{below}; {found.local_upper:.6g} kg cannot be held at the goal'
    if found.trials:
        return f'{below}; no solution at {found.local_upper:.6g} kg'
    if found.within_limits:
        return f'{below}; {found.upper_means} {found.local_upper:.6g} kg, which is no bound'
    return f'{below}; this kind of motion ends at {found.local_upper:.6g} kg'


def _limit(found: MaxPayload) -> str:
    """Return the motor that limits the payload."""
    assert found.limiting_joint is not None
    share = _limiting_share(found)
    reason = ('which can hold no more at the goal' if np.isinf(share) else
              f'on its limit for {share:.1%} of the time')
    return f'the motor of joint {found.limiting_joint + 1}, {reason}'


def search_table(found: MaxPayload) -> str:
    """Return the payloads solved or tried, as lines of text; empty if there are none."""
    front = found.front
    if front.payloads.size:
        priced = zip(front.payloads, front.efforts, front.prices, strict=True)
        return columns(['payload [kg]', 'J [N^2 m^2 s]', 'dJ/dm_p [N^2 m^2 s/kg]'], [
            [f'{payload:.6f}', f'{effort:.6f}', f'{price:.4g}']
            for payload, effort, price in priced])
    if found.trials:
        return columns(['trial', 'payload [kg]', 'step [kg]', 'carried', 'boundary error'], [
            [str(i), f'{trial.payload:.6f}', f'{trial.step:.6f}', 'yes' if trial.solved else 'no',
             f'{trial.boundary_error:.1e}'] for i, trial in enumerate(found.trials, 1)])
    return ''


def _limiting_share(found: MaxPayload) -> float:
    """Return for which share of the time the limiting motor is on its limit; inf if it holds."""
    assert found.limiting_joint is not None
    if found.held or found.plan is None:
        return np.inf
    return float(found.plan.saturation[found.limiting_joint])
