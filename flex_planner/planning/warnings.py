"""
What a user should know of a plan that is certified all the same.

A certificate says that the arm of the model moves as planned. Warnings say where the arm of the
world may not: where the model ends, where the motors are asked for more than their sheets have,
where the arm is in its own way. They cost a thousandth of a second or two and change nothing.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_points
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.validation import Array
from flex_planner.collocation import CollocationSolution
from flex_planner.optimal_control.motion_problem import MotionProblem
from flex_planner.optimal_control.sampled_motion import sample_motion
from flex_planner.planning.bending import find_bending, keeps_model, LARGEST, NOTABLE
from flex_planner.planning.certificate import CertificateLimits
from flex_planner.planning.link_overlaps import find_overlap
from flex_planner.planning.mode_count import estimate_left_out
from flex_planner.planning.torque_jumps import find_torque_jumps
import numpy as np

# share of the stall torque: after a jump by more, less torque is left to the feedback than the
# jump itself has, so that it cannot make up for a drive that is late
_LARGE_JUMP = 0.5
# of torques and speeds, relative
_ROUNDING = 1e-6
# share of the reach
_NEAR_BASE = 0.1
# of the link's own inertia about its joint: less makes the joint as light as none
_LIGHT_JOINT = 0.01


class WarningKind(Enum):
    """What a warning is about: the name is stable, the value is shown to people."""

    BENDING = 'links bend far'
    TORQUE_JUMPS = 'the torque jumps'
    BRAKING_TORQUE = 'more than the stall torque to brake'
    SPEED_ABOVE_NO_LOAD = 'faster than the no-load speed'
    TIP_NEAR_BASE = 'the tip comes near the base'
    LINKS_OVERLAP = 'links overlap'
    STIFF_LINKS = 'links or joints too stiff to vibrate with the motion'
    PRICE_ON_BENDING = 'a price on the speed of bending that was not asked for'
    JOINT_WITHOUT_INERTIA = 'clamped link on a joint without inertia'
    MODE_FAMILY_ASSUMED = 'a link does not say how it is fixed'
    TOO_FEW_MODES = 'too few modes'
    ARRIVES_ELSEWHERE = 'the controller leads the arm elsewhere'
    LIMIT_PASSED = 'the controller leads the arm beyond a limit'
    SENSITIVE_TO_MODES = 'sensitive to the number of modes'
    SENSITIVE_TO_STIFFNESS = 'sensitive to the stiffness'
    SENSITIVE_TO_PAYLOAD = 'sensitive to the payload'
    OPEN_LOOP_UNSTABLE = 'unstable under the planned torque alone'
    FEEDBACK_UNSTABLE = 'unstable under the feedback'
    NOT_RECORDED = 'not recorded'
    SPACE_ASSUMED = 'start and goal were taken as joint angles'


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanWarning:
    """
    A warning with its figures.

    Attributes
    ----------
    kind : WarningKind
        What it is about.
    sentence : str
        For people.
    value : float or None
        The figure that the sentence tells: a share [-], or a length [m] for `TIP_NEAR_BASE`,
        `TOO_FEW_MODES` and `STIFF_LINKS`; of elastic joints alone, the twist [rad].
    time : float or None
        When, where there is one moment [s].

    """

    kind: WarningKind
    sentence: str
    value: float | None = None
    time: float | None = None


def find_warnings(problem: MotionProblem,
                  solution: CollocationSolution) -> tuple[PlanWarning, ...]:
    """
    Return the warnings of a motion, those of its arm included.

    Parameters
    ----------
    problem : MotionProblem
        Of n joints.
    solution : CollocationSolution
        The motion.

    """
    motion = _Motion.of(problem, solution)
    found = (check(motion) for check in _CHECKS)
    return (*(one for one in found if one is not None), *find_arm_warnings(problem.task.arm))


def find_arm_warnings(arm: Arm) -> tuple[PlanWarning, ...]:
    """Return what is to be known of an arm before any motion; a hint where planning fails."""
    found = (check(arm) for check in (_joints_without_inertia, _assumed_families))
    return tuple(one for one in found if one is not None)


def bends_at_once(arm: Arm) -> bool:
    """Return whether the torque of a motor meets a bending link before it meets any inertia."""
    return _joints_without_inertia(arm) is not None


def warn_of_price(weights: Array) -> PlanWarning:
    """Warn that a plan has velocity_weights (n_t,) that were not asked for."""
    shown = ', '.join(f'{weight:.3g}' for weight in weights)
    return PlanWarning(kind=WarningKind.PRICE_ON_BENDING, value=float(weights.max()), sentence=(
        'the first strategies found no motion without a price on the speed of bending, and others '
        'were not tried: here links that ring cost nothing, and what rings more may be a little '
        f'cheaper. This plan is that of the task with velocity_weights of {shown}, the least that '
        'were reached. With inertia of the joints or damping of the links there is mostly one '
        'without'))


def _joints_without_inertia(arm: Arm) -> PlanWarning | None:
    """Warn of links that are clamped to next to nothing."""
    light = [str(i) for i, (link, joint, node) in enumerate(
        zip(arm.links, arm.joints, arm.nodes, strict=False), 1)
        if link.is_clamped and not joint.is_elastic
        and node.inertia + joint.motor.reflected_inertia < _LIGHT_JOINT * link.rotary_inertia]
    if not light:
        return None
    joints = (f'joints {" and ".join(light)} have hardly any rotary inertia, but links are '
              'clamped to them' if light[1:] else
              f'joint {light[0]} has hardly any rotary inertia, but a link is clamped to it')
    return PlanWarning(kind=WarningKind.JOINT_WITHOUT_INERTIA, sentence=(
        f'{joints}: a torque would bend the link at once, so plans take long and many are not '
        'found. Real motors have a rotor: give rotor_inertia and gear_ratio of the motor, or the '
        'inertia of the hub at the node'))


def _assumed_families(arm: Arm) -> PlanWarning | None:
    """Warn of links whose file does not say how they are fixed."""
    assumed = [str(i) for i, link in enumerate(arm.links, 1) if link.family_assumed]
    if not assumed:
        return None
    links = (f'links {" and ".join(assumed)} have no mode_family and bend between their ends like '
             'beams' if assumed[1:] else
             f'link {assumed[0]} has no mode_family and bends between its ends like a beam')
    return PlanWarning(kind=WarningKind.MODE_FAMILY_ASSUMED, sentence=(
        f'{links} on two supports, as in the paper: the links of real arms are clamped to their '
        'motors (clamped_free), and their tips move when they bend'))


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """
    A motion at the nodes and Gauss points of its mesh, k moments in order.

    `weights` make a quadrature: those of nodes are 0.

    """

    problem: MotionProblem
    solution: CollocationSolution
    times: Array
    weights: Array
    coordinates: Array  # (k, n_t)
    speeds: Array  # (k, n)
    torques: Array  # (k, n)
    points: Array  # (k, n, 2, 2 or 3), both ends of each link

    @classmethod
    def of(cls, problem: MotionProblem, solution: CollocationSolution) -> _Motion:
        points, n_t = sample_motion(problem, solution), problem.model.arm.n_coordinates
        coordinates = points.z[:, :n_t]
        return cls(problem=problem, solution=solution, times=points.times, weights=points.weights,
                   coordinates=coordinates, torques=points.controls.torque,
                   speeds=points.z[:, n_t:n_t + problem.model.arm.n_joints],
                   points=link_points(problem.model.arm, coordinates))

    @property
    def arm(self) -> Arm:
        """Return the arm that moves, with the motors of the task."""
        return self.problem.task.arm


def _bending(motion: _Motion) -> PlanWarning | None:
    """Warn of links that bend beyond what a linear beam does."""
    found, time = find_bending(motion.problem, motion.solution)
    if found.share <= NOTABLE:
        return None
    return PlanWarning(
        kind=WarningKind.BENDING, value=found.share, time=time, sentence=(
            f'link {found.link + 1} bends by {found.share:.0%} of its length at {time:.4g} s: '
            f'beams of the model are linear, which is true up to about {NOTABLE:.0%}'
            + (f'; the motion of least cost would bend them by more than the {LARGEST:.0%} that '
               'the model holds at most, and this one is planned within that'
               if keeps_model(motion.problem.task) else '')))


def _torque_jumps(motion: _Motion) -> PlanWarning | None:
    """Warn of jumps that drives and feedback cannot follow."""
    jumps = find_torque_jumps(motion.problem, motion.times, motion.torques)
    largest = max(jumps, key=lambda jump: jump.share, default=None)
    if largest is None or largest.share <= _LARGE_JUMP:
        return None
    return PlanWarning(
        kind=WarningKind.TORQUE_JUMPS, value=largest.share, time=largest.time, sentence=(
            f'the torque jumps by shares of the stall torque: {", ".join(map(str, jumps))}; '
            'drives follow late, and what they miss makes the arm vibrate'))


def _braking_torque(motion: _Motion) -> PlanWarning | None:
    """Warn where the line of eq. (15) goes on beyond the stall torque, as few drives do."""
    stall = np.array([joint.motor.standstill_torque for joint in motion.arm.joints])
    braking = np.where(motion.torques * motion.speeds < 0, np.abs(motion.torques), 0.0)
    return _beyond(motion, braking, stall, WarningKind.BRAKING_TORQUE, (
        'brakes with {value:.4g} N m at {time:.4g} s, {share:.0%} of its stall torque: its '
        'max_torque allows that much, the current limit of its drive may not'))


def _speed_above_no_load(motion: _Motion) -> PlanWarning | None:
    """Warn of speeds at which a motor can only brake."""
    most = np.array([joint.motor.no_load_speed for joint in motion.arm.joints])
    return _beyond(motion, np.abs(motion.speeds), most, WarningKind.SPEED_ABOVE_NO_LOAD, (
        'turns at {value:.4g} rad/s at {time:.4g} s, {share:.0%} of the no-load speed of its '
        'motor, which then can only brake'))


def _beyond(motion: _Motion, values: Array, limits: Array, kind: WarningKind,
            sentence: str) -> PlanWarning | None:
    """Warn of the joint whose value (k, n) is the largest share of its limit, above 1."""
    shares = values / limits
    k, i = np.unravel_index(int(shares.argmax()), shares.shape)
    share, time = float(shares[k, i]), float(motion.times[k])
    if share <= 1 + _ROUNDING:
        return None
    told = sentence.format(value=float(values[k, i]), time=time, share=share)
    return PlanWarning(kind=kind, value=share, time=time, sentence=f'joint {i + 1} {told}')


def _tip_near_base(motion: _Motion) -> PlanWarning | None:
    """Warn of a tip, or what it carries, that may hit the base."""
    distance = np.linalg.norm(motion.points[:, -1, -1], axis=-1)
    k, reach = int(distance.argmin()), motion.arm.reach
    nearest, time = float(distance[k]), float(motion.times[k])
    if nearest >= _NEAR_BASE * reach:
        return None
    return PlanWarning(
        kind=WarningKind.TIP_NEAR_BASE, value=nearest, time=time, sentence=(
            f'the tip comes to {nearest:.3g} m from the base at {time:.4g} s, '
            f'{nearest / reach:.1%} of the reach of the arm'))


def _links_overlap(motion: _Motion) -> PlanWarning | None:
    """Warn of links that are where others are; whether they hit depends on their planes."""
    if isinstance(motion.arm, SpatialArm):
        return None  # lines in space hardly ever cross: thickness would have to be known
    found = find_overlap(motion.points, motion.coordinates[:, :motion.arm.n_joints])
    if found is None:
        return None
    time = float(motion.times[found.moment])
    return PlanWarning(
        kind=WarningKind.LINKS_OVERLAP, time=time, sentence=(
            f'{found} at {time:.4g} s: they pass only if they move in different planes'))


def _too_few_modes(motion: _Motion) -> PlanWarning | None:
    """Warn of vibrations that the modes of the plan do not have, see `estimate_left_out`."""
    if not motion.problem.task.ends_at_rest or not motion.problem.model.arm.n_passive:
        return None
    left, limit = estimate_left_out(motion.problem.task, motion.times, motion.weights,
                                    motion.torques), CertificateLimits().residual_vibration
    if left <= limit:
        return None
    return PlanWarning(
        kind=WarningKind.TOO_FEW_MODES, value=left, sentence=(
            f'with one mode more in each link the planned torque would leave about '
            f'{float(f"{left * 1e3:.2g}"):g} mm of vibration (an estimate), and a certificate '
            f'allows {limit * 1e3:g} mm: take more modes, or, where links are clamped, a torque '
            'that changes more gently, by weights on rates or a longer duration'))


_CHECKS: tuple[Callable[[_Motion], PlanWarning | None], ...] = (
    _bending, _torque_jumps, _braking_torque, _speed_above_no_load, _tip_near_base,
    _links_overlap, _too_few_modes)
