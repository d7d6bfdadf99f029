"""A linear law of feedback with a state of its own, which a controller samples and holds."""

from __future__ import annotations

from dataclasses import dataclass, fields

from flex_planner.base.errors import InvalidSizeError
from flex_planner.base.validation import Array, number
from flex_planner.control.joint_controller import Gains, MAX_RATE, MIN_RATE
import numpy as np

# of the speed filter of a PD [Hz]
SPEED_CUTOFF = 50.0
MIN_CUTOFF, MAX_CUTOFF = 1e-3, 1e6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearFeedback:
    """
    The law ``v = C xi + D e, xi' = A xi + B e + E w``.

    e are the errors of the joints, measured less planned; v is added to the planned efforts, and w
    is what motors at their limits leave of v.

    Parameters
    ----------
    A, B, E : numpy.ndarray, shape (m, m), (m, n) and (m, n)
        What a period makes of the state; m may be 0.
    C, D : numpy.ndarray, shape (n, m) and (n, n)
        What the torques are made of [N m].
    rate : float
        Of the controller, 10 to 100000 [Hz].

    Raises
    ------
    InvalidSizeError
        If the matrices do not fit together.
    InvalidValueError
        If the rate breaks its bound.

    """

    A: Array
    B: Array
    C: Array
    D: Array
    E: Array
    rate: float

    def __post_init__(self) -> None:
        number('rate', self.rate, at_least=MIN_RATE, at_most=MAX_RATE, unit='Hz')
        n, m = self.joints, self.order
        shapes = {'A': (m, m), 'B': (m, n), 'C': (n, m), 'D': (n, n), 'E': (m, n)}
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InvalidSizeError(name, f'shape {getattr(self, name).shape}',
                                       f'of shape {shape}')

    @property
    def joints(self) -> int:
        """Return n."""
        return len(self.D)

    @property
    def order(self) -> int:
        """Return m."""
        return len(self.A)

    @property
    def period(self) -> float:
        """Return the time from one update to the next [s]."""
        return 1 / self.rate

    def padded(self, order: int) -> LinearFeedback:
        """Return the same law with more entries of the state, which stay 0."""
        n, m, k = self.joints, self.order, order
        A, B, C, E = np.zeros((k, k)), np.zeros((k, n)), np.zeros((n, k)), np.zeros((k, n))
        A[:m, :m], B[:m], C[:, :m], E[:m] = self.A, self.B, self.C, self.E
        return LinearFeedback(A=A, B=B, C=C, D=self.D, E=E, rate=self.rate)

    def closed_loop(self, free: Array, forced: Array) -> Array:
        """
        Return what a period makes of an arm and the law together, shape (2 n_t + m, 2 n_t + m).

        Parameters
        ----------
        free, forced : numpy.ndarray, shape (2 n_t, 2 n_t) and (2 n_t, n)
            What a period makes of the state of the arm and of torques that are held.

        """
        size, n = forced.shape
        seen = np.eye(n, size)
        return np.block([
            [free + forced @ self.D @ seen, forced @ self.C],
            [(self.B + self.E @ self.D) @ seen, self.A + self.E @ self.C]])

    @property
    def entries(self) -> Array:
        """Return A, B, C, D, E one after another, each column by column."""
        matrices = (getattr(self, entry.name) for entry in fields(self) if entry.name != 'rate')
        return np.concatenate([matrix.ravel(order='F') for matrix in matrices])


def joint_feedback(gain: Array, rate: float, cutoff: float = SPEED_CUTOFF) -> LinearFeedback:
    """
    Return the law of gains on errors of joint angles and of their speeds.

    Speeds are differences of encoder angles, which need a filter. It acts on the error: a filtered
    speed beside a planned one that is not filtered would lag behind it whenever the joints
    accelerate, and push the arm off the plan.

    Parameters
    ----------
    gain : numpy.ndarray, shape (n, 2 n)
        Of angles [N m/rad] and of speeds [N m s/rad]; positive gains pull back.
    rate : float
        Of the controller, 10 to 100000 [Hz].
    cutoff : float
        Of the filter of first order, 0.001 to 1e6 [Hz].

    """
    number('cutoff', cutoff, at_least=MIN_CUTOFF, at_most=MAX_CUTOFF, unit='Hz')
    number('rate', rate, at_least=MIN_RATE, at_most=MAX_RATE, unit='Hz')
    n, kept = len(gain), np.exp(-2 * np.pi * cutoff / rate)
    stiffness, damping = gain[:, :n], gain[:, n:]
    one, none, slope = np.eye(n), np.zeros((n, n)), (1 - kept) * rate
    return LinearFeedback(
        A=np.block([[kept * one, -slope * one], [none, none]]), B=np.vstack([slope * one, one]),
        C=np.hstack([-kept * damping, slope * damping]), D=-stiffness - slope * damping,
        E=np.zeros((2 * n, n)), rate=rate)


def pd_feedback(gains: Gains, rate: float, cutoff: float = SPEED_CUTOFF) -> LinearFeedback:
    """Return the law of a PD, see `joint_feedback`."""
    gain = np.hstack([np.diag(gains.stiffness), np.diag(gains.damping)])
    return joint_feedback(gain, rate, cutoff)
