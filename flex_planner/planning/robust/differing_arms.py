"""Arms that differ from the one that a motion is planned for, in stiffness and in payload."""

from __future__ import annotations

from dataclasses import fields, replace

from flex_planner.arms.arm import Arm, Link
from flex_planner.arms.spatial_link import SpatialLink
from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.planning.execution import Execution
from flex_planner.planning.robust.objective import Robustness
import numpy as np

MORE_MODES = 2
# by how much the phase at arrival of the slow vibrations may differ between arms next to one
# another that are weighed [rad]; as many stiffnesses between are looked at in the end, too
_WEIGHED = np.pi
_MOST_LEVELS = 12


def with_more_modes(arm: Arm) -> Arm:
    """Return an arm whose flexible links have two more modes, as far as links may have them."""
    return replace(arm, links=tuple(
        link.with_more_modes(MORE_MODES) if link.modes else link
        for link in arm.links))


def has_all_modes(arm: Arm) -> bool:
    """Return whether an arm has modes, and none of its links can have more."""
    return 0 < arm.n_modes == with_more_modes(arm).n_modes


def plain_parameters(given: PhysicalParameters) -> PhysicalParameters:
    """Return the part of a plan's parameters that is about the arm."""
    return PhysicalParameters(**{one.name: getattr(given, one.name)
                                 for one in fields(PhysicalParameters)})


def differing_parameters(given: PhysicalParameters, stiffness: float,
                         payload: float) -> PhysicalParameters:
    """Return parameters with E I and the payload off by shares of themselves."""
    return replace(plain_parameters(given), rigidity=given.rigidity * (1 + stiffness),
                   payload_mass=given.payload_mass * (1 + payload),
                   payload_inertia=given.payload_inertia * (1 + payload))


def other_execution(nominal: Execution, dynamics: ArmDynamics,
                    parameters: PhysicalParameters, rest: Array | None = None) -> Execution:
    """
    Return the same trajectory carried out by another arm.

    Where the first one would be at rest at the start (n_t,) is found if it is not given.

    Raises
    ------
    NoEquilibriumError
        If that arm buckles at the start.

    """
    return replace(nominal, dynamics=dynamics, parameters=parameters,
                   start=_other_start(nominal, dynamics, parameters,
                                      rest_at_start(nominal) if rest is None else rest))


def rest_at_start(execution: Execution) -> Array:
    """Return the coordinates (n_t,) of an arm at rest with the joint angles of its start."""
    angles = execution.start[:execution.dynamics.arm.n_joints]
    return equilibrium(execution.dynamics, angles, execution.parameters)[0]


def weighed_errors(robustness: Robustness, nominal: Execution, *, finely: bool = False) -> Array:
    """
    Return errors of stiffness and payload of arms that stand for a whole box, shape (k, 2).

    The corners of the box, and as many stiffnesses between them as the phases of the slow
    vibrations ask for: over the motion they drift apart by omega T / 2 times the error.

    Parameters
    ----------
    robustness : Robustness
        With the box.
    nominal : Execution
        By the arm of the model.
    finely : bool
        Whether to take as many stiffnesses between, so that the worst is not missed by much.

    """
    given = nominal.parameters
    payload = robustness.payload_error if given.payload_mass or given.payload_inertia else 0.0
    drift = _slow_frequency(nominal) * nominal.duration * robustness.stiffness_error / 2
    levels = min(int(np.ceil(drift / _WEIGHED)), _MOST_LEVELS) * (2 if finely else 1)
    shares = np.arange(-levels, levels + 1) / max(levels, 1)
    if levels:
        shares = shares[shares != 0]
    payloads = np.unique([-payload, payload])
    return np.array([(robustness.stiffness_error * share, error)
                     for share in shares for error in payloads])


def _slow_frequency(nominal: Execution) -> float:
    """Return the highest of the lowest frequencies, one for each way to bend [rad/s]."""
    arm, n = nominal.dynamics.arm, nominal.dynamics.arm.n_joints
    coordinates = nominal.start[:arm.n_coordinates]
    frequencies, _ = natural_modes(nominal.dynamics, coordinates, nominal.parameters,
                                   locked=False)
    flexible = sum(map(_ways_to_bend, arm.links)) + len(arm.elastic_joints)
    frequency = np.nan_to_num(frequencies)[n:n + flexible]
    return float(frequency.max(initial=0.0))


def _ways_to_bend(link: Link | SpatialLink) -> int:
    """Return in how many planes a link bends, and whether it twists; of elements two at most."""
    if not isinstance(link, SpatialLink):
        return int(link.modes > 0)
    if not link.beam:
        return min(link.modes, 2)
    return sum(count > 0 for count in (*link.beam.modes, link.beam.twist_modes))


def _other_start(nominal: Execution, dynamics: ArmDynamics, parameters: PhysicalParameters,
                 rest: Array) -> Array:
    """Return where another arm starts: as far from its rest as the one that was planned for."""
    planned, arm = nominal.dynamics.arm, dynamics.arm
    angles = nominal.start[:planned.n_joints]
    other, _ = equilibrium(dynamics, angles, parameters)
    start = np.concatenate([other, np.zeros_like(other)])
    away = nominal.start - np.concatenate([rest, np.zeros_like(rest)])
    n = arm.n_joints
    # modes of the planned arm are among those of the other one, but not always the first
    places = np.array([*range(n), *(n + arm.passive_names.index(name)
                                    for name in planned.passive_names)])
    for half, part in enumerate(np.split(away, 2)):
        start[half * arm.n_coordinates + places] += part
    return start
