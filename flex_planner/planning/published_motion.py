"""What the points of a published trajectory stand for: the plan, as a controller should get it."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import EffortHold, JointController
from flex_planner.planning.plan import Plan
import numpy as np

# between the last moving point and the holding one: any longer, and the ramp between their
# efforts would leave an impulse behind
_HOLD_DELAY = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PublishedMotion:
    """
    A plan as a reference of a joint controller, without points; as `JointReference` otherwise.

    Attributes
    ----------
    plan : Plan
        With a solution that ends at rest, n joints.
    delay : float
        Of the efforts against the planned torques, negative if they come earlier [s].
    hold_delay : float
        From the end of the motion to the effort that holds the arm [s].

    """

    plan: Plan
    delay: float
    hold_delay: float

    @classmethod
    def of(cls, plan: Plan, controller: JointController, period: float) -> PublishedMotion:
        """
        Return what to publish of a plan.

        Parameters
        ----------
        plan : Plan
            With a solution.
        controller : JointController
            That gets it.
        period : float
            For which it holds an effort, whose mean is to be right; 0 for the planned torque
            itself [s].

        """
        if controller.hold is EffortHold.END:
            # in the period of the arrival, the ramp gives both torques the time that is theirs
            return cls(plan=plan, delay=period / 2, hold_delay=controller.period)
        delay = -period / 2 if controller.hold is EffortHold.START else 0.0
        return cls(plan=plan, delay=delay, hold_delay=_HOLD_DELAY)

    @property
    def duration(self) -> float:
        """Return the duration of the motion [s]."""
        return self.plan.task.duration

    @property
    def kinks(self) -> Array:
        """Return when the slope of an effort jumps [s]."""
        kinks: Array = self.plan.switching_times + self.delay
        return kinks

    def motion(self, times: Array) -> tuple[Array, Array]:
        """Return positions [rad] and velocities [rad/s] at times (m,), shape (m, n)."""
        n, samples = self.plan.arm.n_joints, self.plan.sample(np.minimum(times, self.duration))
        moving = (times < self.duration)[:, None]
        return samples.coordinates[:, :n], np.where(moving, samples.rates[:, :n], 0.0)

    def torque(self, times: Array) -> Array:
        """Return the efforts at times (m,), shape (m, n) [N m]."""
        planned = np.minimum(times, self.duration) - self.delay
        moving = self.plan.sample(np.clip(planned, 0, self.duration)).torques
        share = np.clip((times - self.duration) / self.hold_delay, 0, 1)[:, None]
        efforts: Array = moving + share * (self.plan.problem.holding_torque - moving)
        return efforts
