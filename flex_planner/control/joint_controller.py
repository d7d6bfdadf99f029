"""What is known of the joint controller that a trajectory is published for."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import one_of
from flex_planner.base.validation import Array, number, vector
from flex_planner.control.joint_reference import Reference
import numpy as np

MIN_RATE, MAX_RATE = 10.0, 1e5
MAX_GAIN = 1e24


class EffortHold(Enum):
    """
    Which effort of a trajectory a controller applies from one of its updates to the next.

    joint_trajectory_controller applies the effort of the end of the coming period where it has the
    interface effort, and the effort of its start where it has the interfaces position and effort.

    """

    END = 'end'
    START = 'start'
    MIDDLE = 'middle'
    LINEAR = 'linear'

    def efforts(self, reference: Reference, times: Array,
                period: float) -> tuple[Array, Array]:
        """Return the efforts at both ends of the periods that begin at times (m,), (m, n)."""
        if self is EffortHold.LINEAR:
            return reference.torque(times), reference.torque(times + period)
        held = reference.torque(times + self.delay * period)
        return held, held

    @classmethod
    def named(cls, name: str) -> EffortHold:
        """
        Return the way to hold of a name.

        Raises
        ------
        InvalidValueError
            If there is none.

        """
        try:
            return cls(name)
        except ValueError:
            names = [hold.value for hold in cls]
            raise InvalidValueError('effort_hold', name, one_of(name, names)) from None

    @property
    def delay(self) -> float:
        """Return how far into the period the effort is taken from, as a share of it."""
        return {EffortHold.START: 0.0, EffortHold.END: 1.0}.get(self, 0.5)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gains:
    """
    PD gains of every joint.

    Parameters
    ----------
    stiffness : array_like, shape (n,)
        0 to 1e24 [N m/rad].
    damping : array_like, shape (n,)
        0 to 1e24 [N m s/rad].

    """

    stiffness: Array
    damping: Array

    def __post_init__(self) -> None:
        for name, unit in (('stiffness', 'N m/rad'), ('damping', 'N m s/rad')):
            given = np.atleast_1d(np.asarray(getattr(self, name), dtype=float))
            object.__setattr__(self, name, vector(
                name, given, given.size, at_least=0, at_most=MAX_GAIN, unit=unit))

    @classmethod
    def of(cls, count: int, stiffness: float, damping: float) -> Gains:
        """Return the same gains for every joint."""
        return cls(stiffness=np.full(count, stiffness), damping=np.full(count, damping))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointController:
    """
    A controller that adds a PD to the efforts of a trajectory, and holds its torque.

    Parameters
    ----------
    gains : Gains
        Of the PD, which compares the joints at an update with the trajectory at that time.
    rate : float
        Of the updates, 10 to 100000 [Hz].
    hold : EffortHold
        Of the efforts.

    Raises
    ------
    InvalidValueError
        If the rate breaks its bound.

    """

    gains: Gains
    rate: float = 1000.0
    hold: EffortHold = EffortHold.END

    def __post_init__(self) -> None:
        number('controller_rate', self.rate, at_least=MIN_RATE, at_most=MAX_RATE, unit='Hz')

    @property
    def period(self) -> float:
        """Return the time from one update to the next [s]."""
        return 1 / self.rate
