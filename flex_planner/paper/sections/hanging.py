"""Section 5.1, fig. 4: the arm swings under gravity, and stiffens into the rigid one."""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.colours import COORDINATES
from flex_planner.base.validation import Array
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.ipopt import DirectProblem, DirectSettings
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.paper.evidence import Claim, judge, Section, Table
from flex_planner.plotting.diagrams import Curve, Panel, Picture
import numpy as np
from scipy.integrate import solve_ivp

START = (-1.5, -0.5)  # [rad]
_DURATION, _POINTS = 2.0, 401
_RIGIDITIES = (100.0, 20.0, 5.0)
_CHECKED = 0.5  # [s] of the swing that IPOPT repeats
_INTERVALS = 60
_SMALL = 0.01  # of the swing
_RTOL = 1e-10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Swing:
    """Free motion: times (k,) and states (k, 2 n_t); `drift` of its energy over its range."""

    times: Array
    states: Array
    drift: float


def swing(model: ArmModel, rigidity: float | None = None, duration: float = _DURATION) -> Swing:
    """Return the free motion from rest, with links of a flexural rigidity [N m^2]."""
    parameters = Parameters.of(model.arm)
    if rigidity is not None:
        parameters = replace(parameters, rigidity=np.full(2, rigidity))
    p, start = parameters.physical, np.zeros(2 * model.arm.n_coordinates)
    start[:2] = START
    rate, none = model.state_rate(p), np.zeros(2)
    times = np.linspace(0, duration, round((_POINTS - 1) * duration / _DURATION) + 1,
                        dtype=np.float64)
    motion = solve_ivp(lambda t, x: rate(x, none).copy(), (0, duration), start, method='DOP853',
                       t_eval=times, rtol=_RTOL, atol=_RTOL / 100)
    states: Array = motion.y.T.copy()
    _, kinetic, potential = model.mass_and_energy(states, p)
    return Swing(times=times, states=states,
                 drift=float(np.ptp(kinetic + potential) / np.ptp(kinetic)))


def study(*, reduced: bool = False) -> Section:
    """Return the evidence on section 5.1."""
    model = ArmModel(load_arm('korayem_hanging'))
    rigid = swing(ArmModel(model.arm.rigid()))
    swings = {rigidity: swing(model, rigidity)
              for rigidity in (_RIGIDITIES[:1] if reduced else _RIGIDITIES)}
    away = {rigidity: np.abs(one.states[:, :2] - rigid.states[:, :2]).max(axis=0)
            for rigidity, one in swings.items()}
    range_ = np.ptp(rigid.states[:, :2], axis=0)
    torque, gap = _repeat_by_ipopt(model)
    values = {f'hanging_deviation_{rigidity:g}_joint_{joint + 1}': float(one[joint])
              for rigidity, one in away.items() for joint in range(2)}
    values |= {'hanging_ipopt_torque': torque, 'hanging_ipopt_gap': gap,
               'hanging_energy_drift': max(one.drift for one in swings.values())}
    share = float((away[100.0] / range_).max())
    return Section(
        key='5.1', title='The model: rigid and flexible arm, hanging',
        text='The arm of Table I with two pinned-pinned modes per link is let go at rest at '
        'theta = (-1.5, -0.5) rad from the horizontal, in a vertical plane, and swings for 2 s '
        '(DOP853, relative tolerance 1e-10).',
        tables=(_table(swings, away, values['hanging_energy_drift']),),
        claims=(Claim(
            said='With EI = 100 the flexible arm moves very nearly as the rigid one.',
            found=f'Over 2 s the joints are never further apart than {away[100.0][0] * 1e3:.1f} '
            f'and {away[100.0][1] * 1e3:.1f} mrad, {share:.1%} of their swing at most'
            + ('' if reduced else '; softer links depart further, in proportion to 1/EI')
            + f'. IPOPT, asked for the motion of least effort between two states of the swing '
            f'{_CHECKED:g} s apart, finds the swing: torques below {max(torque, 1e-12):.0e} N m, '
            f'joints within {gap:.0e} rad.',
            verdict=judge(share < _SMALL)),),
        pictures=(_picture(rigid, swings),), values=values)


def _repeat_by_ipopt(model: ArmModel) -> tuple[float, float]:
    """
    Return the torque and the error of the joints of a swing that IPOPT was to repeat.

    The motion of least effort between two states of a free motion is the free motion itself.

    """
    parameters, part = Parameters.of(model.arm), swing(model, duration=_CHECKED)
    direct = DirectProblem(model, DirectSettings(degree=8, intervals=_INTERVALS))
    found = direct.solve(parameters, part.states[0], part.states[-1], _CHECKED)
    if not found.converged:
        return np.inf, np.inf
    middle = part.states[(part.times.size - 1) // 2, :2]
    gap = np.abs(found.states[_INTERVALS // 2, :2] - middle).max()
    return float(np.abs(found.torques).max()), float(gap)


def _table(swings: dict[float, Swing], away: dict[float, Array], drift: float) -> Table:
    rows = tuple((f'{rigidity:g}', f'{one[0] * 1e3:.2f}', f'{one[1] * 1e3:.2f}')
                 for rigidity, one in away.items())
    return Table(title='Largest distance from the rigid arm over 2 s; energy is kept to '
                 f'{drift:.0e} of its exchange',
                 header=('EI [N m^2]', 'joint 1 [mrad]', 'joint 2 [mrad]'), rows=rows)


def _picture(rigid: Swing, swings: dict[float, Swing]) -> Picture:
    panels = []
    for joint in range(2):
        curves = [Curve(x=rigid.times, y=rigid.states[:, joint], label='rigid', color='black')]
        curves += [Curve(x=one.times, y=one.states[:, joint], label=f'EI = {rigidity:g} N m^2',
                         color=COORDINATES[k], style='--')
                   for k, (rigidity, one) in enumerate(swings.items())]
        panels.append(Panel(title=f'joint {joint + 1}', x_label='time [s]',
                            y_label='angle [rad]', curves=tuple(curves)))
    for joint in range(2):
        curves = [Curve(x=one.times, color=COORDINATES[k], label=f'EI = {rigidity:g} N m^2',
                        y=(one.states[:, joint] - rigid.states[:, joint]) * 1e3, style='--')
                  for k, (rigidity, one) in enumerate(swings.items())]
        panels.append(Panel(title=f'joint {joint + 1}, flexible less rigid', x_label='time [s]',
                            y_label='angle [mrad]', curves=tuple(curves)))
    return Picture(name='fig04', panels=tuple(panels), caption='As fig. 4: joint angles of the '
                   'hanging arm, rigid and flexible; below, their difference')
