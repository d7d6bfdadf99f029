"""
An adversary of the search over kinds of motion: random tasks, and IPOPT from many random starts.

Its starts are not those of the planner. A value of the adversary counts once it is confirmed on a
mesh twice as fine.

"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
import os
import time

from bench.random_tasks import link_mass, random_task, with_payload
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.processes import PROCESSES
from flex_planner.base.progress import Monitor
from flex_planner.capacity.max_payload import find_max_payload
from flex_planner.capacity.min_duration import find_min_duration
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.optimal_control.direct.unknowns import Free
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.task import Task
from flex_planner.planning.kinds.clusters import cluster
from flex_planner.planning.kinds.explorer import Explorer
from flex_planner.planning.kinds.paths import random_paths
from flex_planner.planning.kinds.search import is_better
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.plan_path import plan_path
import numpy as np

# how near to the adversary's value is as good
TOLERANCES = {Free.NOTHING: 0.01, Free.PAYLOAD: 0.005, Free.DURATION: 0.003}
# payloads of the three questions: by the heaviest found, and by the links' mass
_HEAVY, _LIGHT = 0.6, 0.3
_TIME_LIMIT = 120.0
_CONFIRMED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Duel:
    """
    One question, asked of the planner and of the adversary.

    Attributes
    ----------
    seed, links, gravity : int, int, bool
        Of the task.
    question : Free
        What is free.
    planner, adversary : float
        Their values: J, payload [kg] or duration [s]; NaN where there is none.
    status : str
        Of the planner's answer.
    seconds, adversary_seconds : float
        CPU time of both.

    """

    seed: int
    links: int
    gravity: bool
    question: Free
    planner: float
    adversary: float
    status: str
    seconds: float
    adversary_seconds: float

    @property
    def lost(self) -> float:
        """Return the share by which the planner's value is worse; negative if it is better."""
        if np.isnan(self.adversary):
            return 0.0 if np.isnan(self.planner) else -np.inf
        if np.isnan(self.planner):
            return np.inf
        sign = -1 if self.question is Free.PAYLOAD else 1
        return sign * (self.planner - self.adversary) / abs(self.adversary)

    @property
    def won(self) -> bool:
        """Return whether the planner's value is as good."""
        return self.lost <= TOLERANCES[self.question]

    @property
    def refuted(self) -> bool:
        """Return whether the planner called impossible what the adversary did."""
        return self.status == PlanStatus.INFEASIBLE.name and not np.isnan(self.adversary)


def duels(seed: int, *, links: int = 2, gravity: bool = False, starts: int = 30,
          questions: Iterable[Free] = tuple(Free)) -> list[Duel]:
    """Return the duels over a random task: the payload first, for the others need it."""
    task, found = random_task(seed, links=links, gravity=gravity), []
    try:
        heaviest = _best(task, Free.PAYLOAD, starts)
        for question in questions:
            asked = with_payload(task, {
                Free.NOTHING: _HEAVY * np.nan_to_num(heaviest[0], nan=0.0),
                Free.PAYLOAD: 0.0, Free.DURATION: _LIGHT * link_mass(task)}[question])
            value, seconds = (heaviest if question is Free.PAYLOAD
                              else _best(asked, question, starts))
            began = time.process_time()
            answer, status = _ask(asked, question)
            found.append(Duel(seed=seed, links=links, gravity=gravity, question=question,
                              planner=answer, adversary=value, status=status,
                              seconds=time.process_time() - began, adversary_seconds=seconds))
    except FlexPlannerError as error:  # a goal that cannot be held with that payload
        print(f'seed {seed}: {error}')
    return found


def _ask(task: Task, question: Free) -> tuple[float, str]:
    """Return the planner's value and status."""
    monitor = Monitor(time_limit=_TIME_LIMIT)
    if question is Free.PAYLOAD:
        heaviest = find_max_payload(task, monitor=monitor)
        return heaviest.payload or np.nan, heaviest.status.name
    if question is Free.DURATION:
        shortest = find_min_duration(task, monitor=monitor)
        value = shortest.duration if np.isfinite(shortest.duration) else np.nan
        return value, shortest.status.name
    plan = plan_path(task, monitor=monitor)
    return plan.cost if plan.solved else np.nan, plan.status.name


def _best(task: Task, question: Free, starts: int) -> tuple[float, float]:
    """Return the best value that IPOPT confirms from random starts, and its CPU time."""
    began = time.process_time()
    problem = MotionProblem(ArmModel.of(task.arm), task, task_parameters(task))
    n, better = task.arm.n_joints, is_better(question)
    most = np.inf
    if question is Free.PAYLOAD:
        most = holding_limit(problem.model, task, problem.parameters)[0]
    explorer = Explorer(problem, question, Monitor(), most)
    paths = random_paths(problem.start[:n], problem.goal[:n], 977 + int(task.duration * 1e6))
    met = explorer.explore(list(islice(paths, starts)))
    kinds = cluster((one for one in met if one is not None), better)
    confirmed = [one.value for kind in kinds[:_CONFIRMED]
                 if (one := explorer.confirm(kind.motion)) is not None]
    best = np.nan
    for value in confirmed:
        best = value if np.isnan(best) or better(value, best) else best
    return best, time.process_time() - began


def run(seeds: Iterable[int], *, links: int = 2, starts: int = 30,
        gravities: Iterable[bool] = (False, True)) -> list[Duel]:
    """Run duels, print each, and how many the planner won."""
    os.environ[PROCESSES] = '0'  # the CPU time is that of this process
    found: list[Duel] = []
    for seed in seeds:
        for gravity in gravities:
            for duel in duels(seed, links=links, gravity=gravity, starts=starts):
                found.append(duel)
                print(f'{duel.links} links, seed {duel.seed}, gravity {duel.gravity:d}, '
                      f'{duel.question.value}: planner {duel.planner:.6g} ({duel.status}, '
                      f'{duel.seconds:.1f} s), adversary {duel.adversary:.6g} '
                      f'({duel.adversary_seconds:.1f} s), lost {duel.lost:+.2%}'
                      f'{"" if duel.won else "  <-- LOST"}', flush=True)
    for question in Free:
        these = [duel for duel in found if duel.question is question]
        if these:
            won = sum(duel.won for duel in these)
            print(f'{question.value}: {won} of {len(these)} won, '
                  f'{sum(duel.refuted for duel in these)} called impossible wrongly')
    return found


if __name__ == '__main__':
    import sys

    first, last = int(sys.argv[1]), int(sys.argv[2])
    run(range(first, last), links=int(sys.argv[3]) if len(sys.argv) > 3 else 2)
