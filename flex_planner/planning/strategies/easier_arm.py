"""The motion of an arm that is easier to move: stiffer, and with friction that is smoother."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.friction_homotopy import soften_friction

# how many times as stiff, and speeds within which friction changes sides, as in `soften_friction`
_STIFFER, _SLOWLY = 10.0, 4.0


Easier = Callable[[float], MotionProblem]
"""From a share to a problem: of the easiest arm at 0, of the arm itself at 1."""


def ease_arm(problem: MotionProblem) -> Iterator[Easier]:
    """Yield problems of easier arms: with smoother friction, if there is any, then stiffer too."""
    softened = soften_friction(problem, _SLOWLY)
    if softened is not None:
        yield softened
    if problem.model.arm.n_modes:
        yield partial(_stiffen, softened or (lambda share: problem))


def _stiffen(softened: Easier, share: float) -> MotionProblem:
    """Return one of some problems with stiffer links."""
    problem = softened(share)
    if share == 1:
        return problem
    stiffer = _STIFFER ** (1 - share) * problem.parameters.rigidity
    return MotionProblem(problem.model, problem.task, replace(
        problem.parameters, rigidity=stiffer), via_times=problem.junctions)
