"""
A simulated arm under a joint controller: feedforward torque and PD, sampled and held.

The controller reads the joints at a fixed rate and holds its torque in between; the links bend
freely meanwhile. Knows no ROS and no clock: the caller says how far to go.

"""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.model import ArmModel, Parameters
from flex_planner.statics import equilibrium
from flex_planner.validation import Array, number, vector
import numpy as np
from scipy.interpolate import CubicHermiteSpline

_SUBSTEPS = 4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gains:
    """
    PD gains of every joint.

    Parameters
    ----------
    stiffness : array_like, shape (n,)
        >= 0 [N m/rad].
    damping : array_like, shape (n,)
        >= 0 [N m s/rad].

    """

    stiffness: Array
    damping: Array

    def __post_init__(self) -> None:
        for name, unit in (('stiffness', 'N m/rad'), ('damping', 'N m s/rad')):
            given = np.atleast_1d(np.asarray(getattr(self, name), dtype=float))
            object.__setattr__(self, name, vector(name, given, given.size, at_least=0, unit=unit))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointReference:
    """
    What a joint trajectory demands, interpolated as joint_trajectory_controller does.

    Parameters
    ----------
    times : numpy.ndarray, shape (k,)
        Strictly increasing from 0, see :meth:`after` [s].
    positions, velocities, torques : numpy.ndarray, shape (k, n)
        [rad], [rad/s], [N m]; the last row is held for ever.

    """

    times: Array
    positions: Array
    velocities: Array
    torques: Array

    @classmethod
    def hold(cls, positions: Array, torques: Array) -> JointReference:
        """Return a reference that stays."""
        still = np.zeros((1, positions.size))
        return cls(times=np.zeros(1), positions=positions[None], velocities=still,
                   torques=torques[None])

    def after(self, positions: Array, velocities: Array, torques: Array) -> JointReference:
        """Return the reference with a way to its first sample, unless that is at time 0."""
        if self.times[0] == 0:
            return self
        return JointReference(
            times=np.append(0.0, self.times), positions=np.vstack([positions, self.positions]),
            velocities=np.vstack([velocities, self.velocities]),
            torques=np.vstack([torques, self.torques]))

    def spline(self) -> CubicHermiteSpline | None:
        """Return positions over time, None if there is a single sample."""
        if self.times.size < 2:
            return None
        return CubicHermiteSpline(self.times, self.positions, self.velocities)


class Plant:
    """
    The arm, its controller and the present state.

    Parameters
    ----------
    model : ArmModel
        n joints, n_t coordinates.
    payload_mass, payload_inertia : float
        At the tip, >= 0 [kg], [kg m^2].
    gains : Gains
        Of the joint controller.
    positions : array_like, shape (n,)
        Joint angles at rest to start from [rad].
    rate : float
        Of the controller, 10 to 100000 [Hz].

    Attributes
    ----------
    state : numpy.ndarray, shape (2 n_t,)
        x = (q, q').
    torque : numpy.ndarray, shape (n,)
        Applied last [N m].
    time : float
        Since the start [s].

    """

    def __init__(self, model: ArmModel, *, payload_mass: float, gains: Gains, positions: Array,
                 payload_inertia: float = 0.0, rate: float = 1000.0) -> None:
        self.model, self._gains = model, gains
        for name in ('stiffness', 'damping'):
            vector(name, getattr(gains, name), model.arm.n_joints)
        self._period = 1 / number('rate', rate, at_least=10, at_most=1e5, unit='Hz')
        mass = number('payload_mass', payload_mass, at_least=0, unit='kg')
        inertia = number('payload_inertia', payload_inertia, at_least=0, unit='kg m^2')
        parameters = Parameters.of(model.arm, payload_mass=mass, payload_inertia=inertia)
        rest, self.torque = equilibrium(
            model, vector('positions', positions, model.arm.n_joints, unit='rad'), parameters)
        self.state = np.concatenate([rest, np.zeros_like(rest)])
        self._rate = model.state_rate(parameters.stacked())
        self._ticks = 0
        self.follow(JointReference.hold(rest[:model.arm.n_joints], self.torque))

    @property
    def time(self) -> float:
        """Return the time since the start [s]."""
        return self._ticks * self._period

    def follow(self, reference: JointReference) -> None:
        """Follow a reference from now on."""
        self._reference, self._spline = reference, reference.spline()
        self._began = self._ticks

    def advance(self, until: float) -> None:
        """Go on to a time [s], by whole controller periods."""
        while self.time + self._period <= until + 1e-9:
            self._step()

    def _step(self) -> None:
        """Compute a torque, hold it for one period."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        elapsed = (self._ticks - self._began) * self._period
        position, velocity, feedforward = self._demand(elapsed)
        angles, speeds = self.state[:n], self.state[n_t:n_t + n]
        demand = (feedforward + self._gains.stiffness * (position - angles)
                  + self._gains.damping * (velocity - speeds))
        lower, upper = self.model.arm.torque_bounds(speeds)
        self.torque = np.clip(demand, lower, upper)
        step = self._period / _SUBSTEPS
        for _ in range(_SUBSTEPS):
            self.state = self._runge_kutta(self.state, step)
        self._ticks += 1

    def _demand(self, elapsed: float) -> tuple[Array, Array, Array]:
        """Return position, velocity and feedforward torque of the reference."""
        reference = self._reference
        if self._spline is None or elapsed >= reference.times[-1]:
            return reference.positions[-1], reference.velocities[-1], reference.torques[-1]
        # a torque that is held for a period is best taken from its middle
        middle = elapsed + self._period / 2
        torque = np.array([np.interp(middle, reference.times, column)
                           for column in reference.torques.T])
        return self._spline(elapsed), self._spline(elapsed, 1), torque

    def _runge_kutta(self, x: Array, h: float) -> Array:
        """Return the state after one classical Runge-Kutta step."""
        def rate(state: Array) -> Array:
            result: Array = self._rate(state, self.torque).copy()
            return result

        k_1 = rate(x)
        k_2 = rate(x + h / 2 * k_1)
        k_3 = rate(x + h / 2 * k_2)
        after: Array = x + h / 6 * (k_1 + 2 * k_2 + 2 * k_3 + rate(x + h * k_3))
        return after
