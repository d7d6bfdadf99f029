"""
Motions of published arms and of one from data sheets: what is planned, and how long it takes.

T is the shortest time of the same arm made rigid, P the period of its lowest mode with the joints
held. A motion takes ``max(3 T, 1.5 P)`` (moderate), ``1.2 T + P / 2`` (fast), ``2 T + P`` (long)
or ``2.5 T + P`` (with a load). Each is planned in a process of its own, with one and two modes a
link.

"""

from __future__ import annotations

from collections.abc import Sequence
import json
import resource
import subprocess
import sys
from typing import Any

from flex_planner import Arm, find_min_duration, load_arm, Monitor, plan_path, Task
from flex_planner.base.errors import FlexPlannerError
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.simulation.mismatch import Mismatch
import numpy as np

LIMITS = (1.0, 3.0, 10.0, 60.0)
_DURATIONS = {'moderate': (3.0, 0.0), 'fast': (1.2, 0.5), 'long': (2.0, 1.0), 'load': (2.5, 1.0)}
# start and goal [deg] of the moderate, fast and loaded motion; of the long one; the load [kg]
ARMS: dict[str, tuple[list[list[float]], list[list[float]], float]] = {
    'asen_single': ([[0], [45]], [[-75], [75]], 0.05),
    'space_beam': ([[0], [30]], [[-60], [60]], 30.0),
    'rome_flexarm': ([[0, 30], [45, 60]], [[-90, -45], [60, 45]], 0.3),
    'muroran_vertical': ([[0, 45], [40, 80]], [[-70, 30], [70, 90]], 0.5),
    'mamedov_horizontal': ([[0, 45], [40, 80]], [[-70, 30], [70, 90]], 0.25),
    'desk_arm': ([[-90, 0], [-60, 30]], [[-90, 30], [0, 60]], 0.3)}


def jobs() -> list[tuple[str, int, str]]:
    """Return arms, numbers of modes and kinds of motion."""
    return [(name, modes, kind) for name in ARMS for modes in (1, 2) for kind in _DURATIONS]


def job_task(name: str, modes: int, kind: str) -> Task:
    """Return a motion."""
    short, far, load = ARMS[name]
    start, goal = np.deg2rad(far if kind == 'long' else short)
    payload = load if kind == 'load' else 0.0
    arm = Mismatch(modes=modes).apply(load_arm(name))
    rigid = Task(arm=arm.rigid(), start_positions=start, goal_positions=goal, duration=1.0,
                 payload_mass=payload)
    shortest, period = find_min_duration(rigid).duration, _period(arm, start, payload)
    of_shortest, of_period = _DURATIONS[kind]
    duration = of_shortest * shortest + of_period * period
    if kind == 'moderate':
        duration = max(duration, 1.5 * period)
    return Task(arm=arm, start_positions=start, goal_positions=goal, duration=duration,
                payload_mass=payload, allow_large_bending=True)


def _period(arm: Arm, posture: Any, payload: float) -> float:
    """Return the period of the lowest mode with the joints held [s]."""
    model, parameters = ArmModel.of(arm), Parameters.of(arm, payload_mass=payload)
    rest, _ = equilibrium(model, posture, parameters)
    return float(2 * np.pi / np.nanmin(natural_modes(model, rest, parameters, locked=True)[0]))


def cpu_seconds() -> float:
    """Return the CPU time of this process and of helpers that have ended."""
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def report(name: str, modes: int, kind: str) -> None:
    """Plan a motion once its functions are compiled, and print figures as JSON."""
    task = job_task(name, modes, kind)
    ArmModel.of(task.arm).prepare()
    began = cpu_seconds()
    row: dict[str, Any] = {'arm': name, 'modes': modes, 'motion': kind,
                           'duration': task.duration}
    try:
        plan = plan_path(task, monitor=Monitor(time_limit=LIMITS[-1]))
        row |= {'status': plan.status.name, 'wall': plan.planning_time, 'strategy': plan.strategy,
                'intervals': plan.mesh_intervals, 'cost': plan.cost if plan.solved else None}
    except FlexPlannerError as error:
        row |= {'status': type(error).__name__, 'wall': 0.0, 'strategy': str(error),
                'intervals': 0, 'cost': None}
    print(json.dumps({**row, 'cpu': cpu_seconds() - began}))


def measure() -> list[dict[str, Any]]:
    """Return the figures of all motions."""
    rows = []
    for job in jobs():
        code = f'from bench.battery import report; report{job}'
        done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True,
                              text=True)
        rows.append(json.loads(done.stdout.splitlines()[-1]))
        print(rows[-1], flush=True)
    return rows


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return the figures as Markdown, with shares of success first."""
    solved = [row for row in rows if row['status'] == 'SOLVED']
    shares = ', '.join(f'{sum(row["wall"] <= limit for row in solved)} within {limit:g} s'
                       for limit in LIMITS)
    lines = [f'{len(solved)} of {len(rows)} are solved: {shares}.', '',
             '| arm | modes | motion | duration [s] | outcome | time [s] | CPU [s] | strategy '
             '| intervals |', f'|{"---|" * 9}']
    for row in rows:
        outcome = 'solved' if row['status'] == 'SOLVED' else row['status']
        strategy = row['strategy'] if row['status'] == 'SOLVED' else '-'
        lines.append(f'| {row["arm"]} | {row["modes"]} | {row["motion"]} | {row["duration"]:.3g} '
                     f'| {outcome} | {row["wall"]:.2f} | {row["cpu"]:.2f} | {strategy} '
                     f'| {row["intervals"]} |')
    return '\n'.join(lines)
