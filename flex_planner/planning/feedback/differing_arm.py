"""An arm that may differ from its model carries out a plan under a linear law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from flex_planner.arms.kinematics import tip_jacobian, tip_position
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.extent import peak_to_peak
from flex_planner.control.feedback_motion import Course, FeedbackArm, FeedbackMotion
from flex_planner.control.linear_feedback import LinearFeedback
from flex_planner.control.state_feedback import LinearArm
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.physical_parameters import PhysicalParameters
from flex_planner.planning.execution import Execution
from flex_planner.planning.feedback.carried_motion import CarriedMotion, watched_periods
from flex_planner.planning.robust.differing_arms import (
    differing_parameters,
    has_all_modes,
    other_execution,
    with_more_modes,
)
import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """
    A difference of an arm from its model.

    Attributes
    ----------
    stiffness, payload : float
        Errors of E I, and of mass and inertia of the payload, as shares of them.
    more_modes : bool
        Whether every flexible link has two more modes.

    """

    stiffness: float = 0.0
    payload: float = 0.0
    more_modes: bool = False

    def __str__(self) -> str:
        """Return it in words."""
        parts = [f'{name} {100 * share:+.2g}%' for name, share in (
            ('stiffness', self.stiffness), ('payload', self.payload)) if share]
        parts += ['two more modes'] if self.more_modes else []
        return ', '.join(parts) or 'as modelled'


CORNERS = (1, -1), (1, 1), (-1, -1), (-1, 1)
"""Signs of errors of stiffness and payload at the corners of their box, the worst last."""


def list_differences(motion: CarriedMotion, stiffness: float, payload: float,
                     signs: Sequence[tuple[int, int]] = CORNERS) -> tuple[Difference, ...]:
    """
    Return none, errors with some signs, and two more modes alone and with the last errors.

    What the arm or the task lacks is left out.

    """
    given = motion.execution.parameters
    stiffness = stiffness if motion.arm.n_modes else 0.0
    payload = payload if given.payload_mass or given.payload_inertia else 0.0
    found = [Difference(), *(Difference(stiffness=a * stiffness, payload=b * payload)
                             for a, b in signs)]
    if motion.arm.n_modes and not has_all_modes(motion.arm):
        found += [Difference(more_modes=True), replace(found[-1], more_modes=True)]
    return tuple(dict.fromkeys(found))


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """
    What became of a plan.

    Attributes
    ----------
    growth : float
        How fast deviations from the goal grow there, below 0 where they die away [1/s].
    residual : float
        Peak-to-peak motion of the tip in the second after the arrival; infinite if the arm has
        run away [m].
    tip_error : float
        Of the tip on arrival; infinite if the arm has run away [m].
    peak_torque : float
        Largest share of the torque at standstill that a motor gave.
    bending : float
        Largest bending if the joints were locked on arrival; NaN where nobody asked for it [m].

    """

    growth: float
    residual: float = np.inf
    tip_error: float = np.inf
    peak_torque: float = np.inf
    bending: float = np.nan


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DifferingArm:
    """
    An arm, a plan for its model, and the arm about the goal.

    Attributes
    ----------
    execution : Execution
        Of the plan by the arm.
    course : Course
        Of the plan, and of the time after it in which the tip is watched.
    linear : LinearArm
        About the goal, without dry friction.
    unbalanced : numpy.ndarray, shape (n,)
        By how much the effort at the goal is more than what holds this arm there [N m].
    resolution : float
        Of the encoders [rad].

    """

    execution: Execution
    course: Course
    linear: LinearArm
    unbalanced: Array
    resolution: float

    @classmethod
    def of(cls, motion: CarriedMotion, course: Course, difference: Difference,
           resolution: float) -> DifferingArm:
        """
        Return the arm of a difference, and the course of the motion that it is to follow.

        Raises
        ------
        NoEquilibriumError
            If it buckles at the start or at the goal.

        """
        nominal = motion.execution
        parameters = differing_parameters(nominal.parameters, difference.stiffness,
                                          difference.payload)
        dynamics = (ArmDynamics.of(with_more_modes(motion.arm)) if difference.more_modes
                    else nominal.dynamics)
        execution = other_execution(nominal, dynamics, parameters)
        linear = LinearArm.of(dynamics, motion.goal, without_friction(parameters),
                              nominal.controller.rate)
        return cls(execution=execution, linear=linear, resolution=resolution, course=course,
                   unbalanced=motion.holding_torque - linear.torque)

    def growth(self, law: LinearFeedback) -> float:
        """Return how fast deviations grow at the goal under a law [1/s]."""
        values = np.linalg.eigvals(law.closed_loop(self.linear.free, self.linear.forced))
        return float(np.log(np.abs(values).max()) / law.period)

    def respond(self, law: LinearFeedback, monitor: Monitor | None = None, *,
                bending: bool = False, growth: float | None = None) -> Response:
        """
        Return what becomes of the plan under a law, and in the second after it, by simulation.

        Its growth is found unless it is known.

        Raises
        ------
        StoppedError
            If the monitor stopped it.

        """
        growth = self.growth(law) if growth is None else growth
        execution, arm = self.execution, self._under(law)
        motion = arm.follow(self.course, execution.start, monitor)
        if not np.isfinite(motion.states).all():
            return Response(growth=growth)
        after = motion.states[self._arrival:]
        tips = tip_position(arm.dynamics.arm, after[:, :arm.dynamics.arm.n_coordinates])
        return Response(growth=growth, residual=peak_to_peak(tips),
                        tip_error=execution.tip_error(after[0]),
                        peak_torque=float((np.abs(motion.torques) / arm.limits.standstill).max()),
                        bending=execution.vibration(after[0]) if bending else np.nan)

    def predict_residual(self, law: LinearFeedback, monitor: Monitor | None = None) -> float:
        """Return `Response.residual` as linear equations about the goal have it, in less time."""
        course = Course(angles=self.course.angles[:self._arrival],
                        efforts=self.course.efforts[:self._arrival])
        motion = self._under(law).follow(course, self.execution.start, monitor)
        if not np.isfinite(motion.states).all():
            return np.inf
        return float(np.nan_to_num(peak_to_peak(self._ring(motion, law)), nan=np.inf))

    @property
    def _arrival(self) -> int:
        """Return the number of the first update at or after the arrival."""
        return len(self.course.angles) - watched_periods(self.execution.controller)

    def _under(self, law: LinearFeedback) -> FeedbackArm:
        """Return the arm under a law."""
        return FeedbackArm(dynamics=self.execution.dynamics, law=law,
                           parameters=self.execution.parameters, resolution=self.resolution)

    def _ring(self, motion: FeedbackMotion, law: LinearFeedback) -> Array:
        """Return the path of the tip after a motion, shape (k, 2) [m]."""
        arm, n_t = self.execution.dynamics.arm, self.execution.dynamics.arm.n_coordinates
        away = motion.states[-1] - self.linear.rest
        state = np.concatenate([away, motion.laws[-1], [1.0]])
        step = np.eye(state.size)
        step[:-1, :-1] = law.closed_loop(self.linear.free, self.linear.forced)
        step[:away.size, -1] = self.linear.forced @ self.unbalanced
        jacobian = tip_jacobian(arm, self.linear.rest[:n_t])
        rows = np.hstack([jacobian, np.zeros((len(jacobian), state.size - n_t))])[:, None]
        with np.errstate(over='ignore', invalid='ignore'):
            count = watched_periods(self.execution.controller) + 1
            while rows.shape[1] < count:  # twice as many instants each time
                rows = np.concatenate([rows, rows @ step], axis=1)
                step = step @ step
            tips: Array = (rows[:, :count] @ state).T
        return tips


def without_friction(parameters: PhysicalParameters) -> PhysicalParameters:
    """Return parameters without dry friction, whose slope at rest is none of the moving arm."""
    return replace(parameters, coulomb_friction=np.zeros_like(parameters.coulomb_friction))
