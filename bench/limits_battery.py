"""
Random limits on the way of random motions: plans within them against IPOPT's.

``python -m bench.limits_battery 70 30`` takes so many tasks of random rigid arms and of the
paper's flexible one, whose free motion breaks a joint's range, a speed limit, a post, a line or a
limit of a link's moment or deflection. No plan may pass a limit anywhere, none may cost more than
IPOPT's motion by 1e-3, and where IPOPT finds one there should be one. The table goes to
docs/benchmarks.md.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
import sys
import time

from bench.limits_judge import Judge, Motion
from bench.limits_tasks import draw_limits, FLEXIBLE, flexible_task, RIGID, rigid_task
from flex_planner import plan_path, Task
from flex_planner.optimal_control.path_constraints import PathConstraint
from flex_planner.planning.plan import Plan
import numpy as np

WORSE = 1e-3
# passed by less than this share of its scale, a limit is kept: rounding
ROUNDING = 1e-9
_FINE = 4001
# of the transcription: enough for 1e-4 of the cost, of flexible arms with some cycles of vibration
_INTERVALS = {'rigid': 40, 'flexible': 120}
_FINER = 2, 4, 6
ARMS: dict[str, tuple[Callable[[int], Task], tuple[str, ...]]] = {
    'rigid': (rigid_task, RIGID), 'flexible': (flexible_task, FLEXIBLE)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """
    What a random task came to: costs are inf where nothing was found.

    Attributes
    ----------
    arm, seed, kind
        Of the task.
    free, cost, by_ipopt : float
        J without limits, of the plan within them, and of the cheapest motion of IPOPT.
    slack : float
        The smallest on a fine grid, by the judge's formulas; inf without a plan.
    seconds : float
        CPU time of the plan.
    message : str
        Of the plan.

    """

    arm: str
    seed: int
    kind: str
    free: float
    cost: float
    by_ipopt: float
    slack: float
    seconds: float
    message: str

    @property
    def solvable(self) -> bool:
        """Return whether IPOPT finds a motion."""
        return self.by_ipopt < np.inf

    @property
    def solved(self) -> bool:
        """Return whether there is a plan."""
        return self.cost < np.inf

    @property
    def dearer(self) -> bool:
        """Return whether IPOPT's motion is cheaper than the plan."""
        return self.solved and self.solvable and self.cost > (1 + WORSE) * self.by_ipopt

    @property
    def lost(self) -> bool:
        """Return whether the plan is missing, dearer, or beyond a limit."""
        return (self.solvable and not self.solved) or self.dearer or self.slack < -ROUNDING

    def __str__(self) -> str:
        return (f'{self.arm:8s} {self.seed:4d} {self.kind:18s} free {self.free:.6g} plan '
                f'{self.cost:.6g} IPOPT {self.by_ipopt:.6g} slack {self.slack:.1e} '
                f'{self.seconds:.2f} s' + (f'  {self.message}' if self.lost else ''))


def run(arm: str, seed: int) -> Outcome | None:
    """Return the outcome of a random task; None where no limit is broken."""
    make, kinds = ARMS[arm]
    task = make(seed)
    free = plan_path(task)
    limits = draw_limits(free, kinds, seed) if free.solved else ()
    if not limits:
        return None
    began = time.process_time()
    plan = plan_path(replace(task, path_constraints=limits))
    seconds = time.process_time() - began
    judge = Judge(task, limits, _INTERVALS[arm])
    samples = (plan if plan.solved else free).uniform_samples(_FINE)
    slack = float(judge.slacks(samples.coordinates, samples.rates).min())
    if not plan.solved and slack >= 0:
        return None
    cost = plan.cost if plan.solved else np.inf
    return Outcome(arm=arm, seed=seed, kind=kinds[seed % len(kinds)] + ', 2' * (len(limits) > 1),
                   free=free.cost, cost=cost, seconds=seconds, message=plan.message,
                   by_ipopt=_judge(judge, task, limits, free, plan),
                   slack=slack if plan.solved else np.inf)


def _judge(judge: Judge, task: Task, limits: Sequence[PathConstraint], free: Plan,
           plan: Plan) -> float:
    """Return the cost of IPOPT's cheapest motion, on finer meshes where it seems cheaper."""
    starts = [_as_start(one) for one in ([free, plan] if plan.solved else [free])]
    starts.append(Motion.straight(task))
    found = judge.cost(starts)
    # between its points a motion may pass what it only touches, which makes it cheaper
    for finer in _FINER:
        if plan.solved and plan.cost > (1 + WORSE) * found:
            found = Judge(task, limits, finer * judge.intervals).cost(starts)
    return found


def _as_start(plan: Plan) -> Motion:
    """Return the samples of a plan."""
    samples = plan.uniform_samples(401)
    return Motion(times=samples.times, coordinates=samples.coordinates.T,
                  rates=samples.rates.T, accelerations=samples.accelerations.T)


def collect(arm: str, count: int, first: int = 0) -> list[Outcome]:
    """Return and print the outcomes of so many tasks that a limit is in the way of."""
    found: list[Outcome] = []
    seed = first
    while len(found) < count:
        outcome = run(arm, seed)
        seed += 1
        if outcome is not None:
            found.append(outcome)
            print(outcome, flush=True)
    return found


def summarise(found: Sequence[Outcome]) -> str:
    """Return what became of some outcomes in a line."""
    solvable = [one for one in found if one.solvable]
    return (f'{sum(one.solved for one in solvable)} of {len(solvable)} that IPOPT solves, '
            f'{sum(one.solved for one in found) - sum(one.solved for one in solvable)} that it '
            f'does not; {sum(one.dearer for one in found)} dearer by {WORSE:g}; smallest slack '
            f'{min(one.slack for one in found):.1e}; CPU median '
            f'{np.median([one.seconds for one in found]):.2f} s, most '
            f'{max(one.seconds for one in found):.2f} s; seeds to '
            f'{max(one.seed for one in found)}')


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """
    What became of the random tasks of one kind of limit.

    Attributes
    ----------
    arm, limit
        Rigid or flexible; the kind of the first limit.
    tasks, by_ipopt, planned : int
        All, those that IPOPT solves, and those of these that have a plan.
    dearer, cheaper : int
        Plans that cost more, and less, than IPOPT's motion by more than 1e-3.
    slack : float
        The smallest of all plans.
    median, most : float
        CPU times [s].

    """

    arm: str
    limit: str
    tasks: int
    by_ipopt: int
    planned: int
    dearer: int
    cheaper: int
    slack: float
    median: float
    most: float

    @classmethod
    def of(cls, arm: str, limit: str, found: Sequence[Outcome]) -> Row:
        """Return the row of some outcomes."""
        solvable = [one for one in found if one.solvable]
        seconds = [one.seconds for one in found]
        return cls(arm=arm, limit=limit, tasks=len(found), by_ipopt=len(solvable),
                   planned=sum(one.solved for one in solvable),
                   dearer=sum(one.dearer for one in found),
                   cheaper=sum(one.solved and one.cost < (1 - WORSE) * one.by_ipopt
                               for one in found),
                   slack=min(one.slack for one in found),
                   median=float(np.median(seconds)), most=max(seconds))


def tabulate(found: Sequence[Outcome]) -> list[Row]:
    """Return a row for each kind of limit of rigid and of flexible arms, and one for all."""
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for one in found:
        groups.setdefault((one.arm, one.kind.removesuffix(', 2')), []).append(one)
    return [*(Row.of(*names, group) for names, group in groups.items()),
            Row.of('all', '', found)]


def table(rows: Sequence[Row]) -> str:
    """Return the rows as a table."""
    return '\n'.join([
        '| arm | limit | tasks | solved by IPOPT | of these planned | dearer by 1e-3 '
        '| cheaper by 1e-3 | smallest slack | CPU median [s] | most [s] |',
        '|---|---|---|---|---|---|---|---|---|---|',
        *(f'| {one.arm} | {one.limit} | {one.tasks} | {one.by_ipopt} | {one.planned} '
          f'| {one.dearer} | {one.cheaper} | {one.slack:.1e} | {one.median:.2f} '
          f'| {one.most:.2f} |' for one in rows)])


def measure() -> list[dict[str, object]]:
    """Return the rows of 100 tasks."""
    return [asdict(row) for row in tabulate([*collect('rigid', 70), *collect('flexible', 30)])]


def main(rigid: int, flexible: int) -> None:
    """Print the outcomes of rigid and of flexible arms."""
    for arm, count in (('rigid', rigid), ('flexible', flexible)):
        if count:
            print(f'{arm}: {summarise(collect(arm, count))}', flush=True)


if __name__ == '__main__':
    counts = [int(text) for text in sys.argv[1:]] or [7, 3]
    main(counts[0], counts[1] if len(counts) > 1 else 0)
