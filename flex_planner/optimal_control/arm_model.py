"""
An arm with its compiled functions: dynamics and Pontryagin's conditions as array functions.

Arrays hold one point per row. The state is x = (q, q'), the extended state of the optimality
conditions z = (q, q', psi_1, psi_2).

"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.compiled_library import content_key
from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.collocation import SolverSettings
from flex_planner.collocation.core import prepare_core
from flex_planner.collocation.problem import CompiledRate
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.cache_key import cache_key, describe_fields, FREE_FIELDS
from flex_planner.dynamics.compiled_functions import BatchFunction, load_functions
from flex_planner.optimal_control.torque_limits import has_caps, TorqueLimits
import numpy as np


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

    @classmethod
    def of(cls, values: Sequence[Array]) -> Controls:
        """Return what a compiled function found."""
        torque, free, cost, hamiltonian, share, acceleration = values
        return cls(torque=torque, free_torque=free, cost_rate=cost[:, 0],
                   hamiltonian=hamiltonian[:, 0], payload_share=share[:, 0],
                   acceleration=acceleration)


class ArmModel(ArmDynamics):
    """
    The dynamics and optimality conditions of one arm, compiled as `ArmDynamics` is.

    `p` is `Parameters.stack` everywhere.

    Parameters
    ----------
    arm : Arm
        n joints, n_t coordinates.

    """

    @classmethod
    def for_arm(cls, arm: Arm, given: ArmModel | None = None) -> ArmModel:
        """
        Return the functions of an arm: those given, if they are its own.

        Raises
        ------
        InvalidTaskError
            If they are of another arm.

        """
        if given is None:
            return cls.of(arm)
        if given.arm is not arm and (describe_fields(given.arm, FREE_FIELDS)
                                     != describe_fields(arm, FREE_FIELDS)):
            raise InvalidTaskError(f'model is of another arm ({given.arm.name}) than the task '
                                   f'({arm.name})')
        # what is derived without the cap of a motor would not keep it
        missed = TorqueLimits.of(arm).capped & ~TorqueLimits.of(given.arm).capped
        return cls.of(arm) if missed.any() else given

    def prepare(self) -> None:
        """Load the functions and the core of the solver from disk, or compile them."""
        super().prepare()
        self._load_optimality('optimality')
        half = 2 * self.arm.n_coordinates
        prepare_core(2 * half, half, half, SolverSettings().stages)

    def optimality(self, z: Array, p: Array) -> Array:
        """Return z' of eqs. (11) and (12), shape (k, 4 n_t)."""
        return self._load_optimality('optimality')(z, p)[0]

    def optimality_jacobian(self, z: Array, p: Array) -> tuple[Array, Array]:
        """Return z' and dz'/dz, shapes (k, 4 n_t) and (k, 4 n_t, 4 n_t)."""
        rate, jacobian = self._load_optimality('optimality_jacobian')(z, p)
        return rate, jacobian

    def compiled_rate(self, name: str, p: Array) -> CompiledRate | None:
        """
        Return rates and their Jacobian as machine code, None without a compiler.

        Parameters
        ----------
        name : str
            ``optimality``, ``free_payload``, ``free_duration``, ``free_times`` or
            ``torque_rate``.
        p : numpy.ndarray
            `Parameters.stack`, and what else the functions take.

        """
        load = self.torque_rate_function if name == 'torque_rate' else self._load_optimality
        functions = [load(part) for part in (name, f'{name}_jacobian')]
        rate, jacobian = (function.address for function in functions)
        if rate is None or jacobian is None:
            return None
        shared = np.ascontiguousarray(p, dtype=np.float64)
        return CompiledRate(rate, jacobian, (shared,), functions)

    def controls(self, z: Array, p: Array) -> Controls:
        """Return torque, cost and Hamiltonian at points, see `Controls`."""
        return Controls.of(self._load_optimality('control')(z, p))

    def barrier(self, name: str) -> BatchFunction:
        """Return a function of `build_barrier_functions`; they are derived when first wanted."""
        if name not in self._loaded:
            self.prepare_barrier()
        return self._loaded[name]

    def offset_function(self, name: str) -> BatchFunction:
        """Return a function of `build_offset_functions`; they are derived when first wanted."""
        return self._load_apart(name, 'offset', self._build_offset)

    def torque_rate_function(self, name: str) -> BatchFunction:
        """Return one of `build_torque_rate_functions`; they are derived when first wanted."""
        return self._load_apart(name, 'torque rate', self._build_torque_rate)

    def _load_apart(self, name: str, library: str,
                    build: Callable[[], Mapping[str, tuple[Any, int]]]) -> BatchFunction:
        """Return a function of a library that few motions need."""
        if name not in self._loaded:
            key = cache_key(self.arm, 'dynamics', 'optimal_control')
            self._loaded |= load_functions(
                content_key(key, library, 'caps' if has_caps(self.arm) else ''), build)
        return self._loaded[name]

    def prepare_barrier(self, monitor: Monitor | None = None) -> None:
        """
        Load the functions of an interior-point method from disk, or compile them.

        Parameters
        ----------
        monitor : Monitor, optional
            Told of it; it may stop it.

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        if 'barrier' in self._loaded:
            return
        if monitor is not None:
            monitor.check()
            monitor.announce('loading the functions of the interior-point method')
        key = cache_key(self.arm, 'dynamics', 'optimal_control')
        self._loaded |= load_functions(
            content_key(key, 'barrier', 'caps' if has_caps(self.arm) else ''),
            partial(_build_barrier, self.arm), monitor)

    def offset_optimality(self, z: Array, offset: Array, p: Array) -> Array:
        """Return z' with effort measured from offsets (k, n), shape (k, 4 n_t)."""
        return self.offset_function('offset_optimality')(z, offset, p)[0]

    def offset_controls(self, z: Array, offset: Array, p: Array) -> Controls:
        """Return `controls` with effort measured from offsets (k, n): in H, not in L."""
        return Controls.of(self.offset_function('offset_control')(z, offset, p))

    def payload_sensitivity(self, z: Array, p: Array) -> tuple[Array, Array, Array]:
        """Return dz'/dm_p (k, 4 n_t), dH/dm_p and d2H/dm_p2 (k,)."""
        rate, share, bend = self._load_optimality('payload_sensitivity')(z, p)
        return rate, share[:, 0], bend[:, 0]

    def _load_optimality(self, name: str) -> BatchFunction:
        """Return a function of the conditions; the first one brings all of their library."""
        if name not in self._loaded:
            key = cache_key(self.arm, 'dynamics', 'optimal_control')
            self._loaded |= load_functions(content_key(key, 'caps') if has_caps(self.arm) else key,
                                           self._build_optimality)
        return self._loaded[name]

    def _build_offset(self) -> Mapping[str, tuple[Any, int]]:
        """Derive the functions of effort from an offset; CasADi is imported only here."""
        from flex_planner.optimal_control.offset_conditions import build_offset_functions

        return build_offset_functions(self.arm)

    def _build_torque_rate(self) -> Mapping[str, tuple[Any, int]]:
        """Derive the functions of torques with a priced rate; CasADi is imported only here."""
        from flex_planner.optimal_control.torque_rate_conditions import (
            build_torque_rate_functions,
        )

        return build_torque_rate_functions(self.arm)

    def _build_optimality(self) -> Mapping[str, tuple[Any, int]]:
        """Derive the functions; CasADi is imported only here."""
        from flex_planner.optimal_control.pontryagin import build_optimality_functions

        return build_optimality_functions(self.arm)


def _build_barrier(arm: Arm) -> Mapping[str, tuple[Any, int]]:
    """Derive the functions of an interior-point method; CasADi is imported only here."""
    from flex_planner.optimal_control.barrier_conditions import build_barrier_functions

    return build_barrier_functions(arm)
