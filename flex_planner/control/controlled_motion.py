"""
An arm carried through a trajectory by its joint controller, all of it in compiled code.

Periods of the controller follow one another in one call; where the error of a step is too large,
the steps of some periods are taken again, shorter.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import Reference
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import step_error
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium, residual_vibration
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np

_LONGEST_STEP = 1e-3
_TOLERANCES = 1e-8, 1e-10
# periods in one call, and the most steps of one: the arm must have run away
_TOGETHER, _MOST_STEPS = 256, 256


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
        first, steps = 0, fewest
        while first < count and steps <= _MOST_STEPS:
            watch.check()
            last = min(first + max(_TOGETHER // steps, 1), count)
            found, error = self._cross(reference, states[first], times[first:last], steps)
            if error <= 1:
                states[first + 1:last + 1] = found
                first, steps = last, max(fewest, steps // 2)
            else:
                steps *= 2
        return ControlledMotion(times=times, states=states)

    def _cross(self, reference: Reference, state: Array, times: Array,
               steps: int) -> tuple[Array, float]:
        """Return the states after periods that begin at times, and the error of the worst step."""
        step = self.controller.period / steps
        rows = self._rows(reference, times, steps)
        timing = np.tile([[step, 0.0]], (len(rows), 1))
        timing[::steps, 1] = 1
        after, fifth, third = self.dynamics.controlled_steps(
            state, rows, timing, self._constants, self.parameters.physical)
        error = step_error(np.vstack([state, after]), fifth, third, _TOLERANCES)
        return after[steps - 1::steps], error

    def _rows(self, reference: Reference, times: Array, steps: int) -> Array:
        """Return angles, speeds, and efforts at both ends of every step, shape (k, 4 n)."""
        first, last = self.controller.hold.efforts(reference, times, self.controller.period)
        share = (np.arange(steps + 1) / steps)[:, None]
        efforts = first[:, None] + share * (last - first)[:, None]
        motion = [np.repeat(values, steps, axis=0) for values in reference.motion(times)]
        rows: Array = np.hstack([*motion, *(part.reshape(-1, first.shape[1])
                                            for part in (efforts[:, :-1], efforts[:, 1:]))])
        return rows

    @property
    def _constants(self) -> Array:
        """Return gains and limits, shape (4 n,)."""
        gains, limits = self.controller.gains, TorqueLimits.of(self.dynamics.arm)
        return np.concatenate([gains.stiffness, gains.damping, limits.stall, limits.slope])


def locked_bending(dynamics: ArmDynamics, state: Array, parameters: PhysicalParameters) -> float:
    """
    Return the largest deflection of the links if the joints were locked in a state (2 n_t,) [m].

    Infinite where the state is not finite, or the arm cannot rest there.

    """
    n, n_t = dynamics.arm.n_joints, dynamics.arm.n_coordinates
    if not np.isfinite(state).all():
        return np.inf
    try:
        rest, _ = equilibrium(dynamics, state[:n], parameters)
    except NoEquilibriumError:
        return np.inf
    locked = state.copy()
    locked[n_t:n_t + n] = 0
    return residual_vibration(dynamics, locked, rest, parameters)
