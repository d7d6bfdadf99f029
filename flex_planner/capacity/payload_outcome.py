"""The outcome of a search for the maximum payload in words, and what is proved from above."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.capacity.results import describe_kinds, MaxPayload
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.plan import PlanStatus
from flex_planner.planning.proofs import bound_payload
import numpy as np

# of a bound that is reached, which gives away a millionth itself
_ROUNDING = 2e-6


def with_bound(found: MaxPayload, problem: MotionProblem) -> MaxPayload:
    """Return an outcome with what is proved from above."""
    bound = bound_payload(problem, found.payload)
    return replace(found, proved_upper=bound.payload, proof=bound.proof)


def describe(found: MaxPayload) -> MaxPayload:
    """Return an outcome in words, with its limiting motor."""
    if found.plan is None or not found.plan.solved:
        return found
    joint, shares = found.limiting_joint, found.plan.saturation
    joint = int(shares.argmax()) if joint is None else joint
    if found.within_limits:  # which may limit the payload without any motor
        return replace(found, limiting_joint=joint if shares[joint] > 0 else None)
    found = replace(found, limiting_joint=joint)
    if found.status is not PlanStatus.SOLVED:
        return replace(found, message=f'{found.message} ({found.payload:.6g} kg are certified)')
    if found.held:
        proved = found.proved_upper <= found.local_upper * (1 + _ROUNDING)
        more = f'more than {found.local_upper:.6g} kg' if found.trials else 'more'
        return replace(found, message=(
            f'{found.payload:.6g} kg can be carried, certified; joint {joint + 1} can hold no '
            f'{more} at the goal{": no motion carries more" if proved else ""}'))
    words = [f'{found.payload:.6g} kg can be carried, certified{describe_kinds(found)}',
             f'{found.upper_means} {found.local_upper:.6g} kg: the motor of joint {joint + 1} is '
             f'on its limit for {shares[joint]:.1%} of the time']
    if np.isfinite(found.proved_upper):
        words.append(f'no motion carries more than {found.proved_upper:.4g} kg')
    return replace(found, message='; '.join(words))
