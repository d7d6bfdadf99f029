"""What is left of a plan that runs: how to go on from there as a problem, and a guess of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.validation import Array, number, vector
from flex_planner.collocation import CollocationSolution, GaussRule
from flex_planner.optimal_control.constrained_motion import ConstrainedMotion
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.optimal_control.torque_offset import OffsetProblem
from flex_planner.planning.plan import Plan
from flex_planner.planning.smooth_torques import add_torques
import numpy as np
from numpy.typing import ArrayLike

# points of an interval
_STAGES = 8
# below which nothing is planned any more [s]
LEAST_LEFT = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Departure:
    """
    Where, and with which torque, a motion leaves a plan that runs.

    Attributes
    ----------
    plan : Plan
        That runs, of n joints and n_t coordinates.
    at : float
        When, on its clock [s].
    state : numpy.ndarray, shape (2 n_t,)
        Of the arm then.
    torque : numpy.ndarray, shape (n,)
        That acts then [N m].
    torque_rate_weight : numpy.ndarray, shape (n,) or (0,)
        Price of the rates of the torques, which begin with the one that acts; empty: they may
        jump.

    """

    plan: Plan
    at: float
    state: Array
    torque: Array
    torque_rate_weight: Array

    @classmethod
    def of(cls, plan: Plan, at: float, state: ArrayLike | None = None,
           torque: ArrayLike | None = None,
           torque_rate_weight: ArrayLike | None = None) -> Departure:
        """
        Return it; what is not given is as the plan has it then.

        Raises
        ------
        InvalidTaskError
            If the plan is none that can be left in motion.
        InvalidValueError
            If a value breaks its bound.

        """
        _check(plan)
        at = number('at', at, at_least=0, at_most=plan.task.duration - LEAST_LEFT, unit='s')
        assert plan.solution is not None
        size, n = 2 * plan.arm.n_coordinates, plan.arm.n_joints
        weight = plan.task.torque_rate_weight if torque_rate_weight is None else np.atleast_1d(
            np.asarray(torque_rate_weight, dtype=float))
        return cls(
            plan=plan, at=at,
            state=plan.solution(np.array([at]))[0, :size] if state is None else vector(
                'state', state, size),
            torque=plan.torques(at)[0] if torque is None else vector(
                'torque', torque, n, unit='N m'), torque_rate_weight=weight)

    @property
    def left(self) -> float:
        """Return the time until the arrival of the plan that runs [s]."""
        return self.plan.task.duration - self.at

    def problem(self, goal: ArrayLike | None, duration: float) -> MotionProblem:
        """
        Return the motion to rest at joint angles (n,), those of the plan by default.

        Raises
        ------
        InvalidValueError
            If goal or duration break their bounds.
        HoldingError
            If a motor is too weak to hold the arm at the goal.

        """
        plan, n, n_t = self.plan, self.plan.arm.n_joints, self.plan.arm.n_coordinates
        none: Any = ()
        task = replace(plan.task, start_positions=self.state[:n],
                       start_velocities=self.state[n_t:],
                       start_modal_displacements=self.state[n:n_t], start_point=none,
                       goal_point=none, duration=duration,
                       torque_rate_weight=self.torque_rate_weight,
                       goal_positions=plan.problem.goal[:n] if goal is None else np.asarray(goal))
        problem = MotionProblem(plan.model, task, task_parameters(task))
        if problem.torque_ends is not None:
            problem.torque_ends = replace(problem.torque_ends, start=self.torque)
        return problem

    def guess(self, problem: MotionProblem, intervals: int,
              until: float | None = None) -> CollocationSolution:
        """Return the plan up to a time on its clock, stretched, on an even mesh, as a guess."""
        assert self.plan.solution is not None
        known, rule = self.plan.solution, GaussRule.of(_STAGES)
        left = (self.plan.task.duration if until is None else until) - self.at
        mesh = np.linspace(0, left, intervals + 1, dtype=np.float64)
        times = (mesh[:-1, None] + left / intervals * rule.nodes).ravel() + self.at
        stages = known.rate(times).reshape(intervals, _STAGES, -1)
        rest = CollocationSolution(mesh, known(mesh + self.at), stages, rule)
        return self._with_unknowns_of(problem, rest).stretched(problem.task.duration / left)

    def _with_unknowns_of(self, problem: MotionProblem,
                          rest: CollocationSolution) -> CollocationSolution:
        """Return a motion of the plan with torques among its unknowns, or without."""
        if problem.size > self.plan.problem.size:
            return add_torques(problem, self.plan.problem, rest)
        size = problem.size
        return CollocationSolution(rest.mesh, rest.nodes[:, :size], rest.stages[..., :size],
                                   rest.rule)


def _check(plan: Plan) -> None:
    """Refuse a plan whose rest is not a motion like any other."""
    problem, task = plan.problem, plan.task
    reasons = {'is not solved': not plan.solved,
               'does not end at rest': not task.ends_at_rest,
               'has via points': bool(task.via_points),
               'has a free duration': bool(task.time_weight),
               'has limits on the way': bool(task.path_constraints)
               or (isinstance(problem, ConstrainedMotion) and not problem.layout.torques),
               'has bounds of torque rates': bool(task.max_torque_rate.size),
               'forgives errors of the model': isinstance(problem, OffsetProblem)}
    for reason, holds in reasons.items():
        if holds:
            raise InvalidTaskError(f'the running plan {reason}, and such a plan is not planned '
                                   'again in motion: let it end, or plan with plan_path')
