"""Beyond the paper, on the same arm: what its method did not show."""

from __future__ import annotations

import math

from flex_planner.base.colours import COORDINATES
from flex_planner.base.validation import Array
from flex_planner.capacity.min_duration import payload_against_duration
from flex_planner.optimal_control.task import Task
from flex_planner.paper.cases import (
    find_largest,
    NoPlanError,
    paper_arm,
    plan_certified,
    point_to_point,
    require_solved,
    STIFFNESS_LIMITS,
)
from flex_planner.paper.evidence import Claim, judge, Section, Table
from flex_planner.plotting.diagrams import Curve, MODE_COLOURS, OPEN_LOOP, Panel, Picture
from flex_planner.simulation.comparison import compare
from flex_planner.simulation.execution import ExecutionMode, ExecutionResult
import numpy as np

_GRID = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5)  # [kg]
_DURATIONS: Array = np.linspace(1.4, 0.7, 15, dtype=np.float64)  # [s]
_SOFT = 5.0  # [N m^2]
_HARDLY, _FEW = 0.98, 1e-3
_MODES = (ExecutionMode.FLEXIBLE_OPEN, ExecutionMode.RIGID_OPEN, ExecutionMode.FLEXIBLE,
          ExecutionMode.RIGID, ExecutionMode.PD_ONLY)


def front(*, reduced: bool = False) -> Section:
    """Return the least effort of each payload, and the largest payload for each duration."""
    arms = {'rigid': paper_arm(math.inf), f'EI = {_SOFT:g} N m^2': paper_arm(_SOFT, 1)}
    fronts = [_front(point_to_point(arm, 1.0), name, COORDINATES[k])
              for k, (name, arm) in enumerate(arms.items())]
    durations = _DURATIONS[2::4] if reduced else _DURATIONS
    limits = [_against_duration(point_to_point(arm, 1.0), durations, name, COORDINATES[k])
              for k, (name, arm) in enumerate(arms.items())]
    rows = tuple((f'{duration:.2f}', *(f'{curve.y[k]:.4f}' for curve in limits))
                 for k, duration in enumerate(limits[0].x))
    return Section(
        key='6.1', title='Beyond the paper: payload, effort and duration',
        text='One search gives the front: the least effort of every payload up to the largest, '
        'where its price dJ/dm_p grows without bound. Searches for other durations start from '
        'their neighbour. Links that bend have one pinned-pinned mode each.',
        tables=(Table(title='Largest payload [kg] against the duration', rows=rows,
                      header=('duration [s]', *arms)),),
        pictures=(Picture(name='front', caption='Least effort of each payload in 1 s, and the '
                          'largest payload against the duration', panels=(
                              Panel(title='payload-effort front', x_label='payload [kg]',
                                    y_label='J [N^2 m^2 s]', curves=tuple(fronts)),
                              Panel(title='largest payload', x_label='duration [s]',
                                    y_label='payload [kg]', curves=tuple(limits)))),),
        values={f'payload_in_{duration:.2f}_s': float(payload)
                for duration, payload in zip(limits[0].x, limits[0].y, strict=True)})


def _front(task: Task, name: str, color: str) -> Curve:
    """Return the least effort of light payloads and of those that the search met."""
    found = find_largest(task).front
    light = [(payload, plan_certified(point_to_point(task.arm, payload)).cost)
             for payload in _GRID]
    heavy = [(float(payload), float(effort))
             for payload, effort in zip(found.payloads, found.efforts, strict=True)
             if payload > _GRID[-1]]
    points = np.array(light + heavy)
    return Curve(x=points[:, 0], y=points[:, 1], label=name, color=color, style='.-')


def _against_duration(task: Task, durations: Array, name: str, color: str) -> Curve:
    found = [require_solved(one) for one in payload_against_duration(task, durations)]
    return Curve(x=np.array([one.task.duration for one in found]),
                 y=np.array([one.payload for one in found]), label=name, color=color, style='.-')


def clamped_links(*, reduced: bool = False) -> Section:
    """Return the largest payloads of links that are clamped to their hubs, as real ones are."""
    rigidities = () if reduced else tuple(
        rigidity for rigidity in STIFFNESS_LIMITS if not math.isinf(rigidity))
    pinned = {rigidity: find_largest(point_to_point(paper_arm(rigidity, 1), 1.0))
              for rigidity in rigidities}
    built_in = {rigidity: find_largest(point_to_point(paper_arm(rigidity, 1, 'clamped_free'), 1.0))
                for rigidity in rigidities}
    light = plan_certified(point_to_point(paper_arm(50.0, 1, 'clamped_free'), 1.0))
    rows = tuple((f'{rigidity:g}', f'{STIFFNESS_LIMITS[rigidity]:g}',
                  f'{pinned[rigidity].payload:.4f}',
                  f'{found.payload:.4f} - {found.local_upper:.4f}')
                 for rigidity, found in built_in.items())
    values = {f'clamped_limit_{rigidity:g}': one.payload for rigidity, one in built_in.items()}
    values['clamped_cost'] = light.cost
    return Section(
        key='6.2', title='Beyond the paper: clamped links',
        text='Pinned-pinned shapes keep the tip on the chord, and leave out the work of the '
        'torque on the slope at the hub. Clamped-free shapes do neither. One mode per link; two '
        'modes are not solved at the limit. The softer links would bend by more than 0.3 of their '
        'length, beyond which their shapes do not hold: the payload ends where they bend so far.',
        tables=(Table(title='Table V with both kinds of shapes', rows=rows, header=(
            'EI [N m^2]', 'paper [kg]', 'pinned-pinned [kg]', 'clamped-free [kg]')),)
        if rows else (),
        claims=(Claim(
            said='Flexibility hardly changes what the arm carries (Table V).',
            found='With links of 5 N m^2 clamped to their hubs the arm carries '
            f'{built_in[_SOFT].payload:.2f} kg within what its shapes hold, not '
            f'{pinned[_SOFT].payload:.2f} kg. What Table V shows is a property of the shapes.',
            verdict=judge(
                built_in[_SOFT].payload > _HARDLY * pinned[_SOFT].payload)),) if rows else (),
        values=values)


def feedforward(*, reduced: bool = False) -> Section:
    """Return the benefit of planning with flexible links on a flexible arm."""
    comparison = compare(point_to_point(paper_arm(_SOFT), 1.0))
    if not comparison.solved:
        raise NoPlanError(f'{comparison.flexible.message}; {comparison.rigid.message}')
    results = {mode: comparison.of(mode) for mode in _MODES}
    rows = tuple((mode.value, f'{one.arrival_error * 1e3:.3g}', f'{one.final_error * 1e3:.3g}',
                  f'{one.residual.tip * 1e3:.3g}') for mode, one in results.items())
    flexible, rigid = results[ExecutionMode.FLEXIBLE_OPEN], results[ExecutionMode.RIGID_OPEN]
    return Section(
        key='6.3', title='Beyond the paper: rigid and flexible feedforward',
        text='The motion of section 5.2 with 1 kg, planned with rigid and with flexible links '
        f'(EI = {_SOFT:g} N m^2, two modes), carried out on the flexible arm; controller at '
        '1 kHz, 1 s after the arrival is watched.',
        tables=(Table(title='The tip on the flexible arm', rows=rows, header=(
            'mode', 'error on arrival [mm]', 'error after 1 s [mm]',
            'motion after arrival, peak to peak [mm]')),),
        claims=(Claim(
            said='The torques of a plan may be used as feedforward of flexible arms.',
            found=f'Open loop the tip arrives {flexible.arrival_error * 1e3:.2g} mm from the '
            f'goal; planned with rigid links {rigid.arrival_error * 1e3:.2g} mm.',
            verdict=judge(flexible.arrival_error < rigid.arrival_error / 100)),),
        pictures=(_distances(results, comparison.goal),),
        values={'flexible_error': flexible.arrival_error, 'rigid_error': rigid.arrival_error})


def _distances(results: dict[ExecutionMode, ExecutionResult], goal: Array) -> Picture:
    curves = []
    for mode, one in results.items():
        execution = one.execution
        after = execution.times >= one.arrival
        distance = np.linalg.norm(execution.tip[after] - goal, axis=1) * 1e3
        curves.append(Curve(x=execution.times[after] - one.arrival, label=mode.value,
                            y=np.maximum(distance, 1e-4), color=MODE_COLOURS[mode],
                            style='--' if mode in OPEN_LOOP else '-'))
    return Picture(name='feedforward', columns=1, caption='Distance of the tip from the goal '
                   'after its arrival', panels=(Panel(
                       title='distance of the tip from the goal', x_label='time after arrival [s]',
                       y_label='distance [mm]', curves=tuple(curves), log=True),))


def modes(*, reduced: bool = False) -> Section:
    """Return the results for growing numbers of modes."""
    counts = (1, 2) if reduced else (1, 2, 3, 4)
    costs = {count: plan_certified(point_to_point(paper_arm(_SOFT, count), 1.0)).cost
             for count in counts}
    limits = {count: find_largest(point_to_point(paper_arm(_SOFT, count), 1.0))
              for count in counts}
    rows = tuple((str(count), f'{costs[count]:.9f}', f'{one.payload:.5f} - {one.local_upper:.5f}')
                 for count, one in limits.items())
    return Section(
        key='6.4', title='Beyond the paper: how many modes',
        text=f'Pinned-pinned links of {_SOFT:g} N m^2.',
        tables=(Table(title='Least effort with 1 kg, and largest payload', rows=rows, header=(
            'modes per link', 'J', 'largest payload [kg]')),),
        claims=(Claim(
            said='Two modes per link are enough.',
            found=f'From one to two modes J with 1 kg changes by '
            f'{costs[2] / costs[1] - 1:.1e} of itself, the payload by '
            f'{(limits[2].payload - limits[1].payload) * 1e3:.1f} g'
            + ('.' if reduced else f'; from two to four by {costs[4] / costs[2] - 1:.1e} and '
               f'{(limits[4].payload - limits[2].payload) * 1e3:.1f} g.'),
            verdict=judge(abs(costs[counts[-1]] / costs[2] - 1) < _FEW)),),
        values={f'soft_cost_{count}_modes': cost for count, cost in costs.items()})
