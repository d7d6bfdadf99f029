"""A plan in the hands of arms that differ from its model."""

from __future__ import annotations

from flex_planner.base.errors import NoEquilibriumError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.default_gains import default_gains
from flex_planner.control.held_periods import HeldPeriods
from flex_planner.control.joint_controller import JointController
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.planning.execution import Execution
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.arrivals import Arrival, Ringing, tabulate_reference
from flex_planner.planning.robust.differing_arms import (
    differing_parameters,
    other_execution,
    rest_at_start,
    weighed_errors,
)
from flex_planner.planning.robust.objective import Robustness
import numpy as np

Errors = tuple[float, float]


class DifferingArms:
    """
    The arms that may carry out the plans of a task; what is found out about one is kept.

    Parameters
    ----------
    plan : Plan
        Any plan of the task.
    robustness : Robustness
        With the box of errors and the controller.
    dynamics : ArmDynamics, optional
        Of arms with other modes.

    Attributes
    ----------
    controller : JointController
        Of all of them.
    nominal : Execution
        By the arm of the model.
    weighed, looked_at : numpy.ndarray, shape (k, 2)
        Errors of stiffness and payload of those that are weighed, and of those that the result is
        judged by.

    """

    def __init__(self, plan: Plan, robustness: Robustness,
                 dynamics: ArmDynamics | None = None) -> None:
        self.controller = robustness.controller or JointController(
            gains=default_gains(plan.model))
        self.nominal = Execution.of(plan, self.controller)
        self._dynamics = dynamics or self.nominal.dynamics
        self._rest = rest_at_start(self.nominal)
        self._goal = plan.problem.goal[:plan.arm.n_joints]
        self._hold = plan.problem.holding_torque
        self.weighed = weighed_errors(robustness, self.nominal)
        self.looked_at = weighed_errors(robustness, self.nominal, finely=True)
        self._arms = dict[Errors, tuple[Execution, Ringing] | None]()

    def arm(self, errors: Errors) -> tuple[Execution, Ringing] | None:
        """Return an arm and how it rings at the goal; None if it buckles."""
        if errors not in self._arms:
            parameters = differing_parameters(self.nominal.parameters, *errors)
            try:
                execution = other_execution(self.nominal, self._dynamics, parameters,
                                            self._rest)
                self._arms[errors] = execution, Ringing.of(execution, self._goal, self._hold)
            except NoEquilibriumError:
                self._arms[errors] = None
        return self._arms[errors]


class CarriedOut:
    """
    A plan that arms carry out; arrivals and residuals are kept.

    Parameters
    ----------
    plan : Plan
        With a solution.
    arms : DifferingArms
        Of its task.
    monitor : Monitor
        May stop it.

    """

    def __init__(self, plan: Plan, arms: DifferingArms, monitor: Monitor) -> None:
        self._arms, self._monitor = arms, monitor
        self._trajectory = HeldPeriods(tabulate_reference(plan, arms.controller),
                                       arms.controller, arms.nominal.duration)
        self._arrivals = dict[Errors, Arrival | None]()
        self._residuals = dict[Errors, float]()

    def arrival(self, errors: Errors) -> Arrival | None:
        """Return how the arm with these errors arrives; None if it buckles."""
        if errors not in self._arrivals:
            self._monitor.check()
            arm = self._arms.arm(errors)
            self._arrivals[errors] = None if arm is None else Arrival.of(
                *arm, self._trajectory, self._monitor)
        return self._arrivals[errors]

    def residual(self, errors: Errors) -> float:
        """Return the residual of that arm; infinite if it buckles or runs away [m]."""
        if errors not in self._residuals:
            arrival = self.arrival(errors)
            self._residuals[errors] = np.inf if arrival is None else arrival.residual
        return self._residuals[errors]

    def residuals(self, errors: Array) -> Array:
        """Return those of arms with errors (k, 2), shape (k,) [m]."""
        return np.array([self.residual(one) for one in as_keys(errors)])


def as_keys(errors: Array) -> list[Errors]:
    """Return errors (k, 2) as what arms are kept by."""
    return [(float(stiffness), float(payload)) for stiffness, payload in errors]
