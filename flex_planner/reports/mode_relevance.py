"""Which natural modes of an arm a motion of a certain duration will bend."""

from __future__ import annotations

from flex_planner.arms.kinematics import link_deflections, tip_jacobian
from flex_planner.base.validation import Array
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.dynamics.statics import equilibrium, natural_modes
import numpy as np

DURATIONS = (0.5, 1.0, 2.0, 5.0, 10.0)
# peak acceleration of the motion of least effort of one joint, times duration squared, per radian
_PEAK = 6.0
# share of the reach below which bending matters to nobody
_NEGLIGIBLE = 1e-4
# [m], the least that is shown
_SHOWN = 1e-5


def find_bending(dynamics: ArmDynamics, posture: Array,
                 parameters: PhysicalParameters) -> tuple[Array, Array]:
    """
    Return how far each natural mode moves the tip when all joints turn by one radian.

    The joints accelerate at most as in the motion of least effort, and each mode gives way as a
    spring does, but no further than a mode that stays behind altogether. An estimate: a motion
    with jumps of its torque rings by as much again.

    Parameters
    ----------
    dynamics : ArmDynamics
        n joints, n_f coordinates without a motor.
    posture : numpy.ndarray, shape (n,)
        Joint angles [rad].
    parameters : PhysicalParameters
        Payload and stiffness.

    Returns
    -------
    frequencies : numpy.ndarray, shape (n_f,)
        Joints locked [rad/s].
    bending : numpy.ndarray, shape (n_f, durations)
        Of the tip or, where that is more, of a link, for each of `DURATIONS` [m].

    Raises
    ------
    NoEquilibriumError, InvalidTaskError
        See `equilibrium` and `natural_modes`.

    """
    arm = dynamics.arm
    n = arm.n_joints
    rest, _ = equilibrium(dynamics, posture, parameters)
    frequencies, vectors = natural_modes(dynamics, rest, parameters, locked=True)
    x = np.concatenate([rest, np.zeros_like(rest)])[None]
    mass = dynamics.mass_and_energy(x, parameters.physical)[0][0]
    # each joint drives by its own sign: the worst of them
    behind = np.abs(vectors.T @ mass[n:, :n]).sum(axis=1)
    # what has no frequency of its own, or is unstable, stays behind
    turns = np.outer(np.nan_to_num(frequencies), DURATIONS)
    shares = _PEAK / np.maximum(turns**2, _PEAK)
    moved = np.max([np.linalg.norm(tip_jacobian(arm, rest)[:, n:] @ vectors, axis=0),
                    *(np.abs(link_deflections(arm, i, vectors)).max(axis=0) for i in range(n))],
                   axis=0)
    return frequencies, (behind * moved)[:, None] * shares


def _millimetres(value: float) -> str:
    """Return a length in words."""
    return f'{value * 1e3:.2f} mm' if value >= _SHOWN else '-'


def describe_relevance(dynamics: ArmDynamics, posture: Array,
                       parameters: PhysicalParameters) -> list[str]:
    """Return the bending of each mode for durations, and which modes nobody would miss."""
    frequencies, bending = find_bending(dynamics, posture, parameters)
    heads = ''.join(f'{f"{duration:g} s":>12}' for duration in DURATIONS)
    lines = ['bending by each mode with joints held, when all joints turn by 1 rad in',
             f'  {"":>12}{heads}']
    for frequency, row in zip(frequencies, bending, strict=True):
        cells = ''.join(f'{_millimetres(value):>12}' for value in row)
        lines.append(f'  {frequency / (2 * np.pi):>9.4g} Hz{cells}')
    needed = (bending >= _NEGLIGIBLE * dynamics.arm.reach).sum(axis=0)
    text = ', '.join(f'{count} in {duration:g} s'
                     for count, duration in zip(needed, DURATIONS, strict=True))
    lines.append(f'modes that bend by more than {_NEGLIGIBLE:.2%} of the reach: {text}')
    return lines
