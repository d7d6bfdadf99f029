"""How much vibration a plan leaves in an arm with more modes, estimated without compiling it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import link_deflections
from flex_planner.base.validation import Array
from flex_planner.dynamics.unbent_arm import bending_stiffness, free_vibrations, mass_matrix
from flex_planner.optimal_control.task import Task
import numpy as np
from numpy.typing import NDArray


def estimate_left_out(task: Task, times: Array, weights: Array, torques: Array) -> float:
    """
    Return the residual vibration that a plan leaves if each link has one mode more [m].

    In space it has one more in each plane in which it bends.

    As `Certificate.residual_vibration` would be for that arm: the largest deflection after the
    joints are locked. A plan brings the modes that it knows to rest. Those that it leaves out are
    excited by its torque all the same, and they change the frequencies of the others: where the
    joints turn freely, as under a torque, clamped shapes need several modes for one that is right,
    so that even the lowest vibration is not where the plan takes it to be.

    Both are estimated: the arm is linearised at the goal with its links straight, without gravity
    and damping, and the torque is applied to that arm with the modes of the plan and with one more
    per link. What counts is the difference of the two ends: that of the plan's own modes is not at
    rest, because the arm turns on its way while a linear one does not. For the 25 random arms of
    `bench.independent` with one or two flexible links the estimate was 0.15 to 8 times what a
    simulation of the arm with another mode found, half of them 0.5 to 3.5 times; and once 39
    times, under gravity. For four motions of an arm in space that yaws and pitches it was 3 to 7
    times that.

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
    counts = weights > 0
    left, forces = task.duration - times[counts], weights[counts, None] * torques[counts]
    n, kept = arm.n_joints, _kept(arm, richer)
    mass = mass_matrix(richer, task.goal_positions, task.payload_mass, task.payload_inertia)
    stiffness = bending_stiffness(richer)
    end = _vibration_after(mass, stiffness, left, forces)
    block = np.ix_(kept, kept)
    end[:, kept] -= _vibration_after(mass[block], stiffness[block], left, forces)
    return _locked_deflection(richer, mass, stiffness[n:, n:], end)


@lru_cache(maxsize=16)
def _with_another_mode(arm: Arm) -> Arm:
    """Return the arm with one mode more in every link that has any, and can have another."""
    return replace(arm, links=tuple(
        link.with_more_modes(1) if link.modes else link for link in arm.links))


def _kept(arm: Arm, richer: Arm) -> NDArray[np.intp]:
    """Return the places of an arm's coordinates among those of the one with more modes."""
    n, names = arm.n_joints, richer.passive_names
    return np.array([*range(n), *(n + names.index(name) for name in arm.passive_names)])


def _vibration_after(mass: Array, stiffness: Array, left: Array, forces: Array) -> Array:
    """
    Return displacements and rates that torques leave in a linear arm, shape (2, n_t).

    ``forces`` (k, n) are torques times the weights of a quadrature, ``left`` (k,) the times that
    are left to the end; only the vibrations count, not how far the joints turn.

    """
    n = forces.shape[1]
    rates, shapes = free_vibrations(mass, stiffness, n)
    waves = np.exp(1j * np.multiply.outer(rates, left))
    driven = (waves * (forces @ shapes[:n]).T).sum(axis=1)
    return np.stack([shapes @ (driven.imag / rates), shapes @ driven.real])


def _locked_deflection(arm: Arm, mass: Array, stiffness: Array, state: Array) -> float:
    """
    Return the largest deflection of a link after the joints are locked, all modes in phase.

    Mass (n_t, n_t) and state (2, n_t) are those of all coordinates, the stiffness (n_f, n_f) that
    of the modal ones, whose momenta the locks leave as they are.

    """
    n = arm.n_joints
    rates, shapes = free_vibrations(mass[n:, n:], stiffness, 0)
    displacement = state[0, n:] @ mass[n:, n:] @ shapes
    rate = state[1] @ mass[:, n:] @ shapes
    amplitude = np.hypot(displacement, rate / rates)
    return max(float((np.abs(link_deflections(arm, i, shapes)) @ amplitude).max())
               for i in range(n))
