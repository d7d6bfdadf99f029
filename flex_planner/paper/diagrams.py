"""The diagrams that the paper's pictures are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

from flex_planner.base.colours import ASIDE, COORDINATES
from flex_planner.base.validation import Array
from flex_planner.planning.plan import Samples
from flex_planner.plotting.diagrams import Curve, Panel
import numpy as np

Cases = Mapping[str, Samples]
POINTS = 1001


def joint_panels(cases: Cases, quantity: str) -> tuple[Panel, ...]:
    """Return one diagram per joint: ``angles``, ``speeds`` or ``torques`` with their bounds."""
    count = next(iter(cases.values())).torques.shape[1]
    return tuple(_joint_panel(cases, quantity, joint) for joint in range(count))


def _joint_panel(cases: Cases, quantity: str, joint: int) -> Panel:
    title, label = {'angles': ('angular position of joint', 'angle [deg]'),
                    'speeds': ('angular velocity of joint', 'velocity [rad/s]'),
                    'torques': ('torque of motor', 'torque [N m]')}[quantity]
    curves = []
    for k, (name, samples) in enumerate(cases.items()):
        curves.append(Curve(x=samples.times, y=_values(samples, quantity)[:, joint], label=name,
                            color=COORDINATES[k]))
        if quantity == 'torques':
            curves += _bounds(samples, joint, COORDINATES[k], last=k == len(cases) - 1)
    return Panel(title=f'{title} {joint + 1}', x_label='time [s]', y_label=label,
                 curves=tuple(curves))


def _values(samples: Samples, quantity: str) -> Array:
    n = samples.torques.shape[1]
    values: Array = {'angles': np.degrees(samples.coordinates[:, :n]),
                     'speeds': samples.rates[:, :n], 'torques': samples.torques}[quantity]
    return values


def _bounds(samples: Samples, joint: int, color: str, *, last: bool) -> list[Curve]:
    """Return the bounds of a motor at the speeds of a motion; one of them in the legend."""
    bounds = samples.lower_bounds[:, joint], samples.upper_bounds[:, joint]
    if not np.isfinite(bounds).all():
        return []
    curves = [Curve(x=samples.times, y=bound, color=color, style=':', width=0.9)
              for bound in bounds]
    if last:
        curves.append(Curve(x=np.zeros(0), y=np.zeros(0), label='bounds', color=ASIDE,
                            style=':', width=0.9))
    return curves


def tip_panel(cases: Cases, title: str = 'path of the tip') -> Panel:
    """Return the paths of the tip in the plane."""
    curves = [Curve(x=samples.tip[:, 0], y=samples.tip[:, 1], label=name, color=COORDINATES[k])
              for k, (name, samples) in enumerate(cases.items())]
    return Panel(title=title, x_label='x [m]', y_label='y [m]', curves=tuple(curves), equal=True)


def modal_panels(cases: Cases, names: Sequence[str], scale: float = 1e3) -> tuple[Panel, ...]:
    """Return a diagram for each modal displacement [mm] and each of its rates [mm/s]."""
    panels = []
    for kind, unit in (('displacement', 'mm'), ('rate', 'mm/s')):
        for j, name in enumerate(names):
            curves = []
            for k, (label, samples) in enumerate(cases.items()):
                n = samples.torques.shape[1]
                values = samples.coordinates if kind == 'displacement' else samples.rates
                curves.append(Curve(x=samples.times, y=values[:, n + j] * scale, label=label,
                                    color=COORDINATES[k]))
            panels.append(Panel(title=f'modal {kind}, {name}', x_label='time [s]',
                                y_label=f'{kind} [{unit}]', curves=tuple(curves)))
    return tuple(panels)


def runs_on_limit(samples: Samples, joint: int) -> list[tuple[float, float]]:
    """Return the intervals in which a motor is on its limit, as pairs of times [s]."""
    torque, limit = samples.torques[:, joint], samples.upper_bounds[:, joint]
    lower = samples.lower_bounds[:, joint]
    on = (torque > limit - 1e-9 * abs(limit)) | (torque < lower + 1e-9 * abs(lower))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]])))
    times = samples.times
    return [(float(times[a]), float(times[b - 1])) for a, b in pairwise(edges) if on[a]]
