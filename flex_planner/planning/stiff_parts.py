"""
Which links and joints of an arm are too stiff to vibrate in step with a motion.

Decided before any motion is known, by the linear arm at both ends of the task.

"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from flex_planner.arms.arm import Arm
from flex_planner.dynamics.statics import natural_modes
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.planning.certificate import CertificateLimits
from flex_planner.planning.ringing import FastVibrations, Mask
import numpy as np

# share of J that it may cost at most to bring to rest what is not planned; the same where no mesh
# follows the vibrations
NEGLIGIBLE, UNRESOLVED = 1e-5, 1e-4
# intervals of an exact solution, in units of those that overlook nothing
_EXACT = 3
# share of what jumps may leave that is looked at: the certificate decides, and joints seldom act
# as one
_HOPE = 0.5
# radians by which a soft vibration may be out of step at the goal because stiff parts give way
_OUT_OF_STEP = 1e-3


@dataclass(frozen=True, slots=True)
class StiffParts:
    """
    Links and joints of an arm that follow a motion quasi-statically.

    Attributes
    ----------
    links, joints : tuple of int
        Counted from 0; the joints are elastic ones.

    """

    links: tuple[int, ...] = ()
    joints: tuple[int, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.links or self.joints)

    def __str__(self) -> str:
        named = [_numbered(kind, indices) for kind, indices in (
            ('link', self.links), ('elastic joint', self.joints)) if indices]
        return ' and '.join(named)

    @property
    def count(self) -> int:
        """Return how many parts there are."""
        return len(self.links) + len(self.joints)

    def mask(self, arm: Arm) -> Mask:
        """Return which coordinates (n_t,) of an arm are theirs."""
        return np.isin(list(_owners(arm)), [*self.links, *(~i for i in self.joints)]) & (
            np.arange(arm.n_coordinates) >= arm.n_joints)

    def rigid(self, arm: Arm) -> Arm:
        """Return an arm in which they are rigid."""
        joints = [replace(joint, elasticity=None) if i in self.joints else joint
                  for i, joint in enumerate(arm.joints)]
        return replace(arm.with_rigid_links(self.links), joints=tuple(joints))


def find_stiff_parts(problem: MotionProblem, stages: int, max_intervals: int) -> StiffParts:
    """
    Return the parts that are stiff in a task.

    Of all parts those are left out, one by one, to which the slowest vibration belongs, until the
    others are stiff together: to bring their vibrations to rest would cost a negligible share of
    J, and a torque that takes no notice of them leaves less at the goal than a certificate allows.
    Both without damping, by which what is left dies out.

    Parameters
    ----------
    problem : MotionProblem
        Of the arm as it is.
    stages, max_intervals : int
        Of the solver.

    """
    if not _vibrates(problem):
        return StiffParts()
    arm, share = problem.model.arm, negligible_share(problem, stages, max_intervals)
    parts = StiffParts(links=tuple(i for i, link in enumerate(arm.links) if link.modes),
                       joints=arm.elastic_joints)
    while parts:
        slowest = _find_soft_vector(problem, parts, share)
        if slowest is None:
            break
        parts = _without(parts, int(np.array(list(_owners(arm)))[slowest]))
    return parts


def _vibrates(problem: MotionProblem) -> bool:
    """Return whether all that bends swings back: what has no frequency is not stiff."""
    n_t = problem.model.arm.n_coordinates
    return all(bool((natural_modes(problem.model, end[:n_t], problem.parameters,
                                   locked=True)[0] > 0).all())
               for end in (problem.start, problem.goal))


def negligible_share(problem: MotionProblem, stages: int, max_intervals: int) -> float:
    """Return the share of J that vibrations may cost which are not planned."""
    resolved = _EXACT * problem.fewest_intervals(stages) <= max_intervals
    return NEGLIGIBLE if resolved else UNRESOLVED


def _find_soft_vector(problem: MotionProblem, parts: StiffParts, share: float) -> int | None:
    """Return the coordinate that takes most part in the slowest vibration; None if all is well."""
    mask, n_t = parts.mask(problem.model.arm), problem.model.arm.n_coordinates
    for end in (problem.start, problem.goal):
        rest = np.concatenate([end[:n_t], np.zeros(n_t)])
        fast = FastVibrations.about(problem, rest, mask)
        if not (fast.share_at_most() <= share and _is_in_step(fast) and _comes_to_rest(fast)):
            slowest = np.abs(fast.vectors[:, 0]) * np.sqrt(np.abs(np.diag(fast.stiffness)))
            return int(np.where(mask, slowest, -1.0).argmax())
    return None


def _is_in_step(fast: FastVibrations) -> bool:
    """Return whether the other vibrations stay in step if stiff parts are rigid."""
    problem, n = fast.problem, fast.problem.model.arm.n_joints
    others = np.flatnonzero(~fast.stiff)
    if others.size == n:
        return True
    from scipy.linalg import eigh  # see `ArmDynamics.prepare`

    soft, block = others[n:], np.ix_(others, others)
    held = np.zeros_like(fast.stiffness)
    held[np.ix_(soft, soft)] = fast.stiffness[np.ix_(soft, soft)]
    rate = float(np.sqrt(eigh(held[block], fast.mass[block], eigvals_only=True)[-1]))
    late = (rate / fast.rates[0])**2 * rate * problem.task.duration
    return bool(late <= _OUT_OF_STEP)


def _comes_to_rest(fast: FastVibrations) -> bool:
    """Return whether the jumps of least effort leave less than a certificate allows."""
    problem, n = fast.problem, fast.problem.model.arm.n_joints
    travel = np.maximum(np.abs(problem.goal - problem.start)[:n], 0.1)
    torque = np.abs(fast.mass[:n, :n]) @ (6 * travel / problem.task.duration**2)
    limits = CertificateLimits(boundary_error=problem.task.tolerance)
    left = _HOPE * fast.amplitudes(fast.bends_under(torque))
    return not limits.violations(fast.foresee(left))


def _owners(arm: Arm) -> Iterator[int]:
    """Yield the link of each coordinate (n_t,), and ``~i`` for joint i or its twist."""
    yield from (~i for i in range(arm.n_joints))
    yield from (~i for i in arm.elastic_joints)
    for i, link in enumerate(arm.links):
        yield from [i] * link.modes


def _without(parts: StiffParts, owner: int) -> StiffParts:
    """Return parts without a link, or without joint i for ``~i``."""
    return StiffParts(links=tuple(i for i in parts.links if i != owner),
                      joints=tuple(i for i in parts.joints if i != ~owner))


def _numbered(kind: str, indices: tuple[int, ...]) -> str:
    """Return parts of a kind by their numbers."""
    numbers = ' and '.join(str(i + 1) for i in indices)
    return f'{kind}{"s" if indices[1:] else ""} {numbers}'


def fastest_turn(problem: MotionProblem) -> float:
    """Return the angle through which the fastest vibration turns during a motion [rad]."""
    n_t = problem.model.arm.n_coordinates
    rates, _ = natural_modes(problem.model, problem.start[:n_t], problem.parameters, locked=False)
    return float(np.nan_to_num(rates).max()) * problem.task.duration
