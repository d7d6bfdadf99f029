"""Solutions of the necessary conditions along a continuation in price, and their gap."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from flex_planner.collocation import CollocationResult, CollocationSolution, INTERRUPTED
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np

# from a payload or duration to how far from the limit is near enough
TargetGap = Callable[[float], float]


def no_target(value: float) -> float:
    """Return 0: go as far as the prices lead."""
    return 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Extremal:
    """
    A motion that solves the necessary conditions, with a payload or a duration at its price.

    Attributes
    ----------
    value : float
        Payload [kg] or duration [s].
    price : float
        What a little more payload, or a little less time, adds to J [1/kg, 1/s]; 0 if unknown.
    result : CollocationResult
        Of the motion with this payload and duration; where it is not a solution, the continuation
        ends for want of one.
    problem : MotionProblem
        That it solves.

    """

    value: float
    price: float
    result: CollocationResult
    problem: MotionProblem

    @property
    def interrupted(self) -> bool:
        """Return whether the monitor ended the search here."""
        return self.result.status in INTERRUPTED

    @cached_property
    def gap(self) -> float:
        """
        Return how far the limit is at most: the motors' torque reserve over the price of more.

        J is convex along the continuation where no weights but R count, and cannot grow by more
        than `torque_reserve` as long as the motion stays of its kind.

        """
        if not self.price:
            return np.inf
        return torque_reserve(self.problem, self.result.solution) / self.price


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchStart:
    """
    What a search may start from: a motion on the way to the limit of a similar task.

    Attributes
    ----------
    value, price : float
        As of `Extremal`.
    solution : CollocationSolution
        Of that motion.

    """

    value: float
    price: float
    solution: CollocationSolution

    @classmethod
    def of(cls, extremal: Extremal) -> SearchStart:
        """Return an extremal as a start."""
        return cls(value=extremal.value, price=extremal.price,
                   solution=extremal.result.solution)


def torque_reserve(problem: MotionProblem, solution: CollocationSolution) -> float:
    """
    Return the growth of a motion's cost if every motor were on its limit all the time.

    At the speeds and in the directions that it has; infinite for motors without limits.

    """
    model, parameters = problem.model, problem.parameters
    n, n_t = model.arm.n_joints, model.arm.n_coordinates
    z = solution.stage_values().reshape(-1, problem.size)
    torque = model.controls(z, problem.p).torque
    bound = parameters.torque_limits.toward(torque, z[:, n_t:n_t + n])
    weights = (solution.steps[:, None] * solution.rule.weights).ravel()
    return float(weights @ ((bound**2 - torque**2) @ parameters.effort_weights)) / 2
