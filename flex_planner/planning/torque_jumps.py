"""Jumps of the planned torque: at both ends against holding the arm, and on the way."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.optimal_control.motion_problem import MotionProblem
import numpy as np

# share of the duration: what changes within it is a jump. Eq. (14) makes the torque continuous,
# but near the largest payload it runs from limit to limit within a microsecond
_AT_ONCE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class TorqueJump:
    """
    The largest jump of a torque at one place.

    Attributes
    ----------
    place : str
        For people.
    joint : int
        Index, from 0.
    time : float
        [s].
    share : float
        Of the stall torque of the motor [-].

    """

    place: str
    joint: int
    time: float
    share: float

    def __str__(self) -> str:
        """Return the jump in words."""
        return f'{self.share:.0%} {self.place} (joint {self.joint + 1})'


def find_torque_jumps(problem: MotionProblem, times: Array, torques: Array) -> list[TorqueJump]:
    """
    Return the jumps of a motion: at the start, on the way and at the end, of the worst joint each.

    At an end where the arm rests the torque jumps from or to what holds it there; where it does
    not, what the motors do before or after is unknown, and nothing is said.

    Parameters
    ----------
    problem : MotionProblem
        Of n joints, one of them with a limit of its torque.
    times : numpy.ndarray, shape (k,)
        Not descending, from the start to the end of the motion, switching times among them [s].
    torques : numpy.ndarray, shape (k, n)
        [N m].

    Returns
    -------
    list of TorqueJump
        In order; empty if no motor has a limit.

    """
    stall = np.array([joint.motor.standstill_torque for joint in problem.task.arm.joints])
    if not np.isfinite(stall).any():
        return []
    n_t, found = problem.model.arm.n_coordinates, []
    if not problem.start[n_t:].any():
        start = _holding_torque(problem, problem.start[:n_t])
        found.append(_worst('at the start', (torques[0] - start) / stall, times[:1]))
    later = _after(times, torques, _AT_ONCE * problem.task.duration)
    found.append(_worst('on the way', (later - torques) / stall, times))
    if problem.task.ends_at_rest:
        end = _holding_torque(problem, problem.goal[:n_t])
        found.append(_worst('at the end', (end - torques[-1]) / stall, times[-1:]))
    return found


def _holding_torque(problem: MotionProblem, coordinates: Array) -> Array:
    """Return the torque that holds the arm at rest, shape (n,) [N m]."""
    force, _ = problem.model.static_forces(coordinates[None], problem.parameters.physical)
    return force[0, :problem.model.arm.n_joints]


def _after(times: Array, torques: Array, lapse: float) -> Array:
    """Return the torques a moment later, shape (k, n)."""
    return np.column_stack([np.interp(times + lapse, times, torque) for torque in torques.T])


def _worst(place: str, jumps: Array, times: Array) -> TorqueJump:
    """Return the largest of jumps (k, n) or (n,)."""
    shares = np.abs(np.atleast_2d(jumps))
    k, i = np.unravel_index(int(shares.argmax()), shares.shape)
    return TorqueJump(place=place, joint=int(i), time=float(times[k]), share=float(shares[k, i]))
