"""An arm carried along a trajectory under a linear law that sees its encoders."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.held_periods import (
    cross_periods,
    load_library,
    MOST_STEPS,
    Periods,
)
from flex_planner.control.joint_controller import EffortHold
from flex_planner.control.joint_reference import Reference
from flex_planner.control.linear_feedback import LinearFeedback
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import step_errors
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np

_LONGEST_STEP = 1e-3
# the motion of the tip after an arrival is the same to five digits with smaller ones
_TOLERANCES = 1e-5, 1e-7
# steps that are taken at once, and those of a period at most, in units of the fewest
_TOGETHER, _MOST_STEPS = 512, 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """
    What a law is to follow: angles at its updates, and the efforts held after them.

    Attributes
    ----------
    angles, efforts : numpy.ndarray, shape (m, n)
        [rad], [N m].

    """

    angles: Array
    efforts: Array

    @classmethod
    def of(cls, reference: Reference, hold: EffortHold, rate: float, until: float) -> Course:
        """Return that of a trajectory, up to the first update at or after a time [s]."""
        times = np.arange(int(np.ceil(until * rate - 1e-6)), dtype=np.float64) / rate
        first, last = hold.efforts(reference, times, 1 / rate)
        return cls(angles=reference.motion(times)[0], efforts=(first + last) / 2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeedbackMotion:
    """
    The motion of an arm under a law.

    Attributes
    ----------
    states : numpy.ndarray, shape (m + 1, 2 n_t)
        At the updates; NaN from where it could not be integrated.
    laws : numpy.ndarray, shape (m + 1, order)
        States of the law.
    torques : numpy.ndarray, shape (m, n)
        Of the motors after each update [N m].

    """

    states: Array
    laws: Array
    torques: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeedbackArm:
    """
    An arm under a law, whose motors have the limits of eq. (15).

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    parameters : PhysicalParameters
        Of the arm.
    law : LinearFeedback
        Of order at most 2 n_t + n.
    resolution : float
        Of the encoders; 0 for exact ones [rad].

    """

    dynamics: ArmDynamics
    parameters: PhysicalParameters
    law: LinearFeedback
    resolution: float = 0.0

    def follow(self, course: Course, state: Array,
               monitor: Monitor | None = None) -> FeedbackMotion:
        """
        Carry out a course from a state (2 n_t,).

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        watch, library = monitor or Monitor(), load_library()
        rate = self.dynamics.forward_dynamics_address
        if rate is not None and library is not None:
            watch.check()
            return self._follow_compiled(course, state, rate, library)
        return self._follow_steps(course, state, watch)

    def _follow_compiled(self, course: Course, state: Array, rate: int,
                         library: ctypes.CDLL) -> FeedbackMotion:
        """Carry out a course by one call of compiled code."""
        count, n = course.angles.shape
        states, laws = np.full((count + 1, state.size), np.nan), np.zeros(
            (count + 1, self.law.order))
        states[0], torques = state, np.full((count, n), np.nan)
        rows, law, controller, physical = (np.ascontiguousarray(values, dtype=np.float64)
                                           for values in (
            np.hstack([course.angles, course.efforts]), self.law.entries,
            np.concatenate([np.zeros(2 * n), self._motors]), self.parameters.physical))
        done = cross_periods(library, Periods(
            rate=rate, joints=n, size=state.size, count=count, most_steps=MOST_STEPS,
            length=self.law.period, rtol=_TOLERANCES[0], atol=_TOLERANCES[1],
            reference=rows.ctypes.data, controller=controller.ctypes.data,
            physical=physical.ctypes.data, states=states.ctypes.data, law=law.ctypes.data,
            order=self.law.order, resolution=self.resolution, law_states=laws.ctypes.data,
            torques=torques.ctypes.data))
        states[done + 1:], laws[done + 1:], torques[done:] = np.nan, np.nan, np.nan
        return FeedbackMotion(states=states, laws=laws, torques=torques)

    def _follow_steps(self, course: Course, state: Array, watch: Monitor) -> FeedbackMotion:
        """Carry out a course by the steps of `ArmDynamics.feedback_steps`, without a compiler."""
        count = len(course.angles)
        size, n = state.size, self.law.joints
        law, motors = self.law.padded(size + n).entries, self._motors
        rows = np.full((count + 1, 2 * (size + n)), np.nan)
        rows[0] = 0.0
        rows[0, :size] = state
        fewest = int(np.ceil(self.law.period / _LONGEST_STEP - 1e-9))
        first, steps = 0, fewest
        while first < count and steps <= _MOST_STEPS * fewest:
            watch.check()
            last = min(first + max(_TOGETHER // steps, 1), count)
            found = self._cross(course, rows[first], slice(first, last), (law, motors), steps)
            if found is None:
                steps *= 2
            else:
                rows[first + 1:last + 1] = found
                first, steps = last, max(fewest, steps // 2)
        return FeedbackMotion(states=rows[:, :size],
                              laws=rows[:, size:size + self.law.order], torques=rows[1:, -n:])

    def _cross(self, course: Course, row: Array, periods: slice, law: tuple[Array, Array],
               steps: int) -> Array | None:
        """Return what follows each of some periods, None if their steps are too long."""
        size = 2 * self.dynamics.arm.n_coordinates
        reference = np.hstack([course.angles[periods], course.efforts[periods]])
        timing = np.zeros((len(reference) * steps, 2))
        timing[:, 0], timing[::steps, 1] = self.law.period / steps, 1.0
        with np.errstate(over='ignore', invalid='ignore'):
            after, fifth, third = self.dynamics.feedback_steps(
                row, np.repeat(reference, steps, axis=0), timing, *law,
                self.parameters.physical)
            states = np.vstack([row[:size], after[:, :size]])
            errors = step_errors(states, fifth, third, _TOLERANCES)
        return after[steps - 1::steps] if (errors <= 1).all() else None

    @property
    def limits(self) -> TorqueLimits:
        """Return the limits of the motors."""
        return TorqueLimits.of(self.dynamics.arm)

    @property
    def _motors(self) -> Array:
        limits = self.limits
        return np.concatenate([limits.stall, limits.slope, limits.cap, [self.resolution]])
