"""A plan in whose cost the energy of differing arms has a weight, and the step to another."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.collocation import Solver
from flex_planner.optimal_control.torque_offset import OffsetProblem, TorqueOffset
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_problem import plan_problem
from flex_planner.planning.robust.arrivals import Arrival
from flex_planner.planning.robust.differing_plans import as_keys, CarriedOut, DifferingArms
from flex_planner.planning.robust.offset_step import OffsetStep
from flex_planner.planning.robust.responses import Responses
from flex_planner.planning.strategies.initial_guesses import warm_start


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WeighedPlan:
    """
    A plan, its offset and weight, and how arms carry it out.

    Attributes
    ----------
    plan : Plan
        With a solution.
    offset : TorqueOffset
        From which its effort is measured.
    weight : float
        Of the energy with which the arms arrive; 0 for a plan without [1/J].
    arms : DifferingArms
        Of its task.
    carried_out : CarriedOut
        What they make of it.

    """

    plan: Plan
    offset: TorqueOffset
    weight: float
    arms: DifferingArms
    carried_out: CarriedOut

    @classmethod
    def plain(cls, plan: Plan, arms: DifferingArms, solver: Solver) -> WeighedPlan:
        """Return a plan without a weight."""
        return cls(plan=plan, weight=0.0, arms=arms,
                   offset=TorqueOffset.zero(plan.task.duration, plan.arm.n_joints),
                   carried_out=CarriedOut(plan, arms, solver.monitor))

    @property
    def residual(self) -> float:
        """Return the largest residual of the arms that are weighed [m]."""
        return float(self.carried_out.residuals(self.arms.weighed).max())

    @property
    def residuals(self) -> Array:
        """Return the residuals of all arms that are looked at, shape (k,) [m]."""
        return self.carried_out.residuals(self.arms.looked_at)

    @property
    def arrivals(self) -> list[Arrival]:
        """Return the arrivals of the arms that are weighed, less those that buckle."""
        found = [self.carried_out.arrival(errors) for errors in as_keys(self.arms.weighed)]
        return [arrival for arrival in found if arrival is not None]

    def linearise(self) -> OffsetStep:
        """Return the step to any weight."""
        return OffsetStep.of(Responses.of(self.plan, self.arrivals),
                             self.plan.task.effort_weights, self.offset)

    def solve(self, step: OffsetStep, weight: float, solver: Solver,
              share: float = 1.0) -> WeighedPlan | None:
        """
        Return the plan with another weight; None where it is not solved, or the arm may not do it.

        Or a share of the way to it, with the offset that belongs there.

        Raises
        ------
        StoppedError
            If the solver's monitor stopped it.

        """
        assert self.plan.solution is not None
        offset = step.make_offset(weight, share)
        problem = OffsetProblem(self.plan.model, self.plan.task, self.plan.problem.parameters,
                                offset, ends=self.plan.problem.ends)
        found = plan_problem(problem, solver, (warm_start(self.plan.solution, 'robust'),))
        solver.monitor.check()
        if not found.certified or (self.plan.solved and not found.solved):
            return None
        return WeighedPlan(plan=found, offset=offset, weight=weight, arms=self.arms,
                           carried_out=CarriedOut(found, self.arms, solver.monitor))
