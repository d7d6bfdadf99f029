"""An arm under a sampled drive as array functions: its motion and the derivatives of that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.joint import Motor
from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.dynamics.cache_key import cache_key
from flex_planner.dynamics.compiled_functions import load_functions
from flex_planner.identification.loop_sizes import LAGS, LoopSizes
from flex_planner.identification.plant_parameters import (
    mode_weights,
    with_damping,
    with_rigidity,
)
from flex_planner.identification.simulated_log import DriveLaw, SimulatedLog
import numpy as np

# rows that are computed before what nobody needs of them is thrown away
_BLOCK = 4096
# of a step and the fastest motion: the method is stable up to 2.8
_STEP_ANGLE = 1.0
_MOST_ITERATIONS = 50


def bare_arm(arm: Arm) -> Arm:
    """
    Return an arm whose compiled functions serve all values of damping, friction and rotors.

    Its damping ratios are half the weights of the modes; elastic joints keep a rotor of 1 kg m^2,
    without which they would not be valid.

    """
    links: Any = tuple(
        with_damping(with_rigidity(link, 1.0), [weight / 2 for weight in mode_weights(link)])
        if link.modes else link for link in arm.links)
    joints = tuple(replace(
        joint, motor=Motor(rotor_inertia=1.0 if joint.is_elastic else 0.0),
        viscous_friction=0.0, coulomb_friction=1.0, coulomb_speed=1.0) for joint in arm.joints)
    return replace(arm, links=links, joints=joints)


class LoopModel:
    """
    The motion of an arm under a drive, compiled on first use for each arm and number of modes.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates; values of its parameters do not matter.
    payload_inertia : float
        Of the payload about its centre [kg m^2].

    """

    def __init__(self, arm: Arm, payload_inertia: float = 0.0) -> None:
        self.arm, self.bare = arm, bare_arm(arm)
        self.sizes = LoopSizes(arm.n_joints, arm.n_coordinates)
        self._constants = np.array([payload_inertia,
                                    *(joint.coulomb_speed for joint in arm.joints)])
        self._functions = load_functions(cache_key(self.bare, 'dynamics', 'identification'),
                                         self._build)

    def _build(self) -> Mapping[str, tuple[Any, int]]:
        """Derive the functions; CasADi is imported only here."""
        from flex_planner.identification.loop_functions import build_loop_functions

        return build_loop_functions(self.bare, self.sizes)

    def rest(self, angles: Array, values: Array) -> tuple[Array, Array, Array]:
        """
        Return the arm at rest, and how that changes.

        Returns
        -------
        coordinates : numpy.ndarray, shape (n_t,)
            With the static bending.
        by_angles, by_parameters : numpy.ndarray, shape (n_t, n), (n_t, 1 + 5 n)
            Its derivatives.

        Raises
        ------
        NoEquilibriumError
            If the links are so soft that none is found.

        """
        n, sizes = self.arm.n_joints, self.sizes
        shared = np.concatenate([values[:sizes.physical], self._constants])
        q = np.concatenate([angles, np.zeros(self.arm.n_passive)])
        for _ in range(_MOST_ITERATIONS):
            force, stiffness, by_p = (entry[0] for entry in
                                      self._functions['rest'](q[None], shared))
            if not self.arm.n_passive:
                return q, np.eye(n), np.zeros((n, sizes.physical))
            stiffness, by_p = stiffness.T, by_p.T  # matrices arrive transposed
            change = np.linalg.solve(stiffness[n:, n:], force[n:])
            q[n:] -= change
            if np.abs(change).max() <= 1e-12 * self.arm.reach:
                solved = -np.linalg.solve(stiffness[n:, n:],
                                          np.hstack([stiffness[n:, :n], by_p[n:]]))
                return (q, np.vstack([np.eye(n), solved[:, :n]]),
                        np.vstack([np.zeros((n, sizes.physical)), solved[:, n:]]))
        raise NoEquilibriumError('no static equilibrium was found: the links are too soft for '
                                 'their load')

    def fastest(self, angles: Array, values: Array) -> float:
        """Return the largest rate at which the arm moves by itself at rest [rad/s]."""
        at = self._at_rest(angles, values)[0]
        n_t, by_x = self.arm.n_coordinates, self._linear(at, values)[1].T
        slope = np.vstack([np.eye(n_t, 2 * n_t, n_t), by_x])
        return float(np.abs(np.linalg.eigvals(slope)).max())

    def inertias(self, angles: Array, values: Array) -> Array:
        """Return what each motor has to accelerate at once, shape (n,) [kg m^2]."""
        n = self.arm.n_joints
        # of one column it is a vector
        by_u = self._linear(self._at_rest(angles, values)[0], values)[3].reshape(n, -1).T
        inertias: Array = 1 / np.diag(by_u[:n])
        return inertias

    def _linear(self, state: Array, values: Array) -> list[Array]:
        shared = np.concatenate([values[:self.sizes.physical], self._constants])
        results = self._functions['linear_rate'](
            state[None], np.zeros((1, self.arm.n_joints)), shared)
        return [entry[0] for entry in results]

    def _at_rest(self, angles: Array, values: Array) -> tuple[Array, Array]:
        """Return the state at rest, with its derivatives (2 n_t, columns)."""
        sizes = self.sizes
        q, by_angles, by_p = self.rest(angles, values)
        slope = np.zeros((2 * sizes.coordinates, sizes.columns))
        slope[:sizes.coordinates, :sizes.physical] = by_p
        slope[:sizes.coordinates, -sizes.joints:] = by_angles
        return np.concatenate([q, np.zeros_like(q)]), slope

    def simulate(self, start: Array, followed: Array, law: DriveLaw, values: Array,
                 parts: int, away: Array | None = None) -> SimulatedLog:
        """
        Return the motion from a start, with its derivatives.

        Parameters
        ----------
        start : numpy.ndarray, shape (n,)
            True joint angles [rad].
        followed : numpy.ndarray, shape (k, 3 n)
            Angles, speeds and efforts that the drive follows at its samples [rad], [rad/s],
            [N m]; angles as encoders say them.
        law : DriveLaw
            Of the drive.
        values : numpy.ndarray, shape (2 + 6 n,)
            The parameters, as `list_parameters` has them.
        parts : int
            Steps for each of the two parts that the delay divides a period into.
        away : numpy.ndarray, shape (2 n_t - n,), optional
            By how much passive coordinates and all rates differ from rest at the start.

        """
        rows = schedule_steps(followed, law.period, values[-1], parts, self.sizes)
        per_sample = len(rows) // len(followed)
        z, dz = self._begin(start, values)
        if away is None:
            return self._run(z, dz, rows, per_sample, law, values)
        apart = self._apart(law.period)
        z += apart @ away
        plain = self._run(z, dz, rows, per_sample, law, values)
        # derivatives are affine in those at the start, so what columns add there they add later
        added = []
        for block in np.split(apart, range(dz.shape[1], apart.shape[1], dz.shape[1]), axis=1):
            width = block.shape[1]
            other = self._run(z, dz + np.pad(block, ((0, 0), (0, dz.shape[1] - width))), rows,
                              per_sample, law, values)
            added.append(other.minus(plain, width))
        return plain.beside(added)

    def _begin(self, start: Array, values: Array) -> tuple[Array, Array]:
        """Return arm and drive at rest at a start, (state,), with derivatives (state, columns)."""
        sizes = self.sizes
        x, slope = self._at_rest(start, values)
        z, dz = np.zeros(sizes.state), np.zeros((sizes.state, sizes.columns))
        z[:x.size], dz[:x.size] = x, slope
        n, offsets = sizes.joints, slice(sizes.physical, sizes.physical + sizes.joints)
        z[sizes.angles] = start + values[offsets]
        dz[sizes.angles, offsets] = dz[sizes.angles, -n:] = np.eye(n)
        return z, dz

    def _apart(self, period: float) -> Array:
        """Return how arm and drive differ from rest if the arm does, (state, 2 n_t - n)."""
        sizes, n, n_t = self.sizes, self.sizes.joints, self.sizes.coordinates
        apart = np.eye(sizes.state)[:, n:2 * n_t]
        speeds = slice(n_t - n, n_t)
        # the drive has seen the joints move before
        apart[2 * n_t:2 * n_t + n, speeds] = np.eye(n)
        apart[sizes.angles, speeds] = -period * np.eye(n)
        return apart

    def _run(self, z: Array, dz: Array, rows: Array, per_sample: int, law: DriveLaw,
             values: Array) -> SimulatedLog:
        """Return the motion from a state of arm and drive."""
        sizes = self.sizes
        shared = np.concatenate([values[:-1], self._constants])
        state, kept = np.concatenate([z, dz.T.ravel()]), []
        for begin in range(0, len(rows), _BLOCK * per_sample):
            block = rows[begin:begin + _BLOCK * per_sample]
            first = np.broadcast_to(state, (len(block), state.size))
            with np.errstate(all='ignore'):
                after, = self._functions['loop_step'].evaluate_chain(
                    first, block, law.vector, shared)
            state = after[-1]
            kept.append(after[::per_sample])
        return _unpack(np.vstack(kept), sizes)


def _unpack(states: Array, sizes: LoopSizes) -> SimulatedLog:
    """Return what a fit needs of the states after the first step of each period."""
    z = states[:, :sizes.state]
    slopes = states[:, sizes.state:].reshape(-1, sizes.columns, sizes.state).transpose(0, 2, 1)
    return SimulatedLog(angles=z[:, sizes.angles], guide=z[:, sizes.guide],
                        angle_slopes=slopes[:, sizes.angles],
                        guide_slopes=slopes[:, sizes.guide])


def schedule_steps(followed: Array, period: float, delay: float, parts: int,
                   sizes: LoopSizes) -> Array:
    """
    Return the rows of the compiled steps, two parts of each period of the drive.

    A delay of m periods and a share makes the command before last m act for that share of a
    period, and the last but m for the rest: so the motion is a smooth function of the delay, and
    it is exact.

    """
    n = sizes.joints
    lag = min(int(delay / period), LAGS - 1)
    share = delay / period - lag
    rows = np.zeros((len(followed), 2 * parts, sizes.row))
    rows[:, :, :3 * n] = followed[:, None]
    late, soon = rows[:, :parts, 3 * n:], rows[:, parts:, 3 * n:]
    late[:, :, 0], late[:, :, 1] = share * period / parts, 1 / parts
    soon[:, :, 0], soon[:, :, 1] = (1 - share) * period / parts, -1 / parts
    late[:, 0, 2] = 1.0
    late[0, 0, 3] = 1.0
    late[:, :, 4 + lag + 1] = soon[:, :, 4 + lag] = 1.0
    return rows.reshape(-1, sizes.row)


def steps_per_part(period: float, fastest: float) -> int:
    """Return how many steps each part of a period takes, so that they stay stable."""
    return max(1, int(np.ceil(period * fastest / _STEP_ANGLE)))
