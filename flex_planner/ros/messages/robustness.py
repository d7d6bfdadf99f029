"""Errors of the model that a motion must forgive, in requests and reports."""

from __future__ import annotations

from flex_planner.base.errors import InvalidValueError
from flex_planner.control.joint_controller import JointController
from flex_planner.optimal_control.torque_offset import OffsetProblem
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.objective import Robustness
from flex_planner.ros.messages.classes import MotionTask, PlanReport

ROBUSTNESS_REQUEST = ('stiffness_error', 'payload_error', 'max_residual')


def robustness_from_message(message: MotionTask,
                            controller: JointController | None = None) -> Robustness | None:
    """
    Return what a request must forgive under a joint controller, None if it is nothing.

    Raises
    ------
    InvalidValueError
        Naming field, value and bound.

    """
    given = {name: float(getattr(message, name)) for name in ROBUSTNESS_REQUEST}
    if not any(given.values()):
        return None
    if not given['max_residual']:
        raise InvalidValueError('max_residual', 0.0, '> 0 where stiffness_error or payload_error '
                                'is given')
    return Robustness(**given, controller=controller)


def enter_robustness(message: MotionTask, robustness: Robustness | None) -> None:
    """Write what must be forgiven into a request."""
    for name in ROBUSTNESS_REQUEST if robustness else ():
        setattr(message, name, float(getattr(robustness, name)))


def add_robustness(report: PlanReport, plan: Plan) -> None:
    """Write what a plan forgives into its report, and the offset that makes it do so."""
    search = plan.objectives.robust if plan.objectives else None
    if search is not None:
        report.forgiven_residual = search.residual
        report.forgiven_residual_before = float(search.plain_residual)
        report.forgiven_weight = float(search.weight)
    if isinstance(plan.problem, OffsetProblem):
        offset = plan.problem.offset
        report.torque_offset_breaks = offset.breaks.tolist()
        report.torque_offset = offset.coefficients.ravel().tolist()
