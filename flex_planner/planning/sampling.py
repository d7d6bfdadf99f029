"""
A plan as samples that a joint controller follows, and what the controller makes of them.

A controller interpolates the effort linearly between samples and holds the last sample for
ever, so the samples are as close as the torque demands, one lies where a motor reaches or leaves
its limit, and the last effort is the one that holds the arm still. They are closer still where
the arm would otherwise arrive elsewhere than under the planned torque itself.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.base.errors import InvalidTaskError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array, number
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.optimal_control.constrained_motion import way_slacks_of
from flex_planner.planning.certificate import CertificateLimits
from flex_planner.planning.execution import (
    certify_execution,
    Execution,
    ExecutionCertificate,
    ExecutionLimits,
    RobustnessReport,
)
from flex_planner.planning.plan import Plan, PlanStatus, Samples
from flex_planner.planning.point_times import MAX_SAMPLES, point_times, SMALLEST_STEP
from flex_planner.planning.published_motion import PublishedMotion
import numpy as np
from numpy.typing import NDArray

MAX_PERIOD = 0.1
# [s]; the least in periods of the controller, so that the points of the hold keep their order
MAX_START_HOLD, _FEWEST_PERIODS = 60.0, 4
# smaller tolerances of the efforts, each by the factor, where the arm arrives elsewhere
_REFINEMENTS, _FACTOR = 6, 0.25
# along the motion, at which the stability of the PD is looked at
_POSTURES = 5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledPlan:
    """
    A sampled plan.

    Attributes
    ----------
    times_ns : numpy.ndarray of int64, shape (k,)
        From 0, or half the `start_hold`, strictly increasing [ns].
    samples : Samples
        At these times; at rest, with the holding torque, in the last, and in the first one or
        two if there is a `start_hold`.
    efforts : numpy.ndarray, shape (k, n)
        For the controller: the torques of half a `controller_period` before or after [N m].
    torque_error : float
        Largest difference between the efforts and their linear interpolation, found at eight
        times as many points [N m].
    controller_period : float
        For which efforts are shifted by a half; 0 if they are not [s].
    execution : ExecutionCertificate
        What the controller makes of times, joints and efforts.
    robustness : RobustnessReport or None
        What it makes of them on other arms; None unless `assess_robustness` has found out.
    start_hold : float
        How long the arm is held before the motion [s].

    """

    times_ns: NDArray[np.int64]
    samples: Samples
    efforts: Array
    torque_error: float
    controller_period: float
    execution: ExecutionCertificate
    robustness: RobustnessReport | None = None
    start_hold: float = 0.0

    @property
    def reference(self) -> JointReference:
        """Return the trajectory that a controller gets, led into from rest at its start."""
        samples, n = self.samples, self.efforts.shape[1]
        reference = JointReference(
            times=np.multiply(self.times_ns, 1e-9, dtype=np.float64),
            positions=samples.coordinates[:, :n], velocities=samples.rates[:, :n],
            accelerations=samples.accelerations[:, :n], torques=self.efforts)
        return reference.after(samples.coordinates[0, :n], samples.rates[0, :n], self.efforts[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplingSettings:
    """
    How densely a plan is sampled, and for which controller.

    Parameters
    ----------
    longest_step : float
        0.00025 to 1 [s].
    torque_tolerance : float
        Steps are halved until linear interpolation is this exact, they would fall below 0.25 ms,
        or the samples would be more than 20000: all steps while more than a tenth of them are
        too long, then those alone; > 0 [N m]. It is lowered where the arm would arrive more than
        0.01 mm away from where the planned torque leads it, under the same controller, or with
        0.1 mm more vibration.
    controller : JointController or None
        That carries the trajectory out; None for 1 kHz and `default_gains`.
    controller_period : float or None
        Efforts are those of half this time before (`EffortHold.END`) or after (`START`) the
        sample, so that their mean is right while a controller of this period holds them, 0 to
        0.1; 0 for the torques at the time of the sample, None for the period of the controller
        [s].
    start_hold : float
        How long to hold the arm before a motion that starts at rest, at least four periods of the
        controller and at most 60; 0 for not at all [s]. The first point is half that time after
        the start of the trajectory: a controller leads the arm there from where it sags to.

    Raises
    ------
    InvalidValueError
        If a value breaks its bound.

    """

    longest_step: float = 0.01
    torque_tolerance: float = 0.02
    controller: JointController | None = None
    controller_period: float | None = None
    start_hold: float = 0.0

    def __post_init__(self) -> None:
        number('longest_step', self.longest_step, at_least=SMALLEST_STEP, at_most=1, unit='s')
        number('torque_tolerance', self.torque_tolerance, at_least=1e-9, at_most=1e9,
               unit='N m')
        if self.controller_period is not None:
            number('controller_period', self.controller_period, at_least=0, at_most=MAX_PERIOD,
                   unit='s')
        period = 1e-3 if self.controller is None else self.controller.period
        if self.start_hold:
            number('start_hold', self.start_hold, at_least=_FEWEST_PERIODS * period,
                   at_most=MAX_START_HOLD, unit='s')

    def controller_of(self, plan: Plan) -> JointController:
        """Return the controller that a plan is for."""
        return self.controller or JointController(gains=default_gains(plan.model))

    def motion_of(self, plan: Plan, begin: float = 0.0) -> PublishedMotion:
        """Return what is published of a plan, which begins after a time [s]."""
        controller, period = self.controller_of(plan), self.controller_period
        return PublishedMotion.of(plan, controller,
                                  controller.period if period is None else period, begin)

    def begin_of(self, plan: Plan) -> float:
        """Return how long to hold the arm of a plan: not if it moves at the start [s]."""
        return self.start_hold if plan.task.starts_at_rest else 0.0


def sample_plan(plan: Plan, settings: SamplingSettings,
                monitor: Monitor | None = None) -> SampledPlan:
    """
    Return samples of a solved plan, and one more that holds the arm.

    Parameters
    ----------
    plan : Plan
        With a solution.
    settings : SamplingSettings
        Of the samples and the controller.
    monitor : Monitor, optional
        May stop it.

    Returns
    -------
    SampledPlan
        Check its `execution` against `ExecutionLimits` before an arm gets it.

    Raises
    ------
    InvalidTaskError
        If even the longest step makes more than 20000 samples, or the motion does not end at
        rest: a controller holds the last sample for ever.
    StoppedError
        If the monitor stopped it.
    ValueError
        If the plan has no solution.

    """
    watch, duration = monitor or Monitor(), plan.task.duration
    if not plan.task.ends_at_rest:
        raise InvalidTaskError('the motion does not end at rest at its goal, where a controller '
                               'would hold the arm')
    count = int(np.ceil(duration / settings.longest_step))
    if count > MAX_SAMPLES:
        raise InvalidTaskError(
            f'a motion of {duration:g} s sampled every {settings.longest_step:g} s has {count} '
            f'samples, but may have {MAX_SAMPLES}; the parameter sampling_step must be >= '
            f'{duration / MAX_SAMPLES:g} s')
    execution = Execution.of(plan, settings.controller_of(plan), settings.begin_of(plan))
    sampled = _close_enough(plan, settings, execution, watch)
    postures = plan.uniform_samples(_POSTURES).coordinates[:, :plan.arm.n_joints]
    certificate = certify_execution(execution, sampled.reference, postures, watch,
                                    slacks=way_slacks_of(plan.problem))
    return replace(sampled, execution=certificate)


def judge_execution(plan: Plan, sampled: SampledPlan,
                    limits: ExecutionLimits | None = None) -> Plan:
    """
    Return the plan, whose certificate fails if its samples miss the limits of an execution.

    Parameters
    ----------
    plan : Plan
        Solved, or else left as it is.
    sampled : SampledPlan
        Its samples.
    limits : ExecutionLimits, optional
        What must be kept.

    """
    broken = (limits or ExecutionLimits()).violations(
        sampled.execution, plan.arm.reach, plan.arm)
    if not plan.solved or not broken:
        return plan
    return replace(plan, status=PlanStatus.CERTIFICATE_FAILED,
                   message=f'the trajectory cannot be carried out: {"; ".join(broken)}')


def _close_enough(plan: Plan, settings: SamplingSettings, execution: Execution,
                  watch: Monitor) -> SampledPlan:
    """Return samples with which the arm arrives as with infinitely many of them."""
    limits = CertificateLimits()
    motion = settings.motion_of(plan, settings.begin_of(plan))
    exact = execution.arrive(motion, watch)
    vibration = execution.vibration(exact)
    for refinement in range(_REFINEMENTS + 1):
        tolerance = settings.torque_tolerance * _FACTOR**refinement
        sampled = take_samples(motion, execution.controller, *point_times(
            motion, settings.longest_step, tolerance, watch))
        arrived = replace(execution, goal=execution.tip(exact))
        state = arrived.arrive(sampled.reference, watch)
        more = abs(arrived.vibration(state) - vibration)
        if not np.isfinite(vibration) or (arrived.tip_error(state) <= limits.tip_error
                                          and more <= limits.residual_vibration):
            break
    return sampled


def take_samples(motion: PublishedMotion, controller: JointController, times: Array,
                 error: float) -> SampledPlan:
    """
    Return samples of a motion that nobody has looked at yet.

    Parameters
    ----------
    motion : PublishedMotion
        Of n joints.
    controller : JointController
        That gets them.
    times : numpy.ndarray, shape (k,)
        From 0 to the end of the motion [s].
    error : float
        Of linear interpolation of the efforts between them [N m].

    """
    plan, times_ns = motion.plan, np.round(times * 1e9).astype(np.int64)
    inside = np.minimum(times_ns * 1e-9, motion.end)
    hold_ns = round(motion.hold_delay * 1e9)
    samples = replace(motion.samples(inside), times=inside)
    samples = _with_hold(plan, _at_rest_at_the_ends(plan, samples), hold_ns)
    sampled = SampledPlan(
        times_ns=np.append(times_ns, times_ns[-1] + hold_ns), samples=samples,
        efforts=np.vstack([motion.torque(inside), plan.problem.holding_torque]),
        torque_error=error, controller_period=2 * abs(motion.delay),
        execution=ExecutionCertificate(controller=controller), start_hold=motion.begin)
    return _with_start_hold(motion, sampled) if motion.begin else sampled


def _with_start_hold(motion: PublishedMotion, sampled: SampledPlan) -> SampledPlan:
    """Return samples that begin with those that hold the arm, instead of with a motion."""
    last_ns = round((motion.begin + motion.ramp[0]) * 1e9)
    holding_ns = np.array([round(motion.begin / 2 * 1e9), last_ns])
    # where the efforts leave the holding one as the motion begins, its first sample still holds
    since = 1 if last_ns == sampled.times_ns[0] else 0
    times_ns = np.append(holding_ns, sampled.times_ns[since:])

    def held(values: Array) -> Array:
        return np.concatenate([values[:1], values[:1], values[since:]])

    fields = {name: held(getattr(sampled.samples, name)) for name in Samples.__slots__}
    fields['times'] = times_ns * 1e-9
    fields['accelerations'][:2] = 0
    fields['torques'][:2] = motion.start_torque
    efforts = held(sampled.efforts)
    efforts[:2] = motion.start_torque
    return replace(sampled, times_ns=times_ns, samples=Samples(**fields), efforts=efforts)


def _at_rest_at_the_ends(plan: Plan, samples: Samples) -> Samples:
    """Replace rounding errors at both ends by the exact states: controllers demand it."""
    n_t = plan.arm.n_coordinates
    coordinates, rates = samples.coordinates.copy(), samples.rates.copy()
    for row, state in ((0, plan.problem.start), (-1, plan.problem.goal)):
        coordinates[row], rates[row] = state[:n_t], state[n_t:]
    return replace(samples, coordinates=coordinates, rates=rates)


def _with_hold(plan: Plan, samples: Samples, delay_ns: int) -> Samples:
    """Append a sample at rest with the holding torque."""
    def again(values: Array) -> Array:
        return np.concatenate([values, values[-1:]])

    fields = {name: again(getattr(samples, name)) for name in Samples.__slots__}
    fields['times'][-1] += delay_ns * 1e-9
    fields['accelerations'][-1] = 0
    fields['torques'][-1] = plan.problem.holding_torque
    return Samples(**fields)
