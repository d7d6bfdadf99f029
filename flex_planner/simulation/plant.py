"""
A simulated arm under a joint controller: feedforward torque and PD, sampled and held.

The controller reads the encoders and holds its torque for a period; the links bend freely
meanwhile. Knows no ROS and no clock: the caller says how far to go.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.validation import Array, integer, number, vector
from flex_planner.control.joint_controller import EffortHold, Gains, MAX_RATE, MIN_RATE
from flex_planner.control.joint_reference import JointReference
from flex_planner.control.linear_feedback import LinearFeedback
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import HeldTorqueIntegrator
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium
from flex_planner.optimal_control.task import MAX_DISPLACEMENT, MAX_PAYLOAD, MAX_VELOCITY
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.simulation.joint_control import Disturbance, Encoder, JointSensor
import numpy as np

RTOL, ATOL = 1e-8, 1e-10
MAX_DELAY = 0.1
_WHOLE = 1e-6  # of a period, that a delay may be off
_LONGEST_STEP = 1e-3


class RunawayError(FlexPlannerError):
    """The simulated arm moves so wildly that it cannot be integrated, or as no arm does."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Control:
    """
    The control of the joints.

    Parameters
    ----------
    gains : Gains
        Of the PD.
    rate : float
        Of the controller, 10 to 100000 [Hz].
    hold : EffortHold
        Of the torque of a reference; `LINEAR` is held as its mean.
    feedforward : bool
        Whether the torque of a reference is applied.
    limit_torques : bool
        Whether the motors have the limits of eq. (15).
    encoder : Encoder
        What the PD sees.
    delay : float
        From an update of the controller to its torque, 0 to 0.1 [s].
    disturbance : Disturbance
        Acts beside the motors.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    gains: Gains
    rate: float = 1000.0
    hold: EffortHold = EffortHold.END
    feedforward: bool = True
    limit_torques: bool = True
    encoder: Encoder = Encoder()
    delay: float = 0.0
    disturbance: Disturbance = Disturbance()

    def __post_init__(self) -> None:
        number('rate', self.rate, at_least=MIN_RATE, at_most=MAX_RATE, unit='Hz')
        number('torque_delay', self.delay, at_least=0, at_most=MAX_DELAY, unit='s')

    def check(self, joints: int) -> None:
        """Raise InvalidValueError unless it fits an arm of so many joints."""
        for name in ('stiffness', 'damping'):
            vector(name, getattr(self.gains, name), joints)
        vector('encoder_offsets', self.encoder.offsets, (0, joints))
        integer('disturbance_joint', self.disturbance.joint, at_least=0, at_most=joints)


class Plant:
    """
    The arm, its controller and the present state.

    Parameters
    ----------
    model : ArmDynamics
        n joints, n_t coordinates.
    control : Control
        Of the joints.
    payload_mass, payload_inertia : float
        At the tip, >= 0 [kg], [kg m^2].
    positions : array_like, shape (n,)
        Joint angles at rest to start from, as the encoders say them but for rounding [rad].

    Attributes
    ----------
    parameters : PhysicalParameters
        Of the arm, with its payload.
    state : numpy.ndarray, shape (2 n_t,)
        x = (q, q').
    torque : numpy.ndarray, shape (n,)
        Of the motors, as the controller had it last [N m]; it acts a delay later.
    sensor : JointSensor
        What the encoders say.

    """

    def __init__(self, model: ArmDynamics, control: Control, *, payload_mass: float,
                 positions: Array, payload_inertia: float = 0.0) -> None:
        n = model.arm.n_joints
        control.check(n)
        self.model, self.control, self.period = model, control, 1 / control.rate
        mass = number('payload_mass', payload_mass, at_least=0, at_most=MAX_PAYLOAD, unit='kg')
        inertia = number('payload_inertia', payload_inertia, at_least=0, at_most=MAX_PAYLOAD,
                         unit='kg m^2')
        parameters = PhysicalParameters.of_arm(model.arm, payload_mass=mass,
                                               payload_inertia=inertia)
        shown = vector('positions', positions, n, unit='rad')
        rest, self.torque = equilibrium(model, shown - control.encoder.shifted(np.zeros(n)),
                                        parameters)
        self.state = np.concatenate([rest, np.zeros_like(rest)])
        self.sensor = JointSensor(control.encoder, rest[:n])
        self.parameters = parameters
        self._limits = TorqueLimits.of(model.arm)
        self._parts = _period_parts(control.delay, self.period)
        self._integrators = [HeldTorqueIntegrator(
            model, parameters.physical, period=length, longest_step=_LONGEST_STEP,
            rtol=RTOL, atol=ATOL) for _, length in self._parts]
        # the torques on their way, the latest one first
        self._commands = deque([self.torque], maxlen=self._parts[0][0] + 1)
        self._ticks, self._began = 0, 0.0
        self._reference = JointReference.hold(shown, self.torque)
        self._moves = False
        self._law: LinearFeedback | None = None
        self._law_state: Array = np.zeros(0)

    @property
    def time(self) -> float:
        """Return the time since the start [s]."""
        return self._ticks * self.period

    @property
    def elapsed(self) -> float:
        """Return the time since the motion began, or since the start [s]."""
        return (self._ticks - self._began) * self.period

    @property
    def joint_state(self) -> tuple[Array, Array]:
        """Return the true joint angles and speeds."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        return self.state[:n], self.state[n_t:n_t + n]

    @property
    def shown_state(self) -> tuple[Array, Array]:
        """Return joint angles as exact encoders say them, and the speeds."""
        angles, speeds = self.joint_state
        return self.control.encoder.shifted(angles), speeds

    def use_law(self, law: LinearFeedback | None) -> None:
        """
        Use a law in place of the PD from now on; None for the PD.

        Raises
        ------
        InvalidValueError
            If it is for another rate, or another number of joints.

        """
        if law is not None:
            integer('joints of the law', law.joints, at_least=self.torque.size,
                    at_most=self.torque.size)
            number('rate of the law', law.rate, at_least=self.control.rate,
                   at_most=self.control.rate, unit='Hz')
        self._law = law
        self._law_state = np.zeros(0 if law is None else law.order)

    def follow(self, reference: JointReference, passed: float = 0.0) -> None:
        """
        Follow a reference from now on.

        Parameters
        ----------
        reference : JointReference
            From time 0.
        passed : float
            Of it by now, where it goes on with what the arm follows already: a law keeps what it
            knows of the arm then; 0 for a new motion [s].

        """
        if not passed:
            self._law_state = np.zeros_like(self._law_state)
        self._reference, self._moves = reference, True
        self._began = self._ticks - passed / self.period

    def advance(self, until: float, observe: Callable[[Plant], None] | None = None) -> None:
        """
        Go on to a time [s] by whole periods of the controller; the observer is called after each.

        Raises
        ------
        RunawayError
            If the arm cannot be integrated further, a joint turns by more than 1000 rad/s, or a
            modal displacement is more than 100 m.

        """
        while self.time + self.period <= until + 1e-9:
            self._go_on()
            if observe is not None:
                observe(self)

    def _go_on(self) -> None:
        """Compute a torque, hold it for one period."""
        begin = self.elapsed
        self.torque = self._command(begin)
        self._commands.appendleft(self.torque)
        outside: Array | float = 0.0
        if self._moves:
            outside = self.control.disturbance.mean(begin, begin + self.period, self.torque.size)
        for (lag, _), integrator in zip(self._parts, self._integrators, strict=True):
            acting = self._commands[min(lag, len(self._commands) - 1)]
            state = integrator.advance(self.state, acting + outside)
            if state is None or self._is_beyond(state):
                raise RunawayError(f'the simulated arm has run away after {self.time:.3f} s: the '
                                   'gains are too high for the rate of the controller, or the '
                                   'torques too large')
            self.state = state
        self._ticks += 1
        self.sensor.look(self.time, *self.joint_state)

    def _is_beyond(self, state: Array) -> bool:
        """Return whether a state is none that an arm could have, though it can be integrated."""
        n, n_t = self.model.arm.n_joints, self.model.arm.n_coordinates
        size = np.abs(state)
        return bool(size[n_t:n_t + n].max() > MAX_VELOCITY
                    or size[n:n_t].max(initial=0.0) > MAX_DISPLACEMENT)

    def _command(self, elapsed: float) -> Array:
        """Return the torques of the motors for the coming period."""
        sensor = self.sensor
        position, velocity = self._reference.motion(elapsed)
        effort: Array = np.zeros_like(position)
        if self.control.feedforward or not self._moves:
            due = elapsed + self.control.hold.delay * self.period
            effort = self._reference.torque(due)
        if self._law is not None:
            return self._command_by(self._law, sensor.positions - position, effort)
        gains = self.control.gains
        return self._limited(effort + gains.stiffness * (position - sensor.positions)
                             + gains.damping * (velocity - sensor.speeds))

    def _command_by(self, law: LinearFeedback, error: Array, effort: Array) -> Array:
        """Return the torques of a law, and let it take note of what the motors give."""
        torque = self._limited(effort + law.C @ self._law_state + law.D @ error)
        self._law_state = law.A @ self._law_state + law.B @ error + law.E @ (torque - effort)
        return torque

    def _limited(self, torque: Array) -> Array:
        """Return the torques that the motors give."""
        if self.control.limit_torques:
            lower, upper = self._limits.bounds(self.joint_state[1])
            torque = np.minimum(np.maximum(torque, lower), upper)
        return torque


def _period_parts(delay: float, period: float) -> list[tuple[int, float]]:
    """Return by how many periods the torque of each part of a period is late, and its length."""
    lag, share = divmod(delay / period, 1)
    if min(share, 1 - share) < _WHOLE:
        return [(round(delay / period), period)]
    return [(int(lag) + 1, share * period), (int(lag), (1 - share) * period)]
