"""Motions of presets that show what is planned: of the demonstration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import InvalidValueError
from flex_planner.base.suggestions import did_you_mean
from flex_planner.base.validation import Array
from flex_planner.optimal_control.ends_at_points import ends_at_points
import numpy as np

DEFAULT_ARM = 'korayem_ei50'


@dataclass(frozen=True, slots=True, kw_only=True)
class DemoMotion:
    """
    A motion to a point.

    Attributes
    ----------
    start_point : tuple of float
        Where the tip begins; empty where joint positions are given [m].
    start_positions : tuple of float
        Of the joints [rad].
    goal : tuple of float
        Where the tip comes to rest [m].
    duration, payload : float
        [s], [kg].
    effort_weights : tuple of float
        Diagonal of R; empty for ones.

    """

    start_point: tuple[float, ...] = ()
    start_positions: tuple[float, ...] = ()
    goal: tuple[float, ...]
    duration: float
    payload: float
    effort_weights: tuple[float, ...] = ()

    ELBOW = -1

    def initial_positions(self, arm: Arm) -> Array:
        """Return the joint positions at the start, shape (n,) [rad]."""
        if self.start_positions:
            return np.array(self.start_positions)
        fields: dict[str, Any] = ends_at_points(arm, self.start_point, None, self.ELBOW)
        positions: Array = fields['start_positions']
        return positions

    def __str__(self) -> str:
        start = (f'{self.start_point} m' if self.start_point
                 else f'{tuple(np.degrees(self.start_positions).round(1).tolist())} deg')
        return (f'{start} to {self.goal} m in {self.duration:g} s with {self.payload:g} kg')


# of the paper, section 5.2; those in space were made up
_MOTIONS = {
    DEFAULT_ARM: DemoMotion(start_point=(0.5, 0.0), goal=(0.5, 0.5), duration=1.0, payload=1.0,
                            effort_weights=(1 / 8, 1 / 8)),
    'spatial_3r': DemoMotion(start_positions=(0.0, -0.35, 0.87), goal=(0.5, 1.0, 0.9),
                             duration=1.5, payload=0.5),
    'tudor_like': DemoMotion(start_positions=(0.0, 0.0, 0.5), goal=(0.52, 0.53, -0.05),
                             duration=1.0, payload=0.1)}


def demo_motion(arm: str) -> DemoMotion:
    """
    Return the motion of a preset.

    Raises
    ------
    InvalidValueError
        If there is none.

    """
    if arm not in _MOTIONS:
        raise InvalidValueError('--arm', arm, f'one of {", ".join(_MOTIONS)}, which have a motion '
                                'to show (flex-planner plan takes any arm)'
                                f'{did_you_mean(arm, _MOTIONS)}')
    return _MOTIONS[arm]
