"""What a plan leaves behind on arms that differ from its model, under a joint controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flex_planner.base.errors import InvalidTaskError, NoEquilibriumError
from flex_planner.base.progress import Monitor
from flex_planner.control.joint_controller import JointController
from flex_planner.control.linear_feedback import LinearFeedback, pd_feedback
from flex_planner.planning.feedback.carried_motion import CarriedMotion
from flex_planner.planning.feedback.differing_arm import (
    CORNERS,
    Difference,
    DifferingArm,
    list_differences,
    Response,
)
from flex_planner.planning.feedback.find_gains import RESOLUTION
from flex_planner.planning.feedback.gains import Record
from flex_planner.planning.plan import Plan
from flex_planner.planning.uncertainty import ASSUMED, Uncertainty
import numpy as np

# signs of errors of stiffness and payload
_ONE_BY_ONE = (-1, 0), (1, 0), (0, -1), (0, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Residuals(Record):
    """
    What is left of a motion on several arms.

    Attributes
    ----------
    controller : JointController
        That the figures hold for.
    uncertainty : Uncertainty
        That the arms stand for.
    differences : tuple of Difference
        Of the arms: none, errors of stiffness and of the payload one by one and together, two
        more modes per link, and these with the softest and heaviest arm.
    responses : tuple of Response
        Of each of them.

    """

    controller: JointController
    uncertainty: Uncertainty
    differences: tuple[Difference, ...]


def find_residuals(plan: Plan, controller: JointController, *,
                   uncertainty: Uncertainty = ASSUMED, resolution: float = RESOLUTION,
                   law: LinearFeedback | None = None,
                   monitor: Monitor | None = None) -> Residuals:
    """
    Return what a plan leaves behind on arms that differ from its model.

    Each arm carries the whole plan out in simulation, and is watched for a second after the
    arrival, with encoders that round, and motors within their limits.

    Parameters
    ----------
    plan : Plan
        Solved, ending at rest.
    controller : JointController
        Its gains, rate, and how it holds efforts.
    uncertainty : Uncertainty
        Of the arm.
    resolution : float
        Of the encoders [rad].
    law : LinearFeedback, optional
        In place of the PD of the controller's gains.
    monitor : Monitor, optional
        May stop it.

    Raises
    ------
    InvalidTaskError
        If the plan is not solved, or does not end at rest.
    StoppedError
        If the monitor stopped it.

    """
    if not plan.solved or not plan.task.ends_at_rest:
        raise InvalidTaskError('residuals on other arms are those of a plan that is solved and '
                               f'ends at rest: {plan.message}')
    return find_motion_residuals(CarriedMotion.of(plan, controller), uncertainty=uncertainty,
                                 resolution=resolution, law=law, monitor=monitor)


def find_motion_residuals(motion: CarriedMotion, *, uncertainty: Uncertainty = ASSUMED,
                          resolution: float = RESOLUTION, law: LinearFeedback | None = None,
                          monitor: Monitor | None = None) -> Residuals:
    """
    Return what a trajectory leaves behind on arms that differ from its model.

    Parameters
    ----------
    motion : CarriedMotion
        The trajectory under its controller.
    uncertainty, resolution, law, monitor : Uncertainty, float, LinearFeedback, Monitor
        As of `find_residuals`.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    controller = motion.controller
    payload = uncertainty.payload_error(float(motion.execution.parameters.payload_mass))
    differences = list_differences(motion, uncertainty.stiffness, payload,
                                   (*_ONE_BY_ONE, *CORNERS))
    used = law or pd_feedback(controller.gains, controller.rate)
    return Residuals(
        controller=controller, uncertainty=uncertainty, differences=differences,
        responses=tuple(_respond(motion, used, differences, resolution, monitor)))


def _respond(motion: CarriedMotion, law: LinearFeedback, differences: Sequence[Difference],
             resolution: float, monitor: Monitor | None) -> list[Response]:
    """Return what becomes of the motion on every arm; nothing of one that buckles."""
    course, found = motion.course, []
    for difference in differences:
        try:
            arm = DifferingArm.of(motion, course, difference, resolution)
        except NoEquilibriumError:
            found.append(Response(growth=np.inf))
            continue
        found.append(arm.respond(law, monitor, bending=True))
    return found
