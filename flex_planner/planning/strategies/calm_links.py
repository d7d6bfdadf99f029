"""
Motions of links that ring at no cost: with a price on the speed of bending, which then falls.

Where a link is clamped to a joint with little inertia, its motor drives the bending directly, and
what rings without damping costs nothing once it rings. There Newton's method is led astray by
motions that ring more and more, some of them a little cheaper. With a price on the speed of
bending the motion of the arm made rigid, bent as its forces bend the links, is so near that a few
iterations with the Jacobian of every stage suffice, on a mesh that resolves the fastest vibration.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.base.progress import StoppedError
from flex_planner.base.validation import Array
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    GaussRule,
    INTERRUPTED,
    Solver,
)
from flex_planner.collocation.newton import newton
from flex_planner.collocation.newton_outcome import NewtonOutcome
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.planning.strategies.homotopies import (
    bending_masses,
    coordinate_masses,
    with_parameters,
)
from flex_planner.planning.strategies.initial_guesses import solve_rigid
from flex_planner.planning.strategies.quasi_static_lift import bend_quasi_statically
from flex_planner.planning.strategies.strategy import Attempt, Substitute
from flex_planner.planning.warnings import bends_at_once
import numpy as np

# the first price of the kinetic energy of bending and the lowest before it is dropped, in units of
# `_price_unit`; by what it falls at first, and at least
_FIRST, _LAST, _FALL, _LEAST_FALL = 3.0, 1e-6, 10.0, 2.5
# stiffness of the links from which they soften, where the rigid motion is not near enough, and by
# what it falls at first, and at least
_STIFFER, _SOFTER, _LEAST_SOFTER = 10.0, 3.2, 1.1
# of the mesh, in units of that which overlooks nothing, and of Newton's method on it: as the price
# falls, many iterations show that links begin to ring
_STAGES, _FINE, _TOLERANCE, _PATIENCE, _PATIENCE_FALLING, _EASY = 4, 2.0, 1e-3, 15, 6, 4


def calm_links(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """
    Start near the rigid motion with a price on the speed of bending, and lower it to nothing.

    Where it cannot be lowered so far, and the arm `bends_at_once`, the attempt has the motion of
    the lowest price as a substitute. None for other methods, rigid arms, via points, and torques
    that are states.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    if not (solver.is_own and problem.model.arm.n_passive):
        return None
    if problem.junctions.size or problem.layout.torques:
        return None
    motion = solve_rigid(problem, solver)
    if motion is None or not motion.converged:
        return None if motion is None else Attempt(result=motion)
    walk = _Walk(problem, solver.with_settings(exact=True))
    calm = walk.begin(motion.solution)
    if not calm.converged:
        return Attempt(result=_failed(calm))
    return walk.lower_price(calm.solution)


class _Walk:
    """Motions at falling prices of the same arm, on one mesh."""

    def __init__(self, problem: MotionProblem, solver: Solver) -> None:
        self._problem, self._solver = problem, solver
        self._unit, self._masses = _price_unit(problem), bending_masses(problem)

    def begin(self, rigid: CollocationSolution) -> NewtonOutcome:
        """Return the motion at the first price, from the rigid one or by way of stiffer links."""
        outcome = self._start(1.0, rigid)
        if outcome.converged:
            return outcome
        outcome = self._start(_STIFFER, rigid)
        return self._soften(outcome.solution) if outcome.converged else outcome

    def _soften(self, point: CollocationSolution) -> NewtonOutcome:
        """Return the motion of the arm as it is from that of stiffer links."""
        stiffness, fall = _STIFFER, _SOFTER
        while True:
            softer = max(stiffness / fall, 1.0)
            ahead = self._with(_FIRST, softer)
            outcome = self._solve(ahead, point.on_mesh(self._mesh(ahead)))
            if outcome.converged:
                if softer == 1.0:
                    return outcome
                stiffness, point = softer, outcome.solution
            elif fall < _LEAST_SOFTER:
                return outcome
            else:
                fall **= 0.5

    def lower_price(self, calm: CollocationSolution) -> Attempt:
        """Return the motion without a price, or the failure with the one at the lowest price."""
        price, fall, point = _FIRST, _FALL, calm
        while fall >= _LEAST_FALL:
            lower = price / fall if price > _LAST else 0.0
            outcome = self._solve(self._with(lower), point, _PATIENCE_FALLING)
            if not outcome.converged:
                fall **= 0.5
                continue
            price, point = lower, outcome.solution
            if not price:
                break
            fall **= 1.5 if outcome.iterations <= _EASY else 1.0
        if not price:
            return Attempt(result=self._solver.solve(self._problem, point))
        failed = _failed(outcome)
        if not bends_at_once(self._problem.task.arm):
            return Attempt(result=failed)
        found = self._substitute(price, point)
        if found.result.status in INTERRUPTED:
            return Attempt(result=found.result)
        return Attempt(result=failed, substitute=found if found.result.converged else None)

    def _substitute(self, price: float, point: CollocationSolution) -> Substitute:
        """Return the motion of a task with a price, solved exactly."""
        task = self._problem.task
        calm = replace(task, velocity_weights=task.velocity_weights
                       + price * self._unit * self._masses)
        problem = MotionProblem(self._problem.model, calm, task_parameters(calm))
        return Substitute(problem=problem, result=self._solver.solve(problem, point))

    def _start(self, stiffness: float, rigid: CollocationSolution) -> NewtonOutcome:
        """Return the motion at the first price of an arm so many times as stiff."""
        problem = self._with(_FIRST, stiffness)
        return self._solve(problem, bend_quasi_statically(
            problem, rigid, self._mesh(problem), GaussRule.of(_STAGES)))

    def _with(self, price: float, stiffness: float = 1.0) -> MotionProblem:
        """Return the problem with a price in units, and links so many times as stiff."""
        given = self._problem.parameters
        return with_parameters(
            self._problem, rigidity=stiffness * given.rigidity,
            velocity_weights=given.velocity_weights + price * self._unit * self._masses)

    def _mesh(self, problem: MotionProblem) -> Array:
        """Return the mesh on which the vibrations of a problem are resolved."""
        settings = self._solver.settings
        count = max(settings.intervals, int(_FINE * problem.fewest_intervals(_STAGES)))
        return np.linspace(0, problem.task.duration, min(count, settings.max_intervals) + 1,
                           dtype=np.float64)

    def _solve(self, problem: MotionProblem, guess: CollocationSolution,
               patience: int = _PATIENCE) -> NewtonOutcome:
        """Return where Newton's method comes to from a guess on its mesh."""
        outcome = newton(problem, guess, tolerance=_TOLERANCE, max_iterations=patience,
                         monitor=self._solver.monitor, exact=True)
        if outcome.stopped:
            raise StoppedError(outcome.stopped)
        return outcome


def _price_unit(problem: MotionProblem) -> float:
    """Return the price at which the speeds of a motion count about as much as its torques."""
    inertias = coordinate_masses(problem)[:problem.model.arm.n_joints]
    return float((problem.parameters.effort_weights * inertias).max() / problem.task.duration**2)


def _failed(outcome: NewtonOutcome) -> CollocationResult:
    """Return the failure of Newton's method as a result."""
    failed = CollocationResult.failed(outcome.solution, outcome.message)
    return replace(failed, iterations=outcome.iterations)
