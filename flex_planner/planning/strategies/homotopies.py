"""
Homotopies to a motion: in the weights, in a price on vibration, in the stiffness of the links.

Each function is the `attempt` of a `Strategy`, see `catalogue`.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from flex_planner.base.validation import Array
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    follow_homotopy,
    Solver,
)
from flex_planner.optimal_control.motion_problem import MotionProblem, task_parameters
from flex_planner.planning.strategies.strategy import Attempt
import numpy as np

# the smallest weight that a homotopy starts with, and what one in stiffness starts with
_FIRST_WEIGHT, _STIFFER = 1.0, 10.0
# first price of the kinetic energy of bending [1/s], and how far it falls before it is dropped
_CALM, _DECADES = 1.0, 5.0
# the same of all kinetic energy, in units of the effort that holding and moving the arm takes
_FIRST_SPEED_PRICE, _SPEED_DECADES = 10.0, 4.0
# of the first mesh of a homotopy
_FIRST_INTERVALS = 60


def raise_weights(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """Start without position and velocity weights and raise them tenfold at a time."""
    if not has_weights(problem):
        return None
    at, first_step = _weights_at(problem)
    return _follow_from_line(at, solver, first_step)


def raise_weights_from(problem: MotionProblem, solution: CollocationSolution,
                       solver: Solver) -> CollocationResult:
    """Start from the motion of the same task without position and velocity weights."""
    if not has_weights(problem):
        return solver.solve(problem, solution)
    at, first_step = _weights_at(problem)
    return follow_homotopy(at, solution, solver, first_step)


def has_weights(problem: MotionProblem) -> bool:
    """Return whether anything but effort counts."""
    return bool(problem.parameters.path_weights.any())


def drop_weights(problem: MotionProblem) -> MotionProblem:
    """Return the problem with nothing but effort to count."""
    return _weights_at(problem)[0](0.0)


def without_weights(problem: MotionProblem) -> MotionProblem:
    """Return the problem of a task that has nothing but effort to count, see `drop_weights`."""
    task = replace(problem.task, position_weights=np.zeros(0), velocity_weights=np.zeros(0))
    return MotionProblem(problem.model, task, task_parameters(task))


def _weights_at(problem: MotionProblem) -> tuple[Callable[[float], MotionProblem], float]:
    """Return the problem with its weights raised by a share, and the first share."""
    parameters = problem.parameters
    decades = np.log10(max(float(parameters.path_weights.max()) / _FIRST_WEIGHT, 1.0))

    def at(share: float) -> MotionProblem:
        scale = 10.0 ** (decades * (share - 1)) if share else 0.0
        return MotionProblem(problem.model, problem.task, parameters.scale_path_weights(scale))

    return at, 1 / (1 + decades)


def lower_vibration_price(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """
    Start with a price on the bending rates, which keeps the links from ringing, and lower it.

    Links that bend at their ends are driven by the hub torques so directly that a motion of
    least effort lets them ring. Many motions that ring are stationary, or nearly so; the one
    without is alone.

    """
    if not problem.model.arm.n_passive:
        return None
    return _follow_from_line(_calm(problem), solver, first_step=1 / _DECADES)


def lower_speed_price(problem: MotionProblem, solver: Solver) -> Attempt:
    """
    Start with a price on the kinetic energy of all coordinates, and lower it.

    Motions that swing, through the hanging posture for example, are dear while it is high.

    """
    mass = coordinate_masses(problem)
    n, duration = problem.model.arm.n_joints, problem.task.duration
    speeds = (problem.goal - problem.start)[:n] / duration
    effort = float(problem.parameters.effort_weights @ problem.holding_torque**2) + (
        float(problem.parameters.effort_weights @ (mass[:n] * speeds / duration)**2))
    first = _FIRST_SPEED_PRICE * effort / max(float(mass[:n] @ speeds**2), np.finfo(float).tiny)

    def at(share: float) -> MotionProblem:
        price = first * 10.0 ** (-_SPEED_DECADES * share) if share < 1 else 0.0
        weights = problem.parameters.velocity_weights + price * mass
        return with_parameters(problem, velocity_weights=weights)

    return _follow_from_line(at, solver, first_step=1 / _SPEED_DECADES)


def soften_links(problem: MotionProblem, solver: Solver) -> Attempt | None:
    """Start with stiffer links and a price on the bending rates; soften, then lower the price."""
    if not problem.model.arm.n_passive:
        return None
    calmed = _calm(problem)(0.0)

    def soften(share: float) -> MotionProblem:
        stiffer = _STIFFER ** (1 - share)
        return with_parameters(calmed, rigidity=stiffer * problem.parameters.rigidity)

    soft = _follow_from_line(soften, solver.loose(), first_step=0.25)
    if not soft.result.converged:
        return soft
    return Attempt(result=follow_homotopy(_calm(problem), soft.result.solution, solver,
                                          first_step=1 / _DECADES))


def coordinate_masses(problem: MotionProblem) -> Array:
    """Return what moves with each coordinate at the start, shape (n_t,) [kg], [kg m^2]."""
    masses: Array = np.diag(problem.model.mass_and_energy(
        problem.start[None], problem.parameters.physical)[0][0])
    return masses


def bending_masses(problem: MotionProblem) -> Array:
    """Return what moves with the bending, see `coordinate_masses`; 0 for joints."""
    bends = np.arange(problem.model.arm.n_coordinates) >= problem.model.arm.n_joints
    return np.where(bends, coordinate_masses(problem), 0.0)


def _calm(problem: MotionProblem) -> Callable[[float], MotionProblem]:
    """Return the problem with a price on the kinetic energy of bending, falling to none."""
    added = bending_masses(problem)

    def at(share: float) -> MotionProblem:
        price = _CALM * 10.0 ** (-_DECADES * share) if share < 1 else 0.0
        weights = problem.parameters.velocity_weights + price * added
        return with_parameters(problem, velocity_weights=weights)

    return at


def with_parameters(problem: MotionProblem, **changes: Any) -> MotionProblem:
    """Return a problem with other parameters."""
    return MotionProblem(problem.model, problem.task, replace(problem.parameters, **changes))


def _follow_from_line(problem_at: Callable[[float], MotionProblem], solver: Solver,
                      first_step: float) -> Attempt:
    """Solve the first problem from a straight line and follow the homotopy from there."""
    first = problem_at(0.0)
    guess = first.straight_line(min(_FIRST_INTERVALS, solver.settings.max_intervals),
                                solver.settings.rule)
    result = solver.loose().solve(first, guess)
    if result.converged:
        result = follow_homotopy(problem_at, result.solution, solver, first_step)
    return Attempt(result=result)
