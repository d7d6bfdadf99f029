"""The same motion of an arm that is easier to move: stiffer, and with friction that is smoother."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.strategies.friction_homotopy import soften_friction

# how many times as stiff, and speeds within which friction changes sides, as in `soften_friction`
_STIFFER, _SLOWLY = 10.0, 4.0


def ease_arm(problem: MotionProblem) -> Callable[[float], MotionProblem] | None:
    """
    Return problems of easier arms; None where nothing of the arm could be easier.

    Returns
    -------
    callable or None
        From a share to a problem: the easiest at 0, that of the arm at 1.

    """
    softened = soften_friction(problem, _SLOWLY)
    if softened is None and not problem.model.arm.n_modes:
        return None

    def at(share: float) -> MotionProblem:
        if share == 1:
            return problem
        parameters = (problem if softened is None else softened(share)).parameters
        stiffer = replace(parameters, rigidity=_STIFFER ** (1 - share) * parameters.rigidity)
        return MotionProblem(problem.model, problem.task, stiffer, via_times=problem.junctions)

    return at
