"""Natural frequencies of the recorded arm, to tell the peaks of the spectra by."""

from __future__ import annotations

from dataclasses import dataclass
import math

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.validation import Array
from flex_planner.dynamics.statics import equilibrium, natural_modes
from flex_planner.optimal_control.arm_model import ArmModel
from flex_planner.reports.recording.contents import RecordedRequest
import numpy as np

_POSTURES = 41


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NaturalFrequencies:
    """
    The range of each natural frequency over the postures of a motion, with its payload.

    Attributes
    ----------
    free : numpy.ndarray, shape (n_f, 2)
        Lowest and highest of each, joints free as they are under given torques, without damping;
        the swinging of the arm as a whole is left out [Hz].
    locked : numpy.ndarray, shape (n_f, 2)
        The same with the joints held still, as by a stiff controller or a brake [Hz].

    """

    free: Array
    locked: Array

    @classmethod
    def of(cls, request: RecordedRequest) -> NaturalFrequencies | None:
        """Return them; None where nothing moves, bends, twists, or comes to rest."""
        if request.motion is None or not request.arm.n_passive:
            return None
        # read from disk where the arm was planned for, else compiled
        model, n = ArmModel(request.arm), request.arm.n_joints
        count = len(request.motion.coordinates)
        chosen = np.unique(np.linspace(0, count - 1, _POSTURES).round().astype(int))
        found = [both for posture in request.motion.coordinates[chosen, :n]
                 if (both := _at(model, posture, request)) is not None]
        if not found:
            return None
        free, locked = (np.stack(values) / (2 * math.pi) for values in zip(*found, strict=True))
        return cls(free=_range(free), locked=_range(locked))


def _at(model: ArmModel, posture: Array, request: RecordedRequest) -> tuple[Array, Array] | None:
    """Return the angular frequencies, joints free and locked, None without an equilibrium."""
    try:
        rest, _ = equilibrium(model, posture, request.parameters)
    except NoEquilibriumError:
        return None
    free, _ = natural_modes(model, rest, request.parameters, locked=False)
    locked, _ = natural_modes(model, rest, request.parameters, locked=True)
    return free[model.arm.n_joints:], locked


def _range(values: Array) -> Array:
    """Return the lowest and the highest value of each column."""
    return np.stack([values.min(axis=0), values.max(axis=0)], axis=1)
