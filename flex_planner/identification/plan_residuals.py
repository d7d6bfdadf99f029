"""What a recorded motion leaves behind on the arm that was found, and what a new plan would."""

from __future__ import annotations

from dataclasses import dataclass

from flex_planner.arms.arm import Arm
from flex_planner.base.errors import FlexPlannerError
from flex_planner.base.progress import Monitor
from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import JointController
from flex_planner.control.joint_reference import JointReference
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.identification.drive import Drive
from flex_planner.identification.identification import Identification
from flex_planner.identification.joint_log import JointLog
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.simulation.joint_control import Encoder
from flex_planner.simulation.plant import Control, Plant
from flex_planner.simulation.settling import ArrivalWatch
import numpy as np

WINDOW = 1.0
"""How long the tip is watched after the arrival [s]."""
# [rad/s], [rad]: tables have nine digits
_STILL, _THERE = 1e-6, 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanResiduals:
    """
    Motion of the tip in the second after the arrival, peak to peak, by simulation.

    The arm that was found moves, with its payload, under the drive, with its delay.

    Attributes
    ----------
    name : str
        Of the log whose trajectory it is.
    before : float
        Of the recorded trajectory, with the encoders as they are [m].
    after : float
        Of a plan of least effort with the arm that was found, from the same start to the same goal
        in the same time, with the zero of the encoders corrected; NaN where there is none [m].
    message : str
        Why there is none, or empty.

    """

    name: str
    before: float
    after: float
    message: str = ''


def find_plan_residuals(found: Identification, log: JointLog, drive: Drive,
                        monitor: Monitor | None = None) -> PlanResiduals | None:
    """
    Return what a plan left behind and what the next one will; None if the log has no plan.

    Parameters
    ----------
    found : Identification
        The arm.
    log : JointLog
        One of its logs; its trajectory must end at rest.
    drive : Drive
        That follows it.
    monitor : Monitor, optional
        May stop it.

    Raises
    ------
    StoppedError
        If the monitor stopped it.

    """
    if log.reference is None or np.abs(log.reference.velocities[-1]).max() > _STILL:
        return None
    reference = _up_to_arrival(log.reference)
    arm = found.identified_arm()
    before = _residual(arm, found, drive, reference, found.encoder_offsets)
    after, message = _replan(arm, found, drive, reference, monitor)
    return PlanResiduals(name=log.name, before=before, after=after, message=message)


def _up_to_arrival(reference: JointReference) -> JointReference:
    """Return a trajectory up to where it stays for good: what is held then is no motion."""
    moves = ((np.abs(reference.velocities) > _STILL)
             | (np.abs(reference.positions - reference.positions[-1]) > _THERE)).any(axis=1)
    count = min(int(np.flatnonzero(moves).max(initial=-1)) + 2, len(moves))
    efforts = reference.torques[:count].copy()
    efforts[-1] = reference.torques[-1]
    return JointReference(times=reference.times[:count], positions=reference.positions[:count],
                          velocities=reference.velocities[:count],
                          accelerations=reference.accelerations[:count], torques=efforts)


def _replan(arm: Arm, found: Identification, drive: Drive, reference: JointReference,
            monitor: Monitor | None) -> tuple[float, str]:
    """Return what a plan with the arm that was found leaves, or why there is none."""
    try:
        task = Task(arm=arm, start_positions=reference.positions[0],
                    goal_positions=reference.positions[-1], duration=float(reference.times[-1]),
                    payload_mass=found.payload_mass)
    except FlexPlannerError as error:
        return np.nan, str(error)
    plan = plan_path(task, monitor=monitor)
    if not plan.solved:
        return np.nan, plan.message or plan.status.value
    controller = JointController(gains=drive.gains, rate=drive.rate, hold=drive.hold)
    samples = sample_plan(plan, SamplingSettings(controller=controller))
    corrected = np.zeros(arm.n_joints)
    return _residual(arm, found, drive, samples.reference, corrected), ''


def _residual(arm: Arm, found: Identification, drive: Drive, reference: JointReference,
              offsets: Array) -> float:
    """Return what the arm makes of a trajectory; infinite if it runs away [m]."""
    encoder = Encoder(resolution=drive.resolution, differentiates=not drive.measured_speeds,
                      speed_filter=drive.speed_filter, offsets=tuple(offsets))
    plant = Plant(ArmDynamics.of(arm), Control(
        gains=drive.gains, rate=drive.rate, hold=drive.hold, encoder=encoder,
        delay=found.delay), payload_mass=found.payload_mass,
        payload_inertia=arm.payload_inertia, positions=reference.positions[0])
    plant.follow(reference)
    watch, arrival = ArrivalWatch(arm, WINDOW), float(reference.times[-1])
    watch.expect(arrival)
    try:
        plant.advance(arrival + WINDOW + 2 * plant.period,
                      lambda plant: watch.see(plant.time, plant.state))
    except FlexPlannerError:
        return np.inf
    residual = watch.result(plant.time)
    return np.inf if residual is None else residual.tip
