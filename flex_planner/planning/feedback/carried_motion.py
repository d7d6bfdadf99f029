"""A trajectory that joint controllers carry out, on the arm of its model and on others."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.base.validation import Array
from flex_planner.control.feedback_motion import Course
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import Reference
from flex_planner.planning.execution import Execution
from flex_planner.planning.plan import Plan
from flex_planner.planning.published_motion import PublishedMotion
import numpy as np

# how long the tip is watched after the arrival [s]
WATCHED = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CarriedMotion:
    """
    A motion to rest, as a controller gets it: of a plan, or from a recording.

    Attributes
    ----------
    execution : Execution
        By the arm of the model, of n joints, under the controller.
    reference : Reference
        The trajectory.
    goal : numpy.ndarray, shape (n,)
        Joint angles [rad].
    holding_torque : numpy.ndarray, shape (n,)
        Effort at the end, which holds the arm of the model [N m].

    """

    execution: Execution
    reference: Reference
    goal: Array
    holding_torque: Array

    @classmethod
    def of(cls, plan: Plan, controller: JointController) -> CarriedMotion:
        """Return that of a plan that is solved and ends at rest, without points."""
        return cls(execution=Execution.of(plan, controller),
                   reference=PublishedMotion.of(plan, controller, controller.period),
                   goal=plan.problem.goal[:plan.arm.n_joints],
                   holding_torque=plan.problem.holding_torque)

    @property
    def arm(self) -> Arm:
        """Return the arm of the model."""
        return self.execution.dynamics.arm

    @property
    def controller(self) -> JointController:
        """Return the controller."""
        return self.execution.controller

    @property
    def course(self) -> Course:
        """Return what a law follows, also for `watched_periods` after the arrival."""
        controller = self.controller
        until = self.execution.duration + watched_periods(controller) * controller.period
        return Course.of(self.reference, controller.hold, controller.rate, until)


def watched_periods(controller: JointController) -> int:
    """Return for how many periods the tip is watched after the arrival."""
    return int(np.ceil(WATCHED * controller.rate - 1e-6))
