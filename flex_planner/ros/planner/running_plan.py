"""The plan that was published last, which another one may replace while it is carried out."""

from __future__ import annotations

from dataclasses import dataclass
import threading

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.text import shown_value
from flex_planner.base.validation import Array
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import SampledPlan
from flex_planner.ros.messages.measured_states import WINDOW_NS
from flex_planner.ros.messages.plans import joint_points
from flex_planner.ros.messages.times import time_message
from flex_planner.ros.messages.trajectory_bytes import encode_joint_points
from flex_planner.ros.planner.outcome import Outcome
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory

# from the last point of the plan that is replaced to the first of the new one: as near as numbers
# allow, as the torque may jump there
_APART_NS = 1000
# how much of the past is kept, for an observer of the arm
_HISTORY_NS = WINDOW_NS + 50_000_000
_ARRAYS = 'coordinates', 'rates', 'accelerations', 'torques', 'efforts'


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Track:
    """
    What is published of a plan, and before it what led there.

    Attributes
    ----------
    begin_ns : int
        By the clock of the node [ns].
    times_ns : numpy.ndarray of int64, shape (k,)
        From then on [ns].
    coordinates, rates, accelerations : numpy.ndarray, shape (k, n_t)
        Joints [rad], then modes [m].
    torques, efforts : numpy.ndarray, shape (k, n)
        Planned, and for the controller [N m].

    """

    begin_ns: int
    times_ns: NDArray[np.int64]
    coordinates: Array
    rates: Array
    accelerations: Array
    torques: Array
    efforts: Array

    @classmethod
    def of(cls, reference: SampledPlan, begin_ns: int) -> Track:
        """Return that of a plan which begins at a time [ns]."""
        samples = reference.samples
        return cls(begin_ns=begin_ns, times_ns=reference.times_ns, torques=samples.torques,
                   coordinates=samples.coordinates, rates=samples.rates,
                   accelerations=samples.accelerations, efforts=reference.efforts)

    def part(self, first_ns: int, last_ns: int | None = None) -> Track:
        """Return what lies between times of the clock, from the point before the first [ns]."""
        times = self.times_ns + self.begin_ns
        first = max(int(np.searchsorted(times, first_ns, 'right')) - 1, 0)
        last = times.size if last_ns is None else int(np.searchsorted(times, last_ns))
        return self._taken(slice(first, last), int(times[first]))

    def then(self, *others: Track) -> Track:
        """Return this one and others after it."""
        times = [one.times_ns + (one.begin_ns - self.begin_ns) for one in (self, *others)]
        arrays = {name: np.vstack([getattr(one, name) for one in (self, *others)])
                  for name in _ARRAYS}
        return Track(begin_ns=self.begin_ns, times_ns=np.concatenate(times), **arrays)

    def trajectory(self, names: list[str]) -> JointTrajectory:
        """Return it as a message that is stamped with its begin."""
        n = self.efforts.shape[1]
        message = JointTrajectory(joint_names=names, points=joint_points(
            self.times_ns, self.coordinates[:, :n], self.rates[:, :n], self.accelerations[:, :n],
            self.efforts))
        message.header.stamp = time_message(self.begin_ns)
        return message

    def encoded(self, names: list[str]) -> bytes:
        """Return the message of `trajectory` in CDR, which is quicker than to make it."""
        n = self.efforts.shape[1]
        return encode_joint_points(
            JointTrajectory(joint_names=names, header=Header(stamp=time_message(self.begin_ns))),
            self.times_ns, self.coordinates[:, :n], self.rates[:, :n],
            self.accelerations[:, :n], self.efforts)

    def _taken(self, which: slice, begin_ns: int) -> Track:
        times = self.times_ns[which] - (begin_ns - self.begin_ns)
        return Track(begin_ns=begin_ns, times_ns=times,
                     **{name: getattr(self, name)[which] for name in _ARRAYS})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunningPlan:
    """
    A plan that is carried out.

    Attributes
    ----------
    plan_id : str
        Of its report.
    plan : Plan
        Solved.
    begin_ns : int
        When its motion begins, by the clock of the node [ns].
    track : Track
        As it was published, and some of what was before.

    """

    plan_id: str
    plan: Plan
    begin_ns: int
    track: Track

    def replaced_by(self, outcome: Outcome, now_ns: int) -> Track:
        """Return the track of a plan that replaces this one from now on [ns]."""
        assert outcome.reference is not None
        new = Track.of(outcome.reference, outcome.start_ns)
        old = self.track.part(now_ns - _HISTORY_NS, outcome.start_ns - _APART_NS)
        return old.then(self._last(new), new)

    def _last(self, new: Track) -> Track:
        """Return the plan just before the new one begins, with its own efforts."""
        at_ns, track = new.begin_ns - _APART_NS, self.track
        assert self.plan.solution is not None
        n_t, time = self.plan.arm.n_coordinates, max(at_ns - self.begin_ns, 0) * 1e-9
        z = self.plan.solution(np.array([time]))
        control = self.plan.problem.controls(np.array([time]), z)
        effort = np.array([np.interp(at_ns - track.begin_ns, track.times_ns, column)
                           for column in track.efforts.T])
        return Track(begin_ns=at_ns, times_ns=np.zeros(1, dtype=np.int64),
                     coordinates=z[:, :n_t], rates=z[:, n_t:2 * n_t], efforts=effort[None],
                     accelerations=control.acceleration, torques=control.torque)


class RunningPlans:
    """Knows the plan that was published last; may be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._newest: RunningPlan | None = None

    def begin(self, running: RunningPlan) -> None:
        """Take note of a plan that is published."""
        with self._lock:
            self._newest = running

    def drop(self, plan_id: str) -> None:
        """Forget a plan that is not carried out any more, if it is the newest."""
        with self._lock:
            if self._newest is not None and self._newest.plan_id == plan_id:
                self._newest = None

    def take(self, plan_id: str) -> RunningPlan:
        """
        Return the plan with an identifier.

        Raises
        ------
        InvalidTaskError
            If it is not the one that was published last.

        """
        with self._lock:
            newest = self._newest
        if newest is not None and newest.plan_id == plan_id:
            return newest
        what = ('no plan is carried out' if newest is None
                else f'the plan that was published last is {newest.plan_id}')
        raise InvalidTaskError(f'replaces is {shown_value(plan_id)}, but {what}: only that can be '
                               'replaced')
