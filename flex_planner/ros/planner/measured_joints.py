"""Where the joints of the arm are, from the joint states of any number of publishers."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
import math
import threading

from flex_planner.base.validation import Array
from flex_planner.ros.messages.measured_starts import ArmStateError
from flex_planner_interfaces.msg import PlanReport
import numpy as np
from sensor_msgs.msg import JointState

# positions so far back show whether a joint moves, also where no velocities come
_WINDOW = 250_000_000  # [ns]
_SPACING = 5_000_000  # [ns]
_MANY = 6  # names in a sentence


@dataclass(slots=True)
class _Joint:
    """The last of one joint; a velocity of nan is none, a position may not be given."""

    heard_ns: int = 0
    stamp_ns: int = 0
    position: float = math.nan
    velocity: float = math.nan
    given: bool = False
    track: deque[tuple[int, float, float]] = field(default_factory=deque)

    def renew(self, heard_ns: int, stamp_ns: int, position: float, velocity: float) -> None:
        """Take what a message says."""
        if heard_ns < self.heard_ns:  # the clock was set back
            self.track.clear()
        self.heard_ns, self.stamp_ns = heard_ns, stamp_ns
        self.position, self.velocity = position, velocity
        if not math.isfinite(position):
            self.track.clear()
        elif not self.track or heard_ns - self.track[-1][0] >= _SPACING:
            self.track.append((heard_ns, position, velocity))
        while self.track and self.track[0][0] < heard_ns - _WINDOW:
            self.track.popleft()

    @property
    def drift(self) -> float:
        """Return by how much the position changed within the last moments [rad]."""
        values = [self.position, *(position for _, position, _ in self.track)]
        return max(values) - min(values)

    @property
    def speed(self) -> float:
        """
        Return the speed in the last moments [rad/s].

        The median of the velocities, as those of a joint at rest jump where they are differences
        of rounded angles; without velocities, the mean from the positions.

        """
        velocities = [self.velocity, *(velocity for _, _, velocity in self.track)]
        finite = [velocity for velocity in velocities if math.isfinite(velocity)]
        if finite:
            return float(np.median(finite))
        began, position = self.track[0][:2] if self.track else (self.heard_ns, self.position)
        passed = (self.heard_ns - began) * 1e-9
        return (self.position - position) / passed if passed else 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointReading:
    """
    The joints at an instant.

    Attributes
    ----------
    positions, speeds : numpy.ndarray, shape (n,)
        [rad], [rad/s]; speeds without a measured velocity are from positions.
    drifts : numpy.ndarray, shape (n,)
        By how much the positions changed within `WINDOW` [rad].

    """

    WINDOW = _WINDOW * 1e-9

    positions: Array
    speeds: Array
    drifts: Array


class MeasuredJoints:
    """
    The latest of every joint; may be used from several threads.

    Joints may come in any order, in several messages, and among others that the arm does not
    have.

    Parameters
    ----------
    names : list of str
        Of the joints of the arm.
    topic : str
        Full name of the topic, for sentences.

    """

    def __init__(self, names: list[str], topic: str) -> None:
        self._names, self._topic = names, topic
        self._joints: dict[str, _Joint] = {}
        self._others: dict[str, None] = {}
        self._lock = threading.Lock()

    @property
    def heard(self) -> bool:
        """Return whether any joint of the arm was heard of."""
        return bool(self._joints)

    @property
    def others(self) -> str:
        """Return names of joints that are not the arm's, empty if none were heard of."""
        return ', '.join(self._others)

    def hear(self, message: JointState, now_ns: int) -> None:
        """Take a message that came at a time of the node's clock [ns]."""
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        positions = _for_every(message.name, message.position)
        velocities = _for_every(message.name, message.velocity)
        with self._lock:
            for name, position, velocity in zip(message.name, positions, velocities, strict=True):
                if name in self._names:
                    joint = self._joints.setdefault(name, _Joint())
                    joint.renew(now_ns, stamp, position, velocity)
                    joint.given = len(message.position) == len(message.name)
                elif len(self._others) < _MANY:
                    self._others[name] = None

    def read(self, now_ns: int, timeout: float) -> JointReading:
        """
        Return the joints as they are.

        Parameters
        ----------
        now_ns : int
            Time of the node's clock [ns].
        timeout : float
            Longest time since a joint was heard of, and since its stamp [s].

        Raises
        ------
        ArmStateError
            If the joints are not known, with the reason.

        """
        with self._lock:
            problem = self._missing() or next(filter(None, (
                self._problem(name, now_ns, timeout) for name in self._names)), '')
            if problem:
                raise ArmStateError(PlanReport.ARM_STATE_UNKNOWN,
                                    f'nobody knows where the arm is: {problem}')
            joints = [self._joints[name] for name in self._names]
            return JointReading(positions=np.array([joint.position for joint in joints]),
                                speeds=np.array([joint.speed for joint in joints]),
                                drifts=np.array([joint.drift for joint in joints]))

    def _missing(self) -> str:
        """Return which joints were never heard of, empty if all were."""
        missing = [name for name in self._names if name not in self._joints]
        if not missing:
            return ''
        if not self._joints and not self._others:
            return (f'no message comes on {self._topic}; is the driver of the arm running, and '
                    'joint_states_topic its topic?')
        heard = ', '.join([*self._joints, *self._others])
        return (f'no message on {self._topic} names {", ".join(missing)}; they name {heard}: '
                'joint_names must be the names that the arm has there')

    def _problem(self, name: str, now_ns: int, timeout: float) -> str:
        """Return what is wrong with a joint, empty if nothing is."""
        joint = self._joints[name]
        silence, age = (now_ns - joint.heard_ns) * 1e-9, (now_ns - joint.stamp_ns) * 1e-9
        limit = f'joint_state_timeout = {timeout:g} s'
        if not joint.given:
            return f'the message on {self._topic} that names {name} has not one position per name'
        if not math.isfinite(joint.position):
            return f'the position of {name} is {joint.position} on {self._topic}'
        if silence > timeout:
            return f'{name} was last heard of {silence:.3g} s ago, longer than {limit}'
        if silence < -timeout:
            return (f'the clock was set back by {-silence:.3g} s since {name} was last heard of, '
                    f'more than {limit}')
        if joint.stamp_ns and abs(age) > timeout:
            when = 'old' if age > 0 else 'ahead'
            return (f'the state of {name} is {abs(age):.3g} s {when} by its stamp, more than '
                    f'{limit}: the clocks differ (is use_sim_time the same everywhere?), or an '
                    'old recording is played')
        return ''


def _for_every(names: list[str], values: list[float]) -> list[float]:
    """Return one value per name, nan where there is none; arrays of another length mean none."""
    return list(values) if len(values) == len(names) else [math.nan] * len(names)
