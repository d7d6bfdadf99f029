"""Gains of a PD for an arm whose controller nobody has told of."""

from __future__ import annotations

from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import Gains
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import check_inertia
import numpy as np

_STIFFNESS, _DAMPING = 100.0, 10.0

# inertia about a joint above which the gains grow with it [kg m^2]
_HEAVY = 10.0
# share of a joint's speed that damping takes in a period: 2 is unstable; above the first number
# the gains are lowered to the second
_TOO_MUCH, _SAFE = 1.5, 0.5
_BENDS = 0.0, np.pi / 2, 5 * np.pi / 6


def default_gains(dynamics: ArmDynamics, rate: float = 1000.0) -> Gains:
    """
    Return gains for a controller of a rate: 100 N m/rad and 10 N m s/rad where they suit the arm.

    A joint that turns more than 10 kg m^2 has gains in proportion to that inertia. Where damping
    would be unstable because next to nothing turns at once with a joint - a link clamped to a
    hub without inertia - the gains of the joints are lowered.

    Raises
    ------
    InvalidTaskError
        See `check_inertia`.

    """
    arm, n = dynamics.arm, dynamics.arm.n_joints
    physical = PhysicalParameters.of_arm(arm).physical
    masses = [_mass(dynamics, bend, physical) for bend in _BENDS]
    for mass in masses:
        check_inertia(mass)
    scale: Array = np.maximum(1.0, np.diag(masses[0])[:n] / _HEAVY)
    response = np.max([np.diag(np.linalg.inv(mass))[:n] for mass in masses], axis=0)
    # the sum bounds the share of any combination of the joints
    share = response * _DAMPING * scale / rate
    if share.sum() > _TOO_MUCH:
        scale *= np.minimum(1.0, _SAFE / n / share)
    return Gains(stiffness=_rounded(_STIFFNESS * scale), damping=_rounded(_DAMPING * scale))


def _mass(dynamics: ArmDynamics, bend: float, physical: Array) -> Array:
    """Return M with all joints but the first bent alike, shape (n_t, n_t)."""
    state = np.zeros((1, 2 * dynamics.arm.n_coordinates))
    state[0, 1:dynamics.arm.n_joints] = bend
    mass: Array = dynamics.mass_and_energy(state, physical)[0][0]
    return mass


def _rounded(values: Array) -> Array:
    """Return numbers with two significant digits, as people choose gains."""
    return np.array([float(f'{value:.2g}') for value in values])
