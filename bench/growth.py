"""Growth of the cost of a plan with links and modes, and the time of its parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import json
import os
import statistics
import subprocess
import sys
import time

from bench.battery import cpu_seconds
from bench.model import uniform_arm
from bench.solver import paper_problem
from flex_planner import Arm, Monitor, Plan, plan_path, Task
from flex_planner.arms.arm import Motor
from flex_planner.base.processes import PROCESSES
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.collocation.equations import collocation_residual, factorise, linearise
from flex_planner.collocation.estimate import estimate_error
from flex_planner.collocation.mesh import defects
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.planning.certificate import certify
from flex_planner.planning.strategies.initial_guesses import cold_start
from flex_planner.planning.warnings import WarningKind
import numpy as np

SIZES = [(n, m) for n in range(1, 5) for m in range(5) if n * m <= 8]
TIME_LIMIT = 20.0
# of clamped links, lying and hanging: at most 12 coordinates; their limit is one of CPU time
CLAMPED = [(n, m, setting) for setting in ('horizontal', 'gravity') for n in range(1, 5)
           for m in range(4) if n * (1 + m) <= 12]
CLAMPED_LIMIT = 10.0
_GRAVITY = 9.81
# seconds of plans after which no more is measured
_ENOUGH = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Growth:
    """
    A plan of an arm of equal links.

    Memory is what the whole process took at most [MB]; CPU time that of the process and of its
    children that have ended [s].

    """

    links: int
    modes: int
    unknowns: int
    solved: bool
    strategy: str
    seconds: float
    iterations: int
    intervals: int
    memory: float
    setting: str = ''
    cpu: float = float('nan')


def growth_task(links: int, modes: int, setting: str = '') -> Task:
    """
    Return a motion whose torques do not saturate: every joint turns by 0.6 rad in 2 s.

    Links are pinned, or with a setting clamped: ``horizontal`` or, with weight, ``gravity``.

    """
    arm = uniform_arm(links, modes)
    strong = replace(arm.joints[0], motor=Motor(stall_torque=1e3))
    beams = tuple(replace(link, mode_family='clamped_free') if setting else link
                  for link in arm.links)
    arm = Arm(name=arm.name, links=beams, joints=(strong,) * links,
              gravity=[0.0, -_GRAVITY if setting == 'gravity' else 0.0])
    start = np.resize([0.5, -0.8], links)
    return Task(arm=arm, start_positions=start, goal_positions=start + 0.6, duration=2.0,
                payload_mass=1.0)


def measure(links: int, modes: int, setting: str = '') -> Growth:
    """Return a row, measured in a process of its own; of clamped links without helpers."""
    alone = {PROCESSES: '0'} if setting else {}  # so that its CPU time is all there is
    code = f'from bench.growth import report; report({links}, {modes}, {setting!r})'
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True,
                          text=True, env={**os.environ, **alone})
    return Growth(**json.loads(done.stdout.splitlines()[-1]))


def report(links: int, modes: int, setting: str = '') -> None:
    """Plan a few times and print a row as JSON."""
    task = growth_task(links, modes, setting)
    model = ArmModel(task.arm)
    plans: list[Plan] = []
    times: list[float] = []
    while len(plans) < 5 and sum(times) < _ENOUGH:
        began = time.perf_counter()
        plans.append(plan_path(task, model=model, monitor=_limit(setting)))
        times.append(time.perf_counter() - began)
    peak = next(line for line in open('/proc/self/status') if line.startswith('VmHWM'))
    last = plans[-1]
    print(json.dumps({
        'links': links, 'modes': modes, 'setting': setting, 'unknowns': 4 * task.arm.n_coordinates,
        'solved': last.solved, 'strategy': _how(last), 'iterations': last.iterations,
        'seconds': statistics.median(times), 'intervals': last.mesh_intervals,
        'cpu': statistics.median(plan.planning_time for plan in plans) if setting else np.nan,
        'memory': int(peak.split()[1]) / 1024}))


def _how(plan: Plan) -> str:
    """Return the strategy of a plan, and whether it changed what the task asked for."""
    priced = any(one.kind is WarningKind.PRICE_ON_BENDING for one in plan.warnings)
    return f'{plan.strategy}, which is left' if priced else plan.strategy


class _CpuMonitor(Monitor):
    """Counts CPU time from its creation instead of time."""

    @property
    def elapsed(self) -> float:
        """CPU time since creation [s]."""
        return cpu_seconds() - self.started


def _limit(setting: str) -> Monitor:
    """Return a monitor that ends a plan in time: of clamped links in CPU time."""
    if not setting:
        return Monitor(time_limit=TIME_LIMIT)
    return _CpuMonitor(time_limit=CLAMPED_LIMIT, started=cpu_seconds())


def table(rows: list[Growth]) -> str:
    """Return the rows as Markdown."""
    lines = ['| links x modes | unknowns | plan [s] | Newton iterations | intervals '
             '| strategy | memory of the process [MB] |', '|' + '---|' * 7]
    for row in rows:
        how = row.strategy if row.solved else 'not solved'
        lines.append(f'| {row.links} x {row.modes} | {row.unknowns} | {row.seconds:.3g} '
                     f'| {row.iterations} | {row.intervals} | {how} | {row.memory:.0f} |')
    return '\n'.join(lines)


def clamped_table(rows: list[Growth]) -> str:
    """Return the rows of clamped links as Markdown, lying and hanging side by side."""
    lines = ['| links x modes | coordinates | horizontal: time [s] | CPU [s] | strategy '
             '| gravity: time [s] | CPU [s] | strategy |', '|' + '---|' * 8]
    found = {(row.links, row.modes, row.setting): row for row in rows}
    for links, modes in dict.fromkeys((links, modes) for links, modes, _ in CLAMPED):
        cells = ['- | - | refused' if row is None else
                 f'{row.seconds:.3g} | {row.cpu:.3g} | '
                 f'{row.strategy if row.solved else "not solved"}'
                 for setting in ('horizontal', 'gravity')
                 for row in [found.get((links, modes, setting))]]
        lines.append(f'| {links} x {modes} | {links * (1 + modes)} | {" | ".join(cells)} |')
    return '\n'.join(lines)


def shares(payload: float = 1.0, repeats: int = 15) -> dict[str, float]:
    """Return the time of each part of a plan on its final mesh [ms]."""
    problem = paper_problem(payload)
    result = cold_start(problem, Solver()).result
    solution = result.solution.on_mesh(result.solution.mesh, SolverSettings().rule)
    _, mean, _ = linearise(problem, solution, Monitor())
    system = factorise(problem, solution, mean)
    residual = collocation_residual(problem, solution)
    parts: dict[str, Callable[[], object]] = {
        "z' and its Jacobian at all stages": lambda: linearise(problem, solution, Monitor()),
        'stage elimination and banded LU': lambda: factorise(problem, solution, mean),
        'one correction with a given matrix': lambda: system.correction(residual),
        'residual of a correction': lambda: collocation_residual(problem, solution),
        'error estimate': lambda: estimate_error(problem, solution, system),
        'defects for the mesh': lambda: defects(problem, solution),
        'certificate': lambda: certify(problem, result, Monitor()),
    }
    return {name: 1e3 * _median(call, repeats) for name, call in parts.items()}


def _median(call: Callable[[], object], repeats: int) -> float:
    """Return the median duration of a call."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return statistics.median(times)
