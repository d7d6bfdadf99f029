"""
An arm carried through a trajectory by its joint controller, all of it in compiled code.

Periods of the controller follow one another in one call. A motor that reaches or leaves its limit
bends the motion, so a step is cut there; where the error of a step is too large otherwise, the
steps of some periods are taken again, shorter.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import Reference
from flex_planner.control.period_steps import limit_crossings, PeriodSteps
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import step_errors
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium, residual_vibration
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np
from numpy.typing import NDArray

_LONGEST_STEP = 1e-3
_TOLERANCES = 1e-8, 1e-10
# steps in one call: at first, and after others that needed no cut; a call costs as much as 100
_TOGETHER, _MOST_TOGETHER = 256, 2048
# in a period: the arm must have run away
_MOST_STEPS = 256
# rounds of cutting steps at limits: each knows better than the last where they lie
_MOST_CUTS = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlledMotion:
    """
    The motion of an arm under its controller.

    Attributes
    ----------
    times : numpy.ndarray, shape (m + 1,)
        Updates of the controller, from 0 [s].
    states : numpy.ndarray, shape (m + 1, 2 n_t)
        x = (q, q') at these times; NaN from where it could not be integrated.

    """

    times: Array
    states: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlledArm:
    """
    An arm under a joint controller.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_t coordinates.
    parameters : PhysicalParameters
        Its payload and stiffness.
    controller : JointController
        Of its joints; the motors have the limits of eq. (15).

    """

    dynamics: ArmDynamics
    parameters: PhysicalParameters
    controller: JointController

    def follow(self, reference: Reference, state: Array, until: float,
               monitor: Monitor | None = None) -> ControlledMotion:
        """
        Carry out a trajectory.

        Parameters
        ----------
        reference : Reference
            From time 0.
        state : numpy.ndarray, shape (2 n_t,)
            At time 0.
        until : float
            The motion ends with the period that this time lies in [s].
        monitor : Monitor, optional
            May stop it.

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        watch, period = monitor or Monitor(), self.controller.period
        count = int(np.ceil(until / period - 1e-6))
        times = np.arange(count + 1, dtype=np.float64) * period
        states = np.full((count + 1, state.size), np.nan)
        states[0], fewest = state, int(np.ceil(period / _LONGEST_STEP - 1e-9))
        first, steps, together = 0, fewest, _TOGETHER
        while first < count and steps <= _MOST_STEPS:
            watch.check()
            last = min(first + max(together // steps, 1), count)
            found, cuts = self._cross(reference, states[first], times[first:last], steps)
            together = _TOGETHER if cuts else min(2 * together, _MOST_TOGETHER)
            if found is None:
                steps *= 2
            else:
                states[first + 1:last + 1] = found
                first, steps = last, max(fewest, steps // 2)
        return ControlledMotion(times=times, states=states)

    def _cross(self, reference: Reference, state: Array, times: Array,
               count: int) -> tuple[Array | None, int]:
        """Return the states after periods from times on, None if they need more steps; cuts."""
        steps, done = PeriodSteps.even(times, self.controller.period, count), list[Array]()
        for cuts in range(_MOST_CUTS):
            after, too_long, (crossed, shares) = self._take(reference, state, steps)
            ends = after[np.append(steps.firsts[1:], True)]
            if not too_long.any():
                return np.vstack([*done, ends]), cuts
            if np.setdiff1d(np.flatnonzero(too_long), crossed).size:
                return None, cuts + 1
            good, wanted = int(steps.numbers[too_long.argmax()]), too_long[crossed]
            done.append(ends[:good])
            state = ends[good - 1] if good else state
            steps = steps.cut(crossed[wanted], shares[wanted]).since(good)
        return None, _MOST_CUTS

    def _take(self, reference: Reference, state: Array, steps: PeriodSteps) -> tuple[
            Array, NDArray[np.bool_], tuple[NDArray[np.intp], Array]]:
        """Return states after steps, which steps are too long, and where limits cross some."""
        rows, n = self._rows(reference, steps), self.dynamics.arm.n_joints
        after, feedback, fifth, third = self.dynamics.controlled_steps(
            state, rows, np.stack([steps.lengths, steps.firsts], axis=1), self.constants,
            self.parameters.physical)
        states, n_t = np.vstack([state, after]), self.dynamics.arm.n_coordinates
        speeds = states[:, n_t:n_t + n]
        efforts = rows[:, 2 * n:3 * n] + feedback, rows[:, 3 * n:] + feedback
        return (after, step_errors(states, fifth, third, _TOLERANCES) > 1,
                limit_crossings(self._limits, efforts, (speeds[:-1], speeds[1:])))

    def _rows(self, reference: Reference, steps: PeriodSteps) -> Array:
        """Return angles, speeds, and efforts at both ends of every step, shape (k, 4 n)."""
        first, last = self.controller.hold.efforts(reference, steps.times, steps.period)
        numbers = steps.numbers
        change = (last - first)[numbers]
        efforts = [first[numbers] + change * share[:, None] for share in steps.shares()]
        rows: Array = np.hstack([*(values[numbers] for values in reference.motion(steps.times)),
                                 *efforts])
        return rows

    @property
    def _limits(self) -> TorqueLimits:
        return TorqueLimits.of(self.dynamics.arm)

    @property
    def constants(self) -> Array:
        """Return gains and limits, shape (5 n,)."""
        gains, limits = self.controller.gains, self._limits
        return np.concatenate([gains.stiffness, gains.damping, limits.stall, limits.slope,
                               limits.cap])


def locked_bending(dynamics: ArmDynamics, state: Array, parameters: PhysicalParameters) -> float:
    """
    Return the largest deflection of the links if the joints were locked in a state (2 n_t,) [m].

    Infinite where the state is not finite, or the arm cannot rest there.

    """
    if not np.isfinite(state).all():
        return np.inf
    try:
        rest, _ = equilibrium(dynamics, state[:dynamics.arm.n_joints], parameters)
    except NoEquilibriumError:
        return np.inf
    return residual_vibration(dynamics, state, rest, parameters)
