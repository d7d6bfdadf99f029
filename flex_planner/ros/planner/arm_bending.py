"""How the moving arm is bent: from estimates of others, or the planner's own observer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.control.joint_reference import JointReference
from flex_planner.planning.bending_estimate import TrackedArm
from flex_planner.ros.messages.measured_states import AngleTrack, state_from_estimate
from flex_planner.ros.messages.request_error import RequestError
from flex_planner.ros.messages.times import time_ns
from flex_planner.ros.planner.running_plan import RunningPlan
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import PlanReport
import numpy as np
from sensor_msgs.msg import JointState

# angles that an observer needs at least
_FEWEST = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bending:
    """
    How far the arm is off its plan when another one begins.

    Attributes
    ----------
    source : str
        PLAN, ESTIMATE or OBSERVER, see PlanReport.
    off : numpy.ndarray, shape (2 n_t,)
        [rad], [m], and their rates.

    """

    source: str
    off: Array


class ArmBending:
    """
    Knows how the arm is bent that carries out a plan.

    Parameters
    ----------
    topic : str
        Full name of the topic of estimates.
    names : list of str
        Of the joints, then the modal coordinates.
    angles : AngleTrack
        Of the joints.
    latest : callable
        Returns the latest estimate, None without one.

    """

    def __init__(self, topic: str, names: list[str], angles: AngleTrack,
                 latest: Callable[[], JointState | None]) -> None:
        self._topic, self._names = topic, names
        self._angles, self._latest = angles, latest

    def find(self, running: RunningPlan, start_ns: int, now_ns: int,
             settings: PlannerSettings) -> Bending:
        """
        Return how far the arm will be off its plan at the time of a start.

        Parameters
        ----------
        running : RunningPlan
            That it carries out.
        start_ns, now_ns : int
            By the clock of the node [ns].
        settings : PlannerSettings
            With the controller, tolerances, and how old an estimate may be.

        Raises
        ------
        RequestError
            ARM_STATE_UNKNOWN if an estimate lacks something, NOT_AT_START if joints are farther
            from the plan than `start_tolerance` where `check_start` is on.

        """
        arm, first_ns = _tracked(running, settings), running.track.begin_ns
        oldest_ns = now_ns - round(settings.state_estimate_timeout * 1e9)
        until = (start_ns - first_ns) * 1e-9
        found = (self._estimated(arm, first_ns, oldest_ns, start_ns, until)
                 or self._observed(arm, first_ns, oldest_ns, start_ns, until))
        if found is None or not np.isfinite(found.off).all():
            return Bending(source='PLAN', off=np.zeros(2 * len(self._names)))
        self._check(found, settings)
        return found

    def _estimated(self, arm: TrackedArm, first_ns: int, oldest_ns: int, start_ns: int,
                   until: float) -> Bending | None:
        """Return what the latest estimate leads to; None without one that is new enough."""
        message = self._latest()
        stamp = 0 if message is None else time_ns(message.header.stamp)
        if message is None or not max(oldest_ns, first_ns) <= stamp <= start_ns:
            return None
        state = state_from_estimate(message, self._names, self._topic)
        return Bending(source='ESTIMATE',
                       off=arm.predict(state, (stamp - first_ns) * 1e-9, until))

    def _observed(self, arm: TrackedArm, first_ns: int, oldest_ns: int, start_ns: int,
                  until: float) -> Bending | None:
        """Return what the angles of the joints lead to; None where too few are known."""
        stamps, angles = self._angles.since(first_ns)
        inside = stamps <= start_ns
        stamps, angles = stamps[inside], angles[inside]
        if stamps.size < _FEWEST or stamps[-1] < oldest_ns:
            return None
        times = np.multiply(stamps - first_ns, 1e-9, dtype=np.float64)
        since = float(times[-1])
        state = arm.planned(since) + arm.observe(times, angles)
        return Bending(source='OBSERVER', off=arm.predict(state, since, until))

    def _check(self, found: Bending, settings: PlannerSettings) -> None:
        """Refuse to go on from a plan that the arm is not on."""
        apart = np.abs(found.off[:len(settings.joint_names)])
        k, limit = int(apart.argmax()), settings.start_tolerance
        if settings.check_start and apart[k] > limit:
            raise RequestError(
                PlanReport.NOT_AT_START, f'{settings.joint_names[k]} is {apart[k]:.3g} rad from '
                f'the plan that is carried out, more than start_tolerance = {limit:g} rad: the '
                'arm does not follow it')


def _tracked(running: RunningPlan, settings: PlannerSettings) -> TrackedArm:
    """Return the arm along what was published."""
    track, plan = running.track, running.plan
    reference = JointReference(
        times=np.multiply(track.times_ns, 1e-9, dtype=np.float64), positions=track.coordinates,
        velocities=track.rates, accelerations=track.accelerations, torques=track.efforts)
    return TrackedArm(dynamics=plan.model, parameters=plan.problem.parameters,
                      controller=settings.controller(), reference=reference)
