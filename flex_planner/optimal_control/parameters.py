"""
The parameters of the optimality conditions, as numbers and as symbols in one order.

`Parameters` says which there are; its fields in the order of their definition make the vector
that compiled functions take. Symbols with the same names stand for them in expressions.

"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, TYPE_CHECKING

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.dynamics.physical_parameters import coulomb_frictions, PhysicalParameters
from flex_planner.optimal_control.torque_limits import TorqueLimits
import numpy as np

if TYPE_CHECKING:  # it imports CasADi, which takes as long as a plan
    from flex_planner.dynamics.chain import Chain


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parameters(PhysicalParameters):
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
    max_torque : numpy.ndarray, shape (n,)
        In all quadrants [N m]; infinite for none, and where the line does not fall.
    effort_weights : numpy.ndarray, shape (n,)
        Diagonal of R.
    position_weights, velocity_weights : numpy.ndarray, shape (n_t,)
        Diagonals of W_1 and W_2.

    """

    stall_torque: Array
    torque_slope: Array
    max_torque: Array
    effort_weights: Array
    position_weights: Array
    velocity_weights: Array

    @classmethod
    def of(cls, arm: Arm, *, payload_mass: float = 0.0, payload_inertia: float = 0.0,
           effort_weights: Array | None = None, position_weights: Array | None = None,
           velocity_weights: Array | None = None) -> Parameters:
        """Return the parameters of an arm; weights default to R = 1, W_1 = W_2 = 0."""
        limits = TorqueLimits.of(arm)

        def default(weights: Array | None, fallback: Array) -> Array:
            return fallback if weights is None else weights

        return cls(payload_mass=payload_mass, payload_inertia=payload_inertia,
                   rigidity=arm.flexural_rigidities(), **coulomb_frictions(arm),
                   stall_torque=limits.stall, torque_slope=limits.slope, max_torque=limits.cap,
                   effort_weights=default(effort_weights, np.ones(arm.n_joints)),
                   position_weights=default(position_weights, np.zeros(arm.n_coordinates)),
                   velocity_weights=default(velocity_weights, np.zeros(arm.n_coordinates)))

    @property
    def torque_limits(self) -> TorqueLimits:
        """Return the motors' limits: those of eq. (15), and caps."""
        return TorqueLimits(self.stall_torque, self.torque_slope, self.max_torque)

    @property
    def path_weights(self) -> Array:
        """Return the weights of all that counts on the way besides effort."""
        return np.concatenate([self.position_weights, self.velocity_weights])

    def scale_path_weights(self, factor: float) -> Parameters:
        """Return the same parameters with those weights multiplied by a factor."""
        return replace(self, position_weights=factor * self.position_weights,
                       velocity_weights=factor * self.velocity_weights)

    def drop_modes(self) -> Parameters:
        """Return the parameters of the same arm made rigid."""
        n = self.stall_torque.size
        return replace(self, rigidity=np.zeros(n), position_weights=self.position_weights[:n],
                       velocity_weights=self.velocity_weights[:n])

    def stack(self) -> Array:
        """Return them as one vector, as the compiled optimality conditions take them."""
        return np.concatenate([np.atleast_1d(getattr(self, name)) for name in NAMES])


NAMES = tuple(field.name for field in fields(Parameters))


def payload_index() -> int:
    """Return the index of the payload's mass in the vector."""
    return NAMES.index('payload_mass')


def torque_slope_slice(n: int) -> slice:
    """Return where K_2 of n motors is in the vector; before it are two numbers and lists of n."""
    first = 2 + n * (NAMES.index('torque_slope') - 2)
    return slice(first, first + n)


@dataclass(frozen=True, slots=True, eq=False)
class ParameterSymbols:
    """
    `Parameters` as CasADi symbols of a chain.

    Attributes
    ----------
    values : dict of str to casadi.SX
        By the names of the fields of `Parameters`.
    capped : bool
        Whether motors may have a cap.

    """

    values: dict[str, Any]
    capped: bool = True

    @classmethod
    def of(cls, chain: Chain, *, capped: bool = True) -> ParameterSymbols:
        """Create the symbols; payload and stiffness are those of the chain."""
        n_t, n = chain.coordinates.numel(), chain.rigidity.numel()
        create = type(chain.coordinates).sym
        sizes = {'stall_torque': n, 'torque_slope': n, 'max_torque': n, 'effort_weights': n,
                 'position_weights': n_t, 'velocity_weights': n_t}
        own = {name: create(name, size) for name, size in sizes.items()}
        return cls({'payload_mass': chain.payload_mass, 'payload_inertia': chain.payload_inertia,
                    'rigidity': chain.rigidity, 'coulomb_friction': chain.coulomb_friction,
                    'coulomb_speed': chain.coulomb_speed, **own}, capped)

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    @property
    def torque_limits(self) -> TorqueLimits:
        """Return the motors' limits: those of eq. (15), and caps."""
        return TorqueLimits(self['stall_torque'], self['torque_slope'],
                            self['max_torque'] if self.capped else None)

    def stack(self) -> list[Any]:
        """Return the symbols in the order of `Parameters.stack`."""
        return [self.values[name] for name in NAMES]
