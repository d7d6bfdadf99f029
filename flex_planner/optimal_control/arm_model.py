"""
An arm with its compiled functions: dynamics and Pontryagin's conditions as array functions.

Arrays hold one point a row. The state is x = (q, q'), the extended state of the optimality
conditions z = (q, q', psi_1, psi_2).

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import json
from pathlib import Path

from flex_planner.arms.arm import Arm
from flex_planner.dynamics.compiled_functions import (
    Array,
    BatchFunction,
    content_key,
    load_functions,
)
import numpy as np

RungeKuttaSteps = Callable[[Array, Array, float], tuple[Array, Array, Array]]

RUNGE_KUTTA_STAGES = 12
_SOURCES = ('arms/arm.py', 'arms/beam_eigenmodes.py', 'arms/mode_shapes.py',
            'dynamics/planar_chain.py', 'optimal_control/pontryagin.py')


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parameters:
    """
    What may change without compiling an arm again.

    Attributes
    ----------
    payload_mass, payload_inertia : float
        m_p [kg] and its rotary inertia [kg m^2].
    rigidity : numpy.ndarray, shape (n,)
        E I of each link [N m^2].
    stall_torque, torque_slope : numpy.ndarray, shape (n,)
        K_1 [N m] and K_2 [N m s/rad] of eq. (15).
    effort_weights : numpy.ndarray, shape (n,)
        Diagonal of R.
    position_weights, velocity_weights : numpy.ndarray, shape (n_t,)
        Diagonals of W_1 and W_2.

    """

    payload_mass: float
    payload_inertia: float
    rigidity: Array
    stall_torque: Array
    torque_slope: Array
    effort_weights: Array
    position_weights: Array
    velocity_weights: Array

    @classmethod
    def of(cls, arm: Arm, *, payload_mass: float = 0.0, payload_inertia: float = 0.0,
           effort_weights: Array | None = None, position_weights: Array | None = None,
           velocity_weights: Array | None = None) -> Parameters:
        """Return the parameters of an arm; weights default to R = 1, W_1 = W_2 = 0."""
        motors = [joint.motor for joint in arm.joints]

        def default(weights: Array | None, fallback: Array) -> Array:
            return fallback if weights is None else weights

        return cls(payload_mass=payload_mass, payload_inertia=payload_inertia,
                   rigidity=arm.flexural_rigidities(),
                   stall_torque=np.array([motor.stall_torque for motor in motors]),
                   torque_slope=np.array([motor.torque_slope for motor in motors]),
                   effort_weights=default(effort_weights, np.ones(arm.n_joints)),
                   position_weights=default(position_weights, np.zeros(arm.n_coordinates)),
                   velocity_weights=default(velocity_weights, np.zeros(arm.n_coordinates)))

    def torque_limit(self, torque: Array, speeds: Array) -> Array:
        """Return the bound of eq. (15) in the direction of each torque (k, n), as a size."""
        slowed = self.torque_slope * speeds
        limit: Array = self.stall_torque - np.where(torque >= 0, slowed, -slowed)
        return limit

    def stacked(self) -> Array:
        """Return them as one vector, as the compiled functions take them."""
        return np.concatenate([[self.payload_mass, self.payload_inertia], self.rigidity,
                               self.stall_torque, self.torque_slope, self.effort_weights,
                               self.position_weights, self.velocity_weights])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Controls:
    """
    What the optimality conditions determine at given points.

    Attributes
    ----------
    torque : numpy.ndarray, shape (k, n)
        Eq. (14) [N m].
    free_torque : numpy.ndarray, shape (k, n)
        The same without bounds, smooth where motors switch: eq. (13) [N m].
    cost_rate, hamiltonian : numpy.ndarray, shape (k,)
        L of eq. (7) and H of eq. (8).
    payload_share : numpy.ndarray, shape (k,)
        dH/dm_p [1/kg]; its integral is dJ/dm_p.
    acceleration : numpy.ndarray, shape (k, n_t)
        q'' [rad/s^2, m/s^2].

    """

    torque: Array
    free_torque: Array
    cost_rate: Array
    hamiltonian: Array
    payload_share: Array
    acceleration: Array


class ArmModel:
    """
    The dynamics and optimality conditions of one arm.

    Parameters
    ----------
    arm : Arm
        Compiled on first use anywhere on this machine (some seconds), then read from disk.

    """

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._functions: dict[str, BatchFunction] = load_functions(
            _key(arm), lambda: _build(arm))

    def optimality(self, z: Array, p: Array) -> Array:
        """Return z' of eqs. (11) and (12), shape (k, 4 n_t)."""
        return self._functions['optimality'](z, p)[0]

    def optimality_jacobian(self, z: Array, p: Array) -> tuple[Array, Array]:
        """Return z' and dz'/dz, shapes (k, 4 n_t) and (k, 4 n_t, 4 n_t)."""
        rate, jacobian = self._functions['optimality_jacobian'](z, p)
        return rate, jacobian

    def controls(self, z: Array, p: Array) -> Controls:
        """Return torque, cost and Hamiltonian at points, see `Controls`."""
        torque, free, cost, hamiltonian, share, acceleration = self._functions['control'](z, p)
        return Controls(torque=torque, free_torque=free, cost_rate=cost[:, 0],
                        hamiltonian=hamiltonian[:, 0], payload_share=share[:, 0],
                        acceleration=acceleration)

    def forward_dynamics(self, x: Array, torque: Array, p: Array) -> Array:
        """Return x' of eq. (5) for states (k, 2 n_t) and torques (k, n)."""
        return self._functions['forward_dynamics'](x, torque, p)[0]

    def state_rate(self, p: Array) -> Callable[[Array, Array], Array]:
        """
        Return x' as a quick function of one state (2 n_t,) and one torque (n,).

        Every call returns the same array, overwritten; one function must not be shared between
        threads.

        """
        x, torque = np.zeros((1, 2 * self.arm.n_coordinates)), np.zeros((1, self.arm.n_joints))
        rate = np.zeros_like(x)
        run = self._functions['forward_dynamics'].repeated(
            [x, torque, np.array(p)], [rate])

        def evaluate(state: Array, torques: Array) -> Array:
            x[0], torque[0] = state, torques
            run()
            result: Array = rate[0]
            return result

        return evaluate

    def payload_sensitivity(self, z: Array, p: Array) -> tuple[Array, Array, Array]:
        """Return dz'/dm_p (k, 4 n_t), dH/dm_p and d2H/dm_p2 (k,)."""
        rate, share, bend = self._functions['payload_sensitivity'](z, p)
        return rate, share[:, 0], bend[:, 0]

    def runge_kutta_steps(self, p: Array) -> RungeKuttaSteps:
        """
        Return steps of the Dormand-Prince method of order 8 as a quick function.

        From a state (2 n_t,), torques at the twelve stages of k steps (k, 12 n) and the length of
        a step it makes the states after each step and their two error estimates, (k, 2 n_t) each.

        """
        function = self._functions['runge_kutta_step']

        def advance(state: Array, torques: Array, length: float) -> tuple[Array, Array, Array]:
            first = np.broadcast_to(state, (len(torques), state.size))
            after, fifth, third = function.chained(
                first, torques, np.full((len(torques), 1), length), p)
            return after, fifth, third

        return advance

    def inverse_dynamics(self, x: Array, acceleration: Array, p: Array) -> Array:
        """Return M q'' + h, shape (k, n_t), eq. (3)."""
        return self._functions['inverse_dynamics'](x, acceleration, p)[0]

    def static_forces(self, q: Array, p: Array) -> tuple[Array, Array]:
        """
        Return what holds the arm at rest and its stiffness.

        First and second derivatives of the potential energy at coordinates (k, n_t), shapes
        (k, n_t) [N m, N] and (k, n_t, n_t).

        """
        force, stiffness = self._functions['static_forces'](q, p)
        count = self.arm.n_coordinates
        return force, stiffness.reshape(-1, count, count)

    def mass_and_energy(self, x: Array, p: Array) -> tuple[Array, Array, Array]:
        """Return M (k, n_t, n_t), kinetic and potential energy (k,) [J]."""
        mass, kinetic, potential = self._functions['mass_and_energy'](x, p)
        count = self.arm.n_coordinates
        return mass.reshape(-1, count, count), kinetic[:, 0], potential[:, 0]


def _key(arm: Arm) -> str:
    """Return the cache key: what enters the functions as constants, and their source."""
    structure = {
        'links': [(link.length, link.linear_density, link.modes, link.mode_family,
                   link.shape_mass, link.shape_inertia, link.damping_ratio)
                  for link in arm.links],
        'friction': [joint.viscous_friction for joint in arm.joints],
        'nodes': [(node.mass, node.inertia) for node in arm.nodes],
        'gravity': arm.gravity.tolist(),
    }
    folder = Path(__file__).parents[1]
    return content_key(json.dumps(structure), *((folder / name).read_bytes()
                                                for name in _SOURCES))


def _build(arm: Arm) -> dict[str, tuple[object, int]]:
    """Derive the functions; CasADi is imported only here."""
    from flex_planner.optimal_control.pontryagin import build_functions

    return build_functions(arm)
