"""What the points of a published trajectory stand for: the plan, as a controller should get it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import EffortHold, JointController
from flex_planner.dynamics.statics import equilibrium
from flex_planner.planning.plan import Plan, Samples
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
    begin : float
        Of the motion, up to which the arm is held where it starts [s].
    ramp : tuple of float
        From the begin of the motion to the first and the last moment of the way from the effort
        that holds the arm to those of the motion, if it is held [s].
    start_torque : numpy.ndarray, shape (n,)
        That holds the arm then; empty if it is not held [N m].

    """

    plan: Plan
    delay: float
    hold_delay: float
    begin: float = 0.0
    ramp: tuple[float, float] = (0.0, 0.0)
    start_torque: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, plan: Plan, controller: JointController, period: float,
           begin: float = 0.0) -> PublishedMotion:
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
        begin : float
            How long to hold the arm before the motion [s].

        """
        delay = {EffortHold.END: period / 2, EffortHold.START: -period / 2}.get(controller.hold)
        # with END, in the period of the arrival, the ramp gives both torques the time that is
        # theirs
        motion = cls(plan=plan, delay=delay or 0.0, hold_delay=(
            controller.period if controller.hold is EffortHold.END else _HOLD_DELAY))
        if not begin:
            return motion
        start, physical = plan.problem.start[:plan.arm.n_joints], plan.problem.parameters
        return replace(motion, begin=begin, ramp=start_ramp(controller),
                       start_torque=equilibrium(plan.model, start, physical)[1])

    @property
    def end(self) -> float:
        """Return when the motion ends [s]."""
        return self.begin + self.plan.task.duration

    @property
    def kinks(self) -> Array:
        """Return when the slope of an effort jumps [s]."""
        bends = np.concatenate([self.plan.switching_times, self.plan.via_times])
        kinks: Array = np.sort(self.begin + bends + self.delay)
        return kinks

    @property
    def marks(self) -> Array:
        """Return the times of which each is to have a point: those of via points [s]."""
        marks: Array = self.begin + self.plan.via_times
        return marks

    def motion(self, times: Array) -> tuple[Array, Array]:
        """Return positions [rad] and velocities [rad/s] at times (m,), shape (m, n)."""
        return self.joints_of(self.samples(times), times)

    def joints_of(self, samples: Samples, times: Array) -> tuple[Array, Array]:
        """Return positions and velocities as `motion`, of samples at these times."""
        n = self.plan.arm.n_joints
        moving = (times < self.end) & ((times > self.begin) | (self.begin == 0))
        return samples.coordinates[:, :n], np.where(moving[:, None], samples.rates[:, :n], 0.0)

    def samples(self, times: Array) -> Samples:
        """Return the samples of the plan at times of the trajectory (m,)."""
        return self.plan.sample(self._on_plan(times))

    def torque(self, times: Array) -> Array:
        """Return the efforts at times (m,), shape (m, n) [N m]."""
        moving = self.plan.torques(self._on_plan(np.minimum(times, self.end) - self.delay))
        share = np.clip((times - self.end) / self.hold_delay, 0, 1)[:, None]
        efforts: Array = moving + share * (self.plan.problem.holding_torque - moving)
        if self.begin:
            first, last = self.ramp
            share = np.clip((times - self.begin - first) / (last - first), 0, 1)[:, None]
            efforts = (1 - share) * self.start_torque + share * efforts
        return efforts

    def _on_plan(self, times: Array) -> Array:
        """Return times of the trajectory on the clock of the plan, within its motion."""
        return np.clip(times - self.begin, 0, self.plan.task.duration)


def start_ramp(controller: JointController) -> tuple[float, float]:
    """
    Return when efforts leave the one that holds the arm, and when they are those of the motion.

    The effort that a controller holds over the period in which the motion begins is then the mean
    of both, each for its time, wherever in that period it begins [s].

    """
    delay = controller.hold.delay
    return (delay - 1) * controller.period, delay * controller.period
