"""
An arm with its compiled dynamics as array functions.

Arrays hold one point per row. The state is x = (q, q').

"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from functools import lru_cache
import threading
from typing import Any, TypeVar

from flex_planner.arms.arm import Arm
from flex_planner.base.compiled_library import content_key
from flex_planner.base.validation import Array
from flex_planner.dynamics.cache_key import cache_key, describe_fields
from flex_planner.dynamics.compiled_functions import BatchFunction, load_functions
import numpy as np

RungeKuttaSteps = Callable[[Array, Array, float], tuple[Array, Array, Array]]
HeldStep = Callable[[Array, Array, float], tuple[Array, Array, Array]]

RUNGE_KUTTA_STAGES = 12
_MOST_KEPT = 16

Dynamics = TypeVar('Dynamics', bound='ArmDynamics')
_lock = threading.Lock()
_kept: OrderedDict[tuple[type, str], Any] = OrderedDict()


@lru_cache(maxsize=4 * _MOST_KEPT)
def _describe(arm: Arm) -> str:
    """Return the fields of an arm as text, once for each object."""
    return describe_fields(arm)


class ArmDynamics:
    """
    The equations of motion of one arm, compiled on first use anywhere on this machine.

    That takes seconds; later they are read from disk. `physical` is
    `PhysicalParameters.physical` everywhere.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.

    """

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._loaded: dict[str, BatchFunction] = {}
        self.prepare()

    @classmethod
    def of(cls: type[Dynamics], arm: Arm) -> Dynamics:
        """Return the functions of an arm, the same ones for an equal arm: some arms are kept."""
        key = cls, _describe(arm)
        with _lock:
            found: Dynamics = _kept.pop(key, None) or cls(arm)
            _kept[key] = found
            if len(_kept) > _MOST_KEPT:
                _kept.popitem(last=False)
        return found

    def __reduce__(self) -> tuple[Callable[[Arm], ArmDynamics], tuple[Arm]]:
        """Leave the machine code behind: it is loaded again when it is needed."""
        return type(self).reconstruct, self.reconstruction_arguments()

    def reconstruction_arguments(self) -> tuple[Arm]:
        """Return the arguments of `reconstruct`."""
        return (self.arm,)

    @classmethod
    def reconstruct(cls: type[Dynamics], arm: Arm) -> Dynamics:
        """Return the functions of an arm, loaded or compiled when they are needed."""
        made = cls.__new__(cls)
        made.arm, made._loaded = arm, {}
        return made

    def prepare(self) -> None:
        """Load the functions from disk, or compile them, and the libraries that solving takes."""
        import scipy.integrate
        import scipy.linalg  # noqa: F401

        self._load('forward_dynamics')

    def forward_dynamics(self, x: Array, torque: Array, physical: Array) -> Array:
        """Return x' of eq. (5) for states (k, 2 n_t) and torques (k, n)."""
        return self._load('forward_dynamics')(x, torque, physical)[0]

    def state_rate(self, physical: Array) -> Callable[[Array, Array], Array]:
        """
        Return x' as a quick function of one state (2 n_t,) and one torque (n,).

        Every call returns the same array, overwritten; one function must not be shared between
        threads.

        """
        x, torque = np.zeros((1, 2 * self.arm.n_coordinates)), np.zeros((1, self.arm.n_joints))
        rate = np.zeros_like(x)
        run = self._load('forward_dynamics').bind_arrays([x, torque, np.array(physical)], [rate])

        def evaluate(state: Array, torques: Array) -> Array:
            x[0], torque[0] = state, torques
            run()
            result: Array = rate[0]
            return result

        return evaluate

    def runge_kutta_steps(self, physical: Array) -> RungeKuttaSteps:
        """
        Return steps of the Dormand-Prince method of order 8 as a quick function.

        From a state (2 n_t,), torques at the twelve stages of k steps (k, 12 n) and the length of
        a step it makes the states after each step and their two error estimates, (k, 2 n_t) each.

        """
        function = self._load('runge_kutta_step')

        def advance(state: Array, torques: Array, length: float) -> tuple[Array, Array, Array]:
            first = np.broadcast_to(state, (len(torques), state.size))
            after, fifth, third = function.evaluate_chain(
                first, torques, np.full((len(torques), 1), length), physical)
            return after, fifth, third

        return advance

    @property
    def runge_kutta_address(self) -> int | None:
        """Return where the compiled function of these steps is, None if it is interpreted."""
        return self._load('runge_kutta_step').address

    @property
    def forward_dynamics_address(self) -> int | None:
        """Return the address of `forward_dynamics` in compiled code, None without a compiler."""
        return self._load('forward_dynamics').address

    def controlled_steps(self, state: Array, reference: Array, timing: Array, controller: Array,
                         physical: Array) -> tuple[Array, Array, Array, Array]:
        """
        Return the states after each of k steps under a joint controller, and their errors.

        Motors have their limits at the speeds of every instant, as `TorqueLimits` has them.

        Parameters
        ----------
        state : numpy.ndarray, shape (2 n_t,)
            Before the first step, in which the controller must be sampled.
        reference : numpy.ndarray, shape (k, 4 n)
            Angles [rad] and speeds [rad/s] that the PD compares the joints with, and efforts at
            the beginning and the end of each step [N m].
        timing : numpy.ndarray, shape (k, 2)
            Length of each step [s], and 1 where the PD is sampled at its beginning, 0 where it is
            held.
        controller : numpy.ndarray, shape (5 n,)
            Stiffness, damping, stall torque, torque lost per speed and largest torque of the
            joints.
        physical : numpy.ndarray
            `PhysicalParameters.physical`.

        Returns
        -------
        states : numpy.ndarray, shape (k, 2 n_t)
            After each step.
        feedback : numpy.ndarray, shape (k, n)
            Torque of the PD in each step [N m].
        fifth, third : numpy.ndarray, shape (k, 2 n_t)
            As `runge_kutta_steps` has them.

        """
        first = np.zeros((len(reference), state.size + self.arm.n_joints))
        first[0, :state.size] = state
        after, fifth, third = self._load_step('controlled_step').evaluate_chain(
            first, reference, timing, controller, physical)
        return after[:, :state.size], after[:, state.size:], fifth, third

    def feedback_steps(self, state: Array, reference: Array, timing: Array, law: Array,
                       motors: Array, physical: Array) -> tuple[Array, Array, Array]:
        """
        Return what follows each of k steps under a linear law, and the errors of the steps.

        The law is sampled at the beginning of steps, with the limits of motors at the speeds of
        that instant, and its torques are held.

        Parameters
        ----------
        state : numpy.ndarray, shape (4 n_t + 2 n,)
            x (2 n_t,), the state of the law (2 n_t + n,) and torques (n,) before the first step.
        reference : numpy.ndarray, shape (k, 2 n)
            Angles that joints are compared with [rad], and efforts [N m].
        timing : numpy.ndarray, shape (k, 2)
            Length of each step [s], and 1 where the law is sampled at its beginning, else 0.
        law : numpy.ndarray
            A, B, C, D, E of `LinearFeedback`, each column by column.
        motors : numpy.ndarray, shape (3 n + 1,)
            Stall torque, torque lost per speed and largest torque of the joints; the resolution
            of the encoders, 0 for exact ones [rad].
        physical : numpy.ndarray
            `PhysicalParameters.physical`.

        Returns
        -------
        states : numpy.ndarray, shape (k, 4 n_t + 2 n)
            As `state`, after each step.
        fifth, third : numpy.ndarray, shape (k, 2 n_t)
            As `runge_kutta_steps` has them.

        """
        first = np.zeros((len(reference), state.size))
        first[0] = state
        after, fifth, third = self._load_step('feedback_step').evaluate_chain(
            first, reference, timing, law, motors, physical)
        return after, fifth, third

    def held_step(self, physical: Array) -> HeldStep:
        """
        Return one such step under torques that are held, as a quick function.

        From a state (2 n_t,), torques (n,) and a length [s] it makes the next state and the two
        error estimates, (2 n_t,) each. As with `state_rate`, the arrays are overwritten by the
        next call.

        """
        n, size = self.arm.n_joints, 2 * self.arm.n_coordinates
        x, torques, length = np.zeros((1, size)), np.zeros((1, RUNGE_KUTTA_STAGES,
                                                            n)), np.zeros((1, 1))
        after, fifth, third = (np.zeros((1, size)) for _ in range(3))
        run = self._load('runge_kutta_step').bind_arrays(
            [x, torques.reshape(1, RUNGE_KUTTA_STAGES * n), length, np.array(physical)],
            [after, fifth, third])

        def advance(state: Array, torque: Array, seconds: float) -> tuple[Array, Array, Array]:
            x[0], torques[0], length[0, 0] = state, torque, seconds
            run()
            return after[0], fifth[0], third[0]

        return advance

    def inverse_dynamics(self, x: Array, acceleration: Array, physical: Array) -> Array:
        """Return M q'' + h, shape (k, n_t), eq. (3)."""
        return self._load('inverse_dynamics')(x, acceleration, physical)[0]

    def static_forces(self, q: Array, physical: Array) -> tuple[Array, Array]:
        """
        Return the forces that hold the arm at rest, and its stiffness.

        First and second derivatives of the potential energy at coordinates (k, n_t), shapes
        (k, n_t) [N m, N] and (k, n_t, n_t).

        """
        force, stiffness = self._load('static_forces')(q, physical)
        count = self.arm.n_coordinates
        return force, stiffness.reshape(-1, count, count)

    def mass_and_energy(self, x: Array, physical: Array) -> tuple[Array, Array, Array]:
        """Return M (k, n_t, n_t), kinetic and potential energy (k,) [J]."""
        mass, kinetic, potential = self._load('mass_and_energy')(x, physical)
        count = self.arm.n_coordinates
        return mass.reshape(-1, count, count), kinetic[:, 0], potential[:, 0]

    def _load(self, name: str) -> BatchFunction:
        """Return a function; the first one brings all of its library."""
        if name not in self._loaded:
            self._loaded |= load_functions(cache_key(self.arm, 'dynamics'), self._build)
        return self._loaded[name]

    def _load_step(self, name: str) -> BatchFunction:
        """Return a step under a controller; it is derived when first wanted."""
        if name not in self._loaded:
            key = content_key(cache_key(self.arm, 'dynamics'), name)
            self._loaded |= load_functions(key, lambda: _build_step(self.arm, name))
        return self._loaded[name]

    def _build(self) -> Mapping[str, tuple[Any, int]]:
        """Derive the functions; CasADi is imported only here."""
        from flex_planner.dynamics.dynamics_functions import build_dynamics_functions

        return build_dynamics_functions(self.arm)


def _build_step(arm: Arm, name: str) -> Mapping[str, tuple[Any, int]]:
    """Derive a step under a controller; CasADi is imported only here."""
    from flex_planner.dynamics.controller_steps import build_controlled_step, build_feedback_step

    builders = {'controlled_step': build_controlled_step, 'feedback_step': build_feedback_step}
    return builders[name](arm)
