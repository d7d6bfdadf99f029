"""
Plans that forgive errors of the model: the weight of the arms' energy is raised until they do.

Every trial linearises the arms about the last plan, chooses the weight whose predicted residual
is just small enough, and solves the boundary-value problem with its offset from that plan. Then
the arms carry the new plan out: what counts is what they do.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.progress import StoppedError
from flex_planner.collocation import Solver
from flex_planner.control.feedback_stability import feedback_growth
from flex_planner.planning.execution import describe_controller, unstable_feedback, UNSTABLE_GROWTH
from flex_planner.planning.objectives import Objectives, ObjectiveSearch
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import STOP_STATUS
from flex_planner.planning.robust.differing_plans import DifferingArms
from flex_planner.planning.robust.objective import Robustness, RobustSearch, RobustTrial
from flex_planner.planning.robust.offset_step import OffsetStep
from flex_planner.planning.robust.weighed_plan import WeighedPlan
import numpy as np

# weights are looked for between these, by factors, then more finely [1/J]
_LEAST_WEIGHT, _MOST_WEIGHT, _FACTOR, _BISECTIONS = 1e-2, 1e5, 10.0, 4
# of the largest residual: what is aimed at first
_AIM = 0.98
# of what is predicted at least this share is counted on, where less came about before
_LEAST_PROMISE = 0.5
# by which share of it effort may grow in one trial: further off nothing is linear
_GROWTH = 0.06
_MOST_TRIALS, _MOST_FAILURES, _GAIN = 10, 3, 0.98
# along the motion, at which the stability of the PD is looked at
_POSTURES = 5
# of the residual of the plain plan: above it a plan has hardly helped
_HARDLY = 0.9


def make_robust(plan: Plan, objectives: Objectives, solver: Solver) -> Plan:
    """
    Return the plan whose residual vibration forgives errors of the model.

    Parameters
    ----------
    plan : Plan
        Certified; its `objectives` are kept.
    objectives : Objectives
        With a `robustness`, checked against the task.
    solver : Solver
        Its monitor may interrupt the search.

    Returns
    -------
    Plan
        An extremal of effort that is measured from an offset, see `OffsetProblem`, or the plan
        given if it forgives enough. Where nothing was found that does, the closest motion with
        status ``OBJECTIVE_NOT_MET``.

    """
    assert objectives.robustness is not None
    solver.monitor.phase = 'arms that differ from the model'
    try:
        search = _Search(plan, objectives.robustness, solver)
        search.run()
        found, report = search.conclude()
    except StoppedError as error:
        return Plan(task=plan.task, status=STOP_STATUS[error.reason], message=str(error),
                    strategy=plan.strategy, problem=plan.problem, solution=None,
                    iterations=solver.monitor.iteration, planning_time=solver.monitor.elapsed)
    before = plan.objectives or ObjectiveSearch(objectives=objectives, met=True)
    outcome = replace(before, robust=report, met=before.met and report.met)
    found = replace(found, objectives=outcome,
                    kinds=plan.kinds, starts=plan.starts, warnings=found.warnings or plan.warnings,
                    planning_time=solver.monitor.elapsed)
    reasons = [*([] if report.met else [report.reason]), *_broken(found, objectives)]
    if found.solved and reasons:
        return replace(found, status=PlanStatus.OBJECTIVE_NOT_MET,
                       message=f'{PlanStatus.OBJECTIVE_NOT_MET.value}; {"; ".join(reasons)}')
    return found


def _broken(plan: Plan, objectives: Objectives) -> list[str]:
    """Return a sentence for each other objective that the plan does not meet any more."""
    assert plan.solution is not None
    shares = {objective: float(objectives.shares(objective, plan.problem, plan.solution).max())
              for objective in objectives.limited(plan.arm)}
    return [f'{objective.value} are {share:.4g} of their limits on the motion that forgives '
            'errors of the model: ask for somewhat smaller ones'
            for objective, share in shares.items() if share > 1]


class _Search:
    """Plans that were tried, from the plain one on."""

    def __init__(self, plan: Plan, robustness: Robustness, solver: Solver) -> None:
        self._robustness, self._solver = robustness, solver
        self._arms, self._trials = DifferingArms(plan, robustness), list[RobustTrial]()
        postures = plan.uniform_samples(_POSTURES).coordinates[:, :plan.arm.n_joints]
        self._growth = feedback_growth(self._arms.nominal.arm, postures)
        self._plain = self._best = WeighedPlan.plain(plan, self._arms, solver)
        self._promise = 1.0
        self._note(self._best)

    def run(self) -> None:
        """Try until the arms forgive enough, those that are not weighed included."""
        if self._growth > UNSTABLE_GROWTH:  # no motion would help
            return
        for _ in range(_MOST_FAILURES):
            if self._best.residual > self._limit and not self._improve():
                return
            residuals = self._best.residuals
            if residuals.max() <= self._limit:
                return
            # between the arms that are weighed some ring more: the worst is weighed, too
            self._arms.weighed = np.vstack([self._arms.weighed,
                                            self._arms.looked_at[residuals.argmax()]])

    def conclude(self) -> tuple[Plan, RobustSearch]:
        """Return the best plan and the report on it."""
        best, plain, residuals = self._best, self._plain, self._best.residuals
        met = bool(residuals.max() <= self._limit)
        return best.plan, RobustSearch(
            robustness=self._robustness, met=met, weight=best.weight,
            plain_cost=plain.plan.cost, plain_residual=self._trials[0].residual,
            errors=self._arms.looked_at, residuals=residuals,
            reason='' if met else self._reason(float(residuals.max())),
            trials=tuple(self._trials))

    @property
    def _limit(self) -> float:
        return self._robustness.max_residual

    def _note(self, plan: WeighedPlan) -> None:
        """Take note of a trial."""
        self._trials.append(RobustTrial(weight=plan.weight, cost=plan.plan.cost,
                                        residual=plan.residual))

    def _improve(self) -> bool:
        """Raise the weight until the arms that are weighed forgive enough; return whether."""
        failures, share, step = 0, 1.0, self._best.linearise()
        while len(self._trials) <= _MOST_TRIALS and failures < _MOST_FAILURES:
            self._solver.monitor.check()
            before = self._best.residual
            found = self._attempt(step, share)
            if found is not None and found.residual < before:
                self._best = found
                if found.residual <= self._limit:
                    return True
                step = found.linearise()
            gained = self._best.residual < _GAIN * before
            failures = 0 if gained else failures + 1
            share = min(2 * share, 1.0) if gained else share / 2
        return False

    def _attempt(self, step: OffsetStep, share: float) -> WeighedPlan | None:
        """Return a share of the step to the weight that should do; None if there is no plan."""
        before = self._best.residual
        weight, predicted = self._choose(step, before)
        found = self._best.solve(step, weight, self._solver, share)
        if found is None:
            self._trials.append(RobustTrial(weight=weight, cost=np.inf, residual=np.inf))
            return None
        self._note(found)
        if share == 1 and predicted < before:
            kept = (before - found.residual) / (before - predicted)
            self._promise = min(max(kept, _LEAST_PROMISE), 1.0)
        return found

    def _choose(self, step: OffsetStep, before: float) -> tuple[float, float]:
        """
        Return the least weight that should do, or else the one that should do best.

        And what residual it should lead to, from the one before, if all that is predicted came
        about [m].

        """
        aim = _AIM * (before - (before - self._limit) / self._promise)
        torques = self._best.plan.sample(step.responses.times).torques
        tried = dict[float, float]()

        def residual(weight: float) -> float:
            tried[weight] = self._predict(step, weight)
            return tried[weight]

        weight = _LEAST_WEIGHT
        while residual(weight) > aim and weight * _FACTOR <= _MOST_WEIGHT:
            if step.predict_effort(weight, torques) > _GROWTH:
                break
            weight *= _FACTOR
        low, high = weight / _FACTOR, weight
        for _ in range(_BISECTIONS):
            middle = float(np.sqrt(low * high))
            enough = (residual(middle) <= aim
                      or step.predict_effort(middle, torques) > _GROWTH)
            low, high = (low, middle) if enough else (middle, high)
        allowed = [one for one in tried if step.predict_effort(one, torques) <= _GROWTH]
        adequate = [one for one in allowed if tried[one] <= aim]
        chosen = min(adequate) if adequate else min(allowed or tried, key=lambda one: tried[one])
        return chosen, tried[chosen]

    def _predict(self, step: OffsetStep, weight: float) -> float:
        """Return the residual that a weight should lead to [m]."""
        states = step.responses.states_of(step.predict_misses(weight))
        return max(arrival.ringing.residual(away)
                   for arrival, away in zip(self._best.arrivals, states, strict=True))

    def _reason(self, worst: float) -> str:
        """Return what keeps arms from vibrating less."""
        limit, plain = self._limit, self._trials[0].residual
        sentence = (f'residual bending of the arms that differ from the model is {worst:.3g} m, '
                    f'but must be <= {limit:.3g} m')
        controller = describe_controller(self._arms.controller)
        if self._growth > UNSTABLE_GROWTH:
            return f'{sentence}; {unstable_feedback(self._arms.controller, self._growth)}'
        if not np.isfinite(worst):
            return f'{sentence}: under the controller ({controller}) an arm runs away'
        if self._best.residual > _HARDLY * plain:
            return (f'{sentence}; another motion hardly changes it ({plain:.3g} m before): it is '
                    f"the joints' answer to the errors: raise the gains ({controller}), or "
                    'measure stiffness and payload')
        return (f'{sentence} ({plain:.3g} m before); what may help: higher gains ({controller}), '
                'a longer duration, smaller errors')
