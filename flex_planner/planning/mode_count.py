"""How much vibration a plan leaves in an arm with more modes, estimated without compiling it."""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm import Arm, MAX_MODES
from flex_planner.base.validation import Array
from flex_planner.dynamics.unbent_arm import bending_stiffness, free_vibrations, mass_matrix
from flex_planner.optimal_control.task import Task
import numpy as np
from numpy.typing import NDArray

_STATIONS = 41


def estimate_left_out(task: Task, times: Array, weights: Array, torques: Array) -> float:
    """
    Return the residual vibration that a plan leaves if each link has one mode more [m].

    As `Certificate.residual_vibration` would be for that arm: the largest deflection after the
    joints are locked, vibrations of unlike frequencies being added by their squares. It is of the
    right size, no more: for a dozen arms and motions it was 0.85 to 2.8 times what a simulation
    with another mode found, and 10 times for the light links of De Luca and Siciliano. Pinned
    links with two modes are left with 0.01 mm, clamped ones with 10 mm, whatever their number of
    modes: there a jump of the torque excites all modes that a link has.

    A plan brings the modes that it knows to rest. Those that it leaves out are excited by its
    torque all the same, and they change the frequencies of the others: where the joints turn
    freely, as under a torque, clamped shapes need several modes for one that is right, so that
    even the lowest vibration is not where the plan takes it to be. Both are estimated: the arm is
    linearised at the goal with its links straight, without gravity and damping, and the torque is
    applied to that arm with the modes of the plan and with one more per link. A free vibration of
    frequency w and shape v is then left with the phasor

        a = 1/w * integral of v^T B u exp(i w t) dt,

    and what counts is the difference of the phasors of both arms, mode by mode: that of the plan's
    own modes does not vanish here, because the arm turns on its way while a linear one does not.

    Parameters
    ----------
    task : Task
        With an arm of n joints.
    times, weights : numpy.ndarray, shape (k,)
        Nodes and weights of a quadrature over the motion [s].
    torques : numpy.ndarray, shape (k, n)
        Of the plan at those times [N m].

    Returns
    -------
    float
        0 for a rigid arm.

    """
    arm = task.arm
    richer = _with_another_mode(arm)
    if richer.n_modes == arm.n_modes:
        return 0.0
    n, kept = arm.n_joints, _kept(arm, richer)
    counts = weights > 0
    times, weights, torques = times[counts], weights[counts], torques[counts]
    mass = mass_matrix(richer, task.goal_positions, task.payload_mass, task.payload_inertia)
    stiffness = bending_stiffness(richer)
    block = np.ix_(kept, kept)
    rates, shapes = free_vibrations(mass, stiffness, n)
    known_rates, known_shapes = free_vibrations(mass[block], stiffness[block], n)
    left = _phasors(rates, shapes[:n], times, weights, torques)
    known = _phasors(known_rates, known_shapes[:n], times, weights, torques)
    # what the plan's arm keeps of each vibration, in the vibrations of the richer one
    left = left - (shapes.T @ mass[:, kept] @ known_shapes) @ known
    return _locked_deflection(richer, mass[n:, n:], stiffness[n:, n:], rates,
                              shapes[n:] * np.abs(left))


def _with_another_mode(arm: Arm) -> Arm:
    """Return the arm with one mode more in every link that has any, and can have another."""
    return replace(arm, links=tuple(
        replace(link, modes=link.modes + 1) if 0 < link.modes < MAX_MODES else link
        for link in arm.links))


def _kept(arm: Arm, richer: Arm) -> NDArray[np.intp]:
    """Return the places of an arm's coordinates among those of the one with more modes."""
    modal = [np.arange(part.start, part.start + link.modes)
             for link, part in zip(arm.links, richer.modal_slices, strict=True)]
    return np.concatenate([np.arange(arm.n_joints), *modal])


def _phasors(rates: Array, joints: Array, times: Array, weights: Array,
             torques: Array) -> NDArray[np.complex128]:
    """Return amplitude and phase that the torques leave of each vibration, shape (n_f,)."""
    turning = np.exp(1j * np.multiply.outer(rates, times))
    forces = weights * (torques @ joints).T
    phasors: NDArray[np.complex128] = (turning * forces).sum(axis=1) / rates
    return phasors


def _locked_deflection(arm: Arm, mass: Array, stiffness: Array, rates: Array,
                       displacements: Array) -> float:
    """
    Return the largest deflection after the joints are locked amid free vibrations.

    Mass and stiffness are those of the modal coordinates, (n_f, n_f); `rates` and `displacements`
    are frequencies and modal amplitudes of the vibrations with free joints, one a column.

    """
    locked_rates, locked = free_vibrations(mass, stiffness, 0)
    parts = np.abs(locked.T @ mass @ displacements)
    # caught at its largest displacement or at its largest rate, whichever leaves more
    parts *= np.maximum(1.0, rates / locked_rates[:, None])
    amplitudes = np.sqrt((parts**2).sum(axis=1))  # unlike frequencies are not in phase
    largest = 0.0
    for link, part in zip(arm.links, arm.modal_slices, strict=True):
        stations = np.linspace(0, link.length, _STATIONS, dtype=np.float64)
        modal = slice(part.start - arm.n_joints, part.stop - arm.n_joints)
        bending = np.abs(link.mode_shapes().shape(stations) @ locked[modal])
        largest = max(largest, float((bending @ amplitudes).max()))
    return largest
