"""The gains of feedback that were found for a plan, and what they make of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import Gains
from flex_planner.control.state_feedback import StateFeedback
from flex_planner.planning.execution import UNSTABLE_GROWTH
from flex_planner.planning.feedback.differing_arm import Difference, Response
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """
    What a law made of a plan on every arm that was looked at.

    Attributes
    ----------
    responses : tuple of Response
        One for each of `FeedbackGains.differences`.

    """

    responses: tuple[Response, ...]

    @property
    def stable(self) -> bool:
        """Return whether every arm arrived, and none shakes at the goal."""
        return all(one.growth <= UNSTABLE_GROWTH and np.isfinite(one.residual)
                   for one in self.responses)

    @property
    def residuals(self) -> Array:
        """Return the motion of the tip after the arrival of every arm; NaN if unstable [m]."""
        return np.array([one.residual if one.growth <= UNSTABLE_GROWTH
                         and np.isfinite(one.residual) else np.nan for one in self.responses])

    @property
    def worst(self) -> float:
        """Return the largest of them; infinite if one is unstable [m]."""
        return float(np.nan_to_num(self.residuals, nan=np.inf).max())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeedbackGains:
    """
    Gains for controllers along a plan, as far as they were stable on every arm looked at.

    Attributes
    ----------
    rate : float
        Of the controller [Hz].
    cutoff : float
        Of the filter of the speeds of `joints` and `coupled_joints`, which acts on the error
        [Hz].
    resolution : float
        Of the encoders [rad].
    differences : tuple of Difference
        Of the arms that were looked at.
    joints : Gains or None
        Of a PD, as `joint_trajectory_controller` has it.
    coupled_joints : numpy.ndarray, shape (n, 2 n)
        On all angles and speeds of the joints, 0 rows if none are stable [N m/rad, N m s/rad].
    state : StateFeedback or None
        Of regulator and observer.
    disturbance : StateFeedback or None
        The same, with a torque beside the motors that is estimated and taken away; None also where
        it leaves more than `state` does.
    records : dict of str to Record
        What each of these made of the plan, by name.
    given : Record or None
        What the gains of the controller itself made of it, stable or not.
    message : str
        What was found, or why nothing was and what to try.

    """

    rate: float
    cutoff: float
    resolution: float
    differences: tuple[Difference, ...]
    joints: Gains | None = None
    coupled_joints: Array = field(default_factory=lambda: np.zeros((0, 0)))
    state: StateFeedback | None = None
    disturbance: StateFeedback | None = None
    records: dict[str, Record] = field(default_factory=dict)
    given: Record | None = None
    message: str = ''

    @property
    def found(self) -> bool:
        """Return whether there are any."""
        return bool(self.records)

    @property
    def best(self) -> str:
        """Return the name of those that leave least; empty without any."""
        return min(self.records, key=lambda name: self.records[name].worst, default='')
