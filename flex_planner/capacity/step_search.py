"""The search for the maximum payload step by step, from its first plan to its outcome."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from flex_planner.base.progress import StoppedError
from flex_planner.capacity.incremental import PayloadTrial, raise_payload
from flex_planner.capacity.known_starts import continue_strategy, in_grace
from flex_planner.capacity.payload_outcome import describe, with_bound
from flex_planner.capacity.results import MaxPayload, PayloadMethod
from flex_planner.collocation import CollocationSolution, Solver
from flex_planner.optimal_control.holding import holding_limit
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import INTERRUPTED_STATUS, plan_problem, STOP_STATUS
from flex_planner.planning.strategies.catalogue import QUICK
from flex_planner.planning.strategies.free_parameters import PAYLOAD
import numpy as np

# a motor that is on its limit for so little of the time can carry more by far more than this
# share: of one link with a constant limit, 21 % more mass
_AT_LIMIT, _NARROW = 0.2, 0.05


@dataclass(slots=True, kw_only=True)
class _Climb:
    """Trials so far: the heaviest payload solved, the lightest that failed, and what stopped."""

    payload: float
    motion: CollocationSolution
    upper: float = np.inf
    stopped: tuple[PlanStatus, str] | None = None
    trials: list[PayloadTrial] = field(default_factory=list)

    def add(self, trial: PayloadTrial) -> None:
        """Note the outcome of a trial."""
        self.trials.append(trial)
        if trial.solved:
            self.payload, self.motion = trial.payload, trial.result.solution
            self.upper = self.upper if trial.payload < self.upper else np.inf
        elif trial.interrupted:
            self.stopped = INTERRUPTED_STATUS[trial.result.status], trial.result.message
        else:
            self.upper = trial.payload

    @property
    def refusal(self) -> str:
        """Return why the arm may not do the motion with the payload that failed."""
        return next((each.refusal for each in self.trials if each.payload == self.upper), '')


def search_in_steps(problem: MotionProblem, solver: Solver, step: float,
                    accuracy: float) -> MaxPayload:
    """Raise the payload of the task step by step, as in fig. 2 of the paper."""
    first = plan_problem(problem, solver)
    found = MaxPayload(task=problem.task, method=PayloadMethod.INCREMENTAL, status=first.status,
                       message=first.message)
    if first.solution is None or not first.solved:
        return with_bound(found, problem)
    solver.monitor.phase = 'payload raised'
    climb = _Climb(payload=problem.task.payload_mass, motion=first.solution)
    try:
        for trial in raise_payload(problem, first.solution, step=step, accuracy=accuracy,
                                   solver=solver):
            climb.add(trial)
    except StoppedError as error:
        climb.stopped = STOP_STATUS[error.reason], str(error)
    heaviest = PAYLOAD.with_value(problem, climb.payload)
    strategies = continue_strategy(climb.motion), *QUICK
    plan = plan_problem(heaviest, solver, strategies)
    if plan.status in INTERRUPTED_STATUS.values():
        climb.stopped = climb.stopped or (plan.status, plan.message)
    if climb.stopped is not None and climb.stopped[0] is PlanStatus.TIMEOUT:
        plan = plan_problem(heaviest, in_grace(solver), strategies)
    return _conclude(found, climb, plan, problem)


def _conclude(found: MaxPayload, climb: _Climb, plan: Plan, problem: MotionProblem) -> MaxPayload:
    """Return the outcome of a climb whose heaviest payload was planned."""
    held, joint = holding_limit(problem.model, problem.task, problem.parameters)
    status, message = climb.stopped or (plan.status, plan.message)
    found = with_bound(replace(found, status=status, message=message, trials=tuple(climb.trials),
                               local_upper=min(climb.upper, held)), problem)
    if not plan.solved:
        return found
    found = replace(found, plan=plan, payload=climb.payload)
    if climb.stopped is not None:
        return describe(found)
    if climb.refusal:
        return replace(found, message=(
            f'{found.payload:.6g} kg can be carried, {climb.upper:.6g} kg cannot by this kind of '
            f'motion: {climb.refusal}'))
    if held < climb.upper:
        found = replace(found, held=True, limiting_joint=joint)
    elif _has_reserves(plan, climb.upper):
        found = replace(found, status=PlanStatus.NOT_CONVERGED, message=(
            f'no motion with {climb.upper - found.payload:.3g} kg more was found, but the motors '
            'are not on their limits: another method or first step may find more'))
    return describe(found)


def _has_reserves(plan: Plan, upper: float) -> bool:
    """Return whether motors that hardly reach their limits carry nearly what failed."""
    near = plan.task.payload_mass >= (1 - _NARROW) * upper
    return near and float(plan.saturation.max()) < _AT_LIMIT
