"""
Weights that meet objectives: the loop of Korayem et al. 2009, fig. 1, with condition (II).

Each objective has one weight. It is raised until the objective is met, then its smallest adequate
value is enclosed: met at the upper end, violated at the lower, no further apart than the
tolerance. Every motion starts from the one before.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.base.progress import StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    follow_homotopy,
    INTERRUPTED,
    Solver,
)
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.totals import integrate_totals
from flex_planner.planning.objectives import (
    Margin,
    Objective,
    Objectives,
    ObjectiveSearch,
    WeightTrial,
)
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import plan_problem, STOP_STATUS
from flex_planner.planning.strategies.catalogue import CATALOGUE
from flex_planner.planning.strategies.initial_guesses import warm_start
import numpy as np

# first weight: what it adds to the cost, as a share; for R the share itself
_FIRST_SHARE = 0.1
_FACTOR = 4.0
# smallest and largest weight in units of the first
_SMALLEST, _LARGEST = 1e-8, 1e10
# an objective is given up when so many weights in a row gained too little to come to its limit
_PATIENCE = 3
_GOLDEN, _FINEST_FACTOR = 0.618, 1.02
_MOST_STEPS = 60
# objectives are given up when so many turns in a row left this much of what is too much
_IDLE, _IDLE_TURNS, _MOST_TURNS = 0.9, 2, 30
# how far inside a bracket a weight is tried, and how near to its ends
_INSIDE, _NEARLY = 0.1, 0.9


def adapt_weights(plan: Plan, objectives: Objectives, solver: Solver) -> Plan:
    """
    Return the plan with the smallest weights that meet the objectives.

    Parameters
    ----------
    plan : Plan
        Certified, with the weights of the task.
    objectives : Objectives
        Checked against the task.
    solver : Solver
        Its monitor may interrupt the search.

    Returns
    -------
    Plan
        Its task has the weights found. Where the objectives cannot be met, the closest motion
        with status ``OBJECTIVE_NOT_MET``.

    """
    assert plan.solution is not None
    if not objectives.limited(plan.arm):
        return replace(plan, objectives=ObjectiveSearch(objectives=objectives, met=True))
    search = _Search(plan.problem, plan.solution, objectives, solver)
    try:
        met = search.run()
        if not search.trials:
            return replace(plan, objectives=ObjectiveSearch(objectives=objectives, met=True))
        best = search.best
        solver.monitor.phase = 'plan with the weights found'
        strategies = (warm_start(best.solution, 'weights adapted'), *CATALOGUE)
        found = plan_problem(best.problem, solver, strategies)
    except StoppedError as error:
        return Plan(task=plan.task, status=STOP_STATUS[error.reason], message=str(error),
                    strategy=plan.strategy, problem=plan.problem, solution=None,
                    iterations=solver.monitor.iteration, planning_time=solver.monitor.elapsed)
    report = ObjectiveSearch(objectives=objectives, met=met, trials=tuple(search.trials),
                             margins=search.margins() if met else ())
    found = replace(found, objectives=report)
    if found.solved and not met:
        return replace(found, status=PlanStatus.OBJECTIVE_NOT_MET, message=search.failure())
    return found


def check_objectives(plan: Plan, search: ObjectiveSearch | None, objectives: Objectives) -> Plan:
    """
    Return a plan that its limits on the way have bent, with whether it still meets objectives.

    Parameters
    ----------
    plan : Plan
        Within its limits.
    search : ObjectiveSearch or None
        What was found without them.
    objectives : Objectives
        Which weights were chosen for.

    """
    if plan.solution is None or not plan.certified:
        return replace(plan, objectives=search)
    shares = {one: float(objectives.shares(one, plan.problem, plan.solution).max())
              for one in objectives.limited(plan.arm)}
    missed = [f'{one.value}: {share:.4g} of what they may be' for one, share in shares.items()
              if share > 1]
    if search is not None:
        search = replace(search, met=not missed)
    if not missed or not plan.solved:
        return replace(plan, objectives=search)
    return replace(plan, objectives=search, status=PlanStatus.OBJECTIVE_NOT_MET, message=(
        f'within the limits on the way the weights found do not meet {"; ".join(missed)}'))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Trial:
    """A motion and how it meets the objectives: the largest share of each."""

    weights: dict[Objective, float]
    problem: MotionProblem
    solution: CollocationSolution
    shares: dict[Objective, float]

    @property
    def worst(self) -> float:
        """Return the largest share of all."""
        return max(self.shares.values())


class _Search:
    """Weights tried, and the motions that they led to."""

    def __init__(self, problem: MotionProblem, solution: CollocationSolution,
                 objectives: Objectives, solver: Solver) -> None:
        self._base, self._objectives = problem, objectives
        self._solver = solver
        self._limited = objectives.limited(problem.model.arm)
        self._below: dict[Objective, _Trial] = {}
        self._patterns = {objective: objectives.pattern(objective, problem.model.arm)
                          for objective in self._limited}
        if Objective.TORQUE_SHARES in self._limited:
            # where all are raised none of them is: only those whose torque is too large
            over = objectives.shares(Objective.TORQUE_SHARES, problem, solution) > 1
            self._patterns[Objective.TORQUE_SHARES] *= over
        self.trials: list[WeightTrial] = []
        self.best = self._point(dict.fromkeys(self._limited, 0.0), problem, solution)

    def run(self) -> bool:
        """
        Raise and relax the weights in turn until none can be relaxed; return whether met.

        Objectives that need each other's weights lower have no such end: each turn leaves them as
        far off as the one before.

        """
        here, idle = self.best, 0
        for _ in range(_MOST_TURNS):
            before = here
            for objective in self._limited:
                if here.shares[objective] > 1 or here.weights[objective]:
                    self._solver.monitor.phase = f'weight of {objective.value}'
                    found = self._smallest(objective, here)
                    if found is None:
                        return False
                    here = found
            if here.worst <= 1 and (here is before or len(self._limited) == 1):
                self.best = here
                return True
            excess = here.worst - 1, max(before.worst - 1, 0.0)
            idle = idle + 1 if excess[0] > _IDLE * excess[1] else 0
            if idle == _IDLE_TURNS:
                break
        return False

    def margins(self) -> tuple[Margin, ...]:
        """Return condition (II) for each objective with a weight."""
        best = self.best
        return tuple(Margin(objective=objective, weight=weight, share=best.shares[objective],
                            relaxed_weight=self._below[objective].weights[objective],
                            relaxed_share=self._below[objective].shares[objective])
                     for objective, weight in best.weights.items()
                     if weight and objective in self._below)

    def failure(self) -> str:
        """Return a sentence about what the closest motion misses."""
        parts = []
        for objective, share in self.best.shares.items():
            if share > 1:
                shares = self._objectives.shares(objective, self.best.problem,
                                                 self.best.solution)
                limits = self._objectives.limits(objective, self._base.model.arm)
                i = int(shares.argmax())
                kind = 'mode' if objective is Objective.MODAL_RATES else 'joint'
                parts.append(f'{objective.value}: {kind} {i + 1} reaches '
                             f'{shares[i] * limits[i]:.4g}, but must be <= {limits[i]:.4g}')
        return f'{PlanStatus.OBJECTIVE_NOT_MET.value}; {"; ".join(parts)}'

    def _smallest(self, objective: Objective, here: _Trial) -> _Trial | None:
        """Return the motion with the smallest adequate weight, None if there is none."""
        tolerance = 1 + self._objectives.weight_tolerance
        below, above = self._bracket(objective, here)
        if above is None:
            return None
        if below is not None and above.weights[objective] <= below.weights[objective]:
            below = None  # it was not the weight that was too small
        for _ in range(_MOST_STEPS):
            if below is None or above.weights[objective] <= tolerance * below.weights[objective]:
                break
            tried = self._at(objective, _between(objective, below, above, tolerance), above)
            if tried is None:
                break
            below, above = (below, tried) if tried.shares[objective] <= 1 else (tried, above)
        if below is not None:
            self._below[objective] = below
        return above

    def _bracket(self, objective: Objective,
                 here: _Trial) -> tuple[_Trial | None, _Trial | None]:
        """Return motions that violate and that meet an objective; None for one that is not."""
        first = self._first_weight(objective)
        if here.shares[objective] > 1:
            return self._raise(objective, here, first)
        above, factor = here, 1 + self._objectives.weight_tolerance
        while above.weights[objective]:
            weight = above.weights[objective] / factor
            found = self._at(objective, weight if weight > _SMALLEST * first else 0.0, above)
            if found is None or found.shares[objective] > 1:
                return found, above
            above, factor = found, _FACTOR
        return None, above

    def _raise(self, objective: Objective, here: _Trial,
               first: float) -> tuple[_Trial, _Trial | None]:
        """
        Raise a weight until its objective is met, or given up.

        Where one joint's torque falls another's may grow: once a step makes things worse, the
        best weight is between the last three.

        """
        below, weight, idle, before = here, max(here.weights[objective] * _FACTOR, first), 0, 0.0
        while idle < _PATIENCE and weight < _LARGEST * first:
            found = self._at(objective, weight, below)
            if found is None:
                break
            if found.shares[objective] <= 1:
                return below, found
            gained = below.shares[objective] - found.shares[objective]
            # were the gains to go on falling by this ratio, they would add up to this
            if gained < 0 and below.weights[objective]:
                return below, self._find_between(objective, weight / _FACTOR**2, weight, below)
            ratio = gained / before if 0 < gained < before else 0.0
            hope = gained * ratio / (1 - ratio) if ratio or gained <= 0 else np.inf
            idle = idle + 1 if hope < found.shares[objective] - 1 else 0
            below, weight, before = found, weight * _FACTOR, gained
        return below, None

    def _find_between(self, objective: Objective, low: float, high: float,
                      near: _Trial) -> _Trial | None:
        """Return a motion that meets an objective with a weight between two, if there is one."""
        ends, known = [np.log(low), np.log(high)], dict[float, _Trial | None]()
        while ends[1] - ends[0] > np.log(_FINEST_FACTOR):
            inner = [ends[0] + part * (ends[1] - ends[0]) for part in (1 - _GOLDEN, _GOLDEN)]
            for at in inner:
                if at not in known:
                    known[at] = self._at(objective, float(np.exp(at)), near)
                found = known[at]
                if found is None:
                    return None
                if found.shares[objective] <= 1:
                    return found
            left, right = (point.shares[objective] for point in (known[at] for at in inner)
                           if point is not None)
            ends = [ends[0], inner[1]] if left < right else [inner[0], ends[1]]
        return None

    def _first_weight(self, objective: Objective) -> float:
        """Return the weight that is tried first."""
        if objective is Objective.TORQUE_SHARES:
            return _FIRST_SHARE
        cost = integrate_totals(self._base, self.best.solution).cost
        trial = self._with_weights({objective: 1.0})
        added = integrate_totals(trial, self.best.solution).cost - cost
        return _FIRST_SHARE * cost / max(added, 1e-12)

    def _at(self, objective: Objective, weight: float, near: _Trial) -> _Trial | None:
        """Solve with a weight, from a motion with another; None if that fails."""
        weights = {**near.weights, objective: weight}
        problem = self._with_weights(weights)
        result = self._solve(problem, near)
        if not result.converged:
            self._solver.monitor.check()
            self.trials.append(WeightTrial(objective=objective, weight=weight, share=np.inf,
                                           met=False))
            return None
        point = self._point(weights, problem, result.solution)
        if point.worst < self.best.worst:
            self.best = point  # the closest, should none meet them all
        share = point.shares[objective]
        self.trials.append(WeightTrial(objective=objective, weight=weight, share=share,
                                       met=share <= 1))
        return point

    def _solve(self, problem: MotionProblem, near: _Trial) -> CollocationResult:
        """Solve from a motion with other weights, at once or step by step."""
        result = self._solver.solve(problem, near.solution)
        if result.converged or result.status in INTERRUPTED:
            return result
        first, last = near.problem.parameters, problem.parameters

        def at(share: float) -> MotionProblem:
            parameters = replace(
                last,
                velocity_weights=_blend(first.velocity_weights, last.velocity_weights, share),
                effort_weights=_blend(first.effort_weights, last.effort_weights, share))
            return MotionProblem(problem.model, problem.task, parameters)

        return follow_homotopy(at, near.solution, self._solver, first_step=0.5)

    def _with_weights(self, weights: dict[Objective, float]) -> MotionProblem:
        """Return the problem of the task with weights added."""
        task, arm = self._base.task, self._base.model.arm
        n, velocity, effort = arm.n_joints, task.velocity_weights.copy(), task.effort_weights
        for objective, weight in weights.items():
            added = weight * self._patterns[objective]
            if objective is Objective.TORQUE_SHARES:
                effort = effort * (1 + added)
            elif objective is Objective.JOINT_SPEEDS:
                velocity[:n] += added
            else:
                velocity[-arm.n_modes:] += added
        heavier = replace(task, velocity_weights=velocity, effort_weights=effort)
        return MotionProblem(self._base.model, heavier, task_parameters(heavier))

    def _point(self, weights: dict[Objective, float], problem: MotionProblem,
               solution: CollocationSolution) -> _Trial:
        shares = {objective: float(self._objectives.shares(objective, problem, solution).max())
                  for objective in self._limited}
        return _Trial(weights=weights, problem=problem, solution=solution, shares=shares)


def _blend(first: Array, last: Array, share: float) -> Array:
    """Return weights between two, by a share: in equal ratios where both are positive."""
    both = (first > 0) & (last > 0)
    ratio = np.where(both, last, 1.0) / np.where(both, first, 1.0)
    blend: Array = np.where(both, first * ratio**share, first + (last - first) * share)
    return blend


def _between(objective: Objective, below: _Trial, above: _Trial, tolerance: float) -> float:
    """Return the weight to try next: where the share should be 1, or what ends the search."""
    low, high = below.weights[objective], above.weights[objective]
    if not low:
        return high / _FACTOR
    over, under = below.shares[objective] - 1, above.shares[objective] - 1
    part = float(np.clip(over / (over - under), _INSIDE, 1 - _INSIDE))
    guess: float = low * (high / low) ** part
    nearly = 1 + _NEARLY * (tolerance - 1)
    if guess * nearly >= high:
        return high / nearly
    if guess <= low * nearly:
        return low * nearly
    return guess
