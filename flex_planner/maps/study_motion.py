"""The motion of a study: its ends, and what every task has where no axis changes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.maps.end_points import End
from flex_planner.maps.study_limits import read_limits
from flex_planner.optimal_control.task import Task
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyMotion:
    """
    The motion that is planned at every cell of a map, but for what axes change.

    Parameters
    ----------
    start, goal : End
        NaN in a point where an axis gives it.
    duration, payload_mass, effort_weights, velocity_weights, tolerance
        As of `Task`, where no axis gives them. The duration is a first guess for MIN_DURATION.
    elbow : int
        Of every posture, see `posture_near_point`.
    limits : tuple of str
        On the way, besides those of the arm; see `read_limits`.

    """

    start: End
    goal: End
    duration: float = 1.0
    payload_mass: float = 0.0
    effort_weights: Array = field(default_factory=lambda: np.zeros(0))
    velocity_weights: Array = field(default_factory=lambda: np.zeros(0))
    tolerance: float = 1e-3
    elbow: int = -1
    limits: tuple[str, ...] = ()

    @property
    def ends(self) -> tuple[End, End]:
        """Return start and goal."""
        return self.start, self.goal

    def payload(self, values: Mapping[str, float]) -> float:
        """Return the planned payload for values of the axes [kg]."""
        return values.get('payload_mass', self.payload_mass)

    def task(self, arm: Arm, values: Mapping[str, float], start: Array, goal: Array) -> Task:
        """Return the task between two ends, whose postures are (n,), for values of the axes."""
        weight = values.get('velocity_weight')
        points: dict[str, Any] = {f'{end.name}_point': end.at(values)
                                  for end in self.ends if not end.angles.size}
        return Task(
            arm=arm, start_positions=start, goal_positions=goal, **points,
            duration=values.get('duration', self.duration), payload_mass=self.payload(values),
            effort_weights=self.effort_weights, tolerance=self.tolerance,
            path_constraints=read_limits(self.limits, values, arm),
            velocity_weights=(self.velocity_weights if weight is None
                              else np.full(arm.n_joints, weight)))
