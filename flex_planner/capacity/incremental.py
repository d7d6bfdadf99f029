"""
The paper's search for the maximum payload: Korayem et al. 2009, section 4.2 and fig. 2.

The payload is raised by a step while the boundary-value problem can be solved; where it cannot,
the step is halved, until it is as small as the accuracy. What failed is then tried again from
there: Newton's method may have failed for want of a good start.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from flex_planner.base.errors import FlexPlannerError
from flex_planner.collocation import (
    CollocationResult,
    CollocationSolution,
    INTERRUPTED,
    Solver,
)
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.certificate import simulate_to_goal
from flex_planner.planning.strategies.catalogue import QUICK
from flex_planner.planning.strategies.initial_guesses import warm_start
from flex_planner.planning.verdict import find_refusal
import numpy as np

_RTOL = 1e-8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadTrial:
    """
    A payload that was tried.

    Attributes
    ----------
    payload : float
        [kg].
    step : float
        That led to it [kg].
    solved : bool
        Whether the motion was found, meets the task's tolerance and keeps the arm's limits.
    boundary_error : float
        Left side of eq. (17) with W_p = W_v = 1, where the torque found leads; also of a motion
        that is no solution.
    refusal : str
        Why the arm may not do a motion that was found, see `find_refusal`; empty if it may.

    """

    payload: float
    step: float
    solved: bool
    boundary_error: float
    result: CollocationResult = field(repr=False)
    refusal: str = ''

    @property
    def interrupted(self) -> bool:
        """Return whether the monitor interrupted the search here."""
        return self.result.status in INTERRUPTED


def raise_payload(problem: MotionProblem, first: CollocationSolution, *, step: float,
                  accuracy: float, solver: Solver) -> Iterator[PayloadTrial]:
    """
    Yield the payloads tried, loop (i) raising them and loop (k) halving the step.

    Parameters
    ----------
    problem : MotionProblem
        With the least payload.
    first : CollocationSolution
        Its solution.
    step : float
        First step [kg].
    accuracy : float
        Ends when what failed is no further from what succeeded [kg].
    solver : Solver
        Its monitor may interrupt the search.

    Raises
    ------
    StoppedError
        If the monitor interrupted the search while a motion was re-simulated.

    """
    payload, here, failed, failed_from = problem.task.payload_mass, first, np.inf, np.inf
    first_step = step
    while True:
        while payload + step > failed - step / 2 and failed - payload > accuracy:
            step /= 2
        again = failed - payload <= accuracy
        if again and failed_from >= payload:
            return
        # what failed from a lighter payload may do from one so near
        tried = failed if again else payload + step
        trial = _try_payload(problem, here, tried, tried - payload, solver, again=again)
        if trial is None:
            failed, failed_from = tried, np.inf
            continue
        if again and not (trial.solved or trial.interrupted):
            return
        yield trial
        if trial.interrupted:
            return
        if trial.solved:
            payload, here = trial.payload, trial.result.solution
            failed, step = (np.inf, first_step) if again else (failed, step)
        else:
            failed, failed_from = trial.payload, np.inf if trial.refusal else payload


def _try_payload(problem: MotionProblem, start: CollocationSolution, payload: float, step: float,
                 solver: Solver, *, again: bool) -> PayloadTrial | None:
    """Try a payload from a lighter one's motion, at first from nothing too; None if absurd."""
    solver.monitor.payload = payload
    try:
        heavier = problem.with_changes(payload_mass=payload)
    except FlexPlannerError:  # too heavy to hold
        return None
    result: CollocationResult | None = None
    coarse = solver.coarse()
    for strategy in (warm_start(start), *(() if again else QUICK)):
        attempt = strategy.attempt(heavier, coarse)
        if attempt is not None:
            result = attempt.result
            if result.converged or result.status in INTERRUPTED:
                break
    assert result is not None
    error = np.inf
    if result.converged or not (again or result.status in INTERRUPTED):
        final, goal = simulate_to_goal(heavier, result.solution, solver.monitor, _RTOL)
        error = float(np.nan_to_num((final - goal) @ (final - goal) / 2, nan=np.inf))
    reached = result.converged and error <= problem.task.tolerance
    refused = find_refusal(heavier, result.solution) if reached else None
    return PayloadTrial(payload=payload, step=step, boundary_error=error, result=result,
                        solved=reached and refused is None, refusal=refused[1] if refused else '')
