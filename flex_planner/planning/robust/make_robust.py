"""
Plans that forgive errors of the model: the weight of the arms' energy is raised until they do.

Every trial linearises the arms about the last plan, chooses the weight whose predicted residual
is just small enough, and solves the boundary-value problem with its offset from that plan. Then the
arms carry the new plan out: what counts is what they do.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.progress import StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation import Solver
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import JointController
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.optimal_control.torque_offset import OffsetProblem, TorqueOffset
from flex_planner.planning.execution import describe_controller, Execution
from flex_planner.planning.objectives import Objectives, ObjectiveSearch
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_problem import plan_problem, STOP_STATUS
from flex_planner.planning.robust.arrivals import (
    Arrival,
    arrive,
    residual_bending,
    tabulate_reference,
)
from flex_planner.planning.robust.differing_arms import (
    differing_parameters,
    MORE_MODES,
    other_execution,
    weighed_errors,
    with_more_modes,
)
from flex_planner.planning.robust.objective import Robustness, RobustSearch, RobustTrial
from flex_planner.planning.robust.offset_step import OffsetStep
from flex_planner.planning.robust.responses import Responses
from flex_planner.planning.strategies.initial_guesses import warm_start
import numpy as np

# weights are looked for between these, by factors, then more finely [1/J]
_LEAST_WEIGHT, _MOST_WEIGHT, _FACTOR, _BISECTIONS = 1e-2, 1e5, 10.0, 4
# of the largest residual: what is aimed at, and what is so much less that a smaller weight is tried
_AIM, _TOO_SMALL = 0.95, 0.6
# by which share of it effort may grow in one trial: further off nothing is linear
_GROWTH = 0.06
_MOST_TRIALS, _MOST_FAILURES, _GAIN = 10, 3, 0.98
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
    found = replace(found, objectives=replace(before, robust=report, met=before.met and report.met),
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Trial:
    """A plan, its offset and weight, and how the arms that it is weighed for carry it out."""

    plan: Plan
    offset: TorqueOffset
    weight: float
    arrivals: list[Arrival]

    @property
    def residual(self) -> float:
        """Return the largest residual [m]."""
        return max(arrival.residual for arrival in self.arrivals)


class DifferingArms:
    """
    The arms that may carry a plan out.

    Parameters
    ----------
    plan : Plan
        Any plan of the task.
    robustness : Robustness
        With the box of errors and the controller.

    """

    def __init__(self, plan: Plan, robustness: Robustness) -> None:
        self.controller = robustness.controller or JointController(
            gains=default_gains(plan.model))
        self._nominal = Execution.of(plan, self.controller)
        self.weighed = weighed_errors(robustness, self._nominal)
        self.all = weighed_errors(robustness, self._nominal, finely=True)

    def execution(self, errors: Array, dynamics: ArmDynamics | None = None) -> Execution:
        """Return the execution by an arm with errors (2,) of stiffness and payload."""
        parameters = differing_parameters(self._nominal.parameters, *errors)
        return other_execution(self._nominal, dynamics or self._nominal.dynamics, parameters)

    def arrive(self, plan: Plan, solver: Solver) -> list[Arrival]:
        """Return the arrivals of the arms that are weighed."""
        reference = tabulate_reference(plan, self.controller)
        return [arrive(self.execution(errors), reference, solver.monitor)
                for errors in self.weighed]

    def residuals(self, plan: Plan, solver: Solver, errors: Array,
                  dynamics: ArmDynamics | None = None) -> Array:
        """Return the residuals of arms with errors (k, 2), shape (k,) [m]."""
        reference = tabulate_reference(plan, self.controller)

        def residual(one: Array) -> float:
            try:
                return residual_bending(self.execution(one, dynamics), reference, solver.monitor)
            except NoEquilibriumError:
                return np.inf

        return np.array([residual(one) for one in errors])


class _Search:
    """Plans that were tried, from the plain one on."""

    def __init__(self, plan: Plan, robustness: Robustness, solver: Solver) -> None:
        self._robustness, self._solver = robustness, solver
        self._arms = DifferingArms(plan, robustness)
        plain = _Trial(plan=plan, offset=TorqueOffset.zero(plan.task.duration, plan.arm.n_joints),
                       weight=0.0, arrivals=self._arms.arrive(plan, solver))
        self._plain = self._best = plain
        self._trials = [RobustTrial(weight=0.0, cost=plan.cost, residual=plain.residual)]
        self._residuals = np.zeros(0)
        self._aim = robustness.max_residual

    def run(self) -> None:
        """Try until the arms forgive enough, those that are not weighed included."""
        for _ in range(_MOST_FAILURES):
            if self._best.residual > self._aim and not self._improve():
                break
            self._residuals = self._arms.residuals(self._best.plan, self._solver, self._arms.all)
            worst = float(self._residuals.max())
            if worst <= self._robustness.max_residual:
                return
            # between the arms that are weighed some ring more: they are weighed, too
            self._weigh(self._arms.all[self._residuals.argmax()])
            self._aim = min(self._aim, self._robustness.max_residual)
        self._residuals = self._arms.residuals(self._best.plan, self._solver, self._arms.all)

    def conclude(self) -> tuple[Plan, RobustSearch]:
        """Return the best plan and the report on it."""
        best, plain = self._best, self._plain
        worst = float(self._residuals.max())
        met = worst <= self._robustness.max_residual
        corners = self._corners()
        more = ArmDynamics.of(with_more_modes(best.plan.arm))
        found = np.full(len(self._arms.all), np.nan)
        found[corners] = self._arms.residuals(best.plan, self._solver, self._arms.all[corners],
                                              more)
        return best.plan, RobustSearch(
            robustness=self._robustness, met=met, weight=best.weight,
            plain_cost=plain.plan.cost, plain_residual=plain.residual,
            errors=self._arms.all, residuals=self._residuals, more_modes=found,
            reason='' if met else self._reason(worst), trials=tuple(self._trials))

    def _corners(self) -> Array:
        """Return which arms are at corners of the box."""
        sizes = np.abs(self._arms.all)
        corners: Array = (sizes >= sizes.max(axis=0)).all(axis=1)
        return corners

    def _weigh(self, errors: Array) -> None:
        """Weigh one more arm."""
        self._arms.weighed = np.vstack([self._arms.weighed, errors])
        self._best = replace(self._best,
                             arrivals=self._arms.arrive(self._best.plan, self._solver))

    def _improve(self) -> bool:
        """Raise the weight until the arms that are weighed forgive enough; return whether."""
        failures, growth = 0, _GROWTH
        while len(self._trials) <= _MOST_TRIALS and failures < _MOST_FAILURES:
            self._solver.monitor.check()
            found = self._attempt(growth)
            if found is None:
                failures, growth = failures + 1, growth / 4
                continue
            gained = found.residual < _GAIN * self._best.residual
            if found.residual < self._best.residual:
                self._best = found
            if self._best.residual <= self._aim:
                return True
            failures = 0 if gained else failures + 1
            growth = _GROWTH if gained else growth / 4
        return False

    def _attempt(self, growth: float) -> _Trial | None:
        """Return the plan with the weight that should do; None if there is none."""
        best, plan = self._best, self._best.plan
        assert plan.solution is not None
        step = OffsetStep.of(Responses.of(plan, best.arrivals), plan.task.effort_weights,
                             best.offset)
        weight = self._choose(step, growth)
        offset = step.make_offset(weight)
        problem = OffsetProblem(plan.model, plan.task, plan.problem.parameters, offset)
        found = plan_problem(problem, self._solver, (warm_start(plan.solution, 'robust'),))
        self._solver.monitor.check()
        if not found.certified:
            self._trials.append(RobustTrial(weight=weight, cost=np.inf, residual=np.inf))
            return None
        trial = _Trial(plan=found, offset=offset, weight=weight,
                       arrivals=self._arms.arrive(found, self._solver))
        self._trials.append(RobustTrial(weight=weight, cost=found.cost,
                                        residual=trial.residual))
        return trial

    def _choose(self, step: OffsetStep, growth: float) -> float:
        """Return the least weight that should do, or else the one that should do best."""
        torques = self._best.plan.sample(step.responses.times).torques
        tried = dict[float, float]()

        def residual(weight: float) -> float:
            tried[weight] = self._predict(step, weight)
            return tried[weight]

        weight = _LEAST_WEIGHT
        while residual(weight) > _AIM * self._aim and weight * _FACTOR <= _MOST_WEIGHT:
            if step.predict_effort(weight, torques) > growth:
                break
            weight *= _FACTOR
        low, high = weight / _FACTOR, weight
        for _ in range(_BISECTIONS):
            middle = np.sqrt(low * high)
            enough = (residual(middle) <= _AIM * self._aim
                      or step.predict_effort(middle, torques) > growth)
            low, high = (low, middle) if enough else (middle, high)
        allowed = [one for one in tried if step.predict_effort(one, torques) <= growth]
        enough = [one for one in allowed if tried[one] <= _AIM * self._aim]
        return min(enough) if enough else min(allowed or tried, key=lambda one: tried[one])

    def _predict(self, step: OffsetStep, weight: float) -> float:
        """Return the residual that a weight should lead to [m]."""
        states = step.responses.states_of(step.predict_misses(weight))
        return max(arrival.residual_of(away)
                   for arrival, away in zip(self._best.arrivals, states, strict=True))

    def _reason(self, worst: float) -> str:
        """Return what keeps arms from vibrating less."""
        limit, plain = self._robustness.max_residual, self._plain.residual
        sentence = (f'residual bending of the arms that differ from the model is {worst:.3g} m, '
                    f'but must be <= {limit:.3g} m')
        controller = describe_controller(self._arms.controller)
        if not np.isfinite(worst):
            return f'{sentence}: under the controller ({controller}) an arm runs away'
        if self._best.residual > _HARDLY * plain:
            return (f'{sentence}; another motion hardly changes it ({plain:.3g} m before): it is '
                    f"the joints' answer to the errors: raise the gains ({controller}), or "
                    'measure stiffness and payload')
        return (f'{sentence} ({plain:.3g} m before); what may help: higher gains ({controller}), '
                'a longer duration, smaller errors')
