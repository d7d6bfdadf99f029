"""The parameters of the simulated arm."""

from __future__ import annotations

from dataclasses import dataclass, replace

from flex_planner.arms.arm import Arm, Joint
from flex_planner.arms.frames import name_frames, name_joints
from flex_planner.base.validation import plain_names, vector
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import EffortHold, Gains, MAX_RATE, MIN_RATE
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.optimal_control.task import MAX_JOINT_ANGLE
from flex_planner.ros.settings.fields import parameter_field
from flex_planner.ros.settings.planner import MAX_GAIN
from flex_planner.simulation.joint_control import Disturbance, Encoder
from flex_planner.simulation.mismatch import AS_GIVEN, Mismatch
from flex_planner.simulation.plant import Control, MAX_DELAY
import numpy as np

_FAR = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorSettings:
    """
    Parameters of the simulator; all read-only.

    Raises
    ------
    InvalidValueError
        If a list does not have one entry per joint, or a value breaks its bound.

    """

    joint_names: list[str] = parameter_field(
        ['joint1'], 'Names of the joints, from the base outwards.', read_only=True)
    initial_positions: list[float] = parameter_field(
        [0.0], 'Joint angles at the start, as the encoders say them [rad].', read_only=True)
    payload_mass: float = parameter_field(
        1.0, 'Mass at the tip of the simulated arm, whatever was planned for [kg].', lowest=0.0,
        highest=_FAR, read_only=True)
    payload_inertia: float = parameter_field(
        0.0, 'Rotary inertia of that mass [kg m^2]; 0: as in the arm file.', lowest=0.0,
        highest=_FAR, read_only=True)
    modes: int = parameter_field(
        AS_GIVEN, 'Modes of every flexible link; -1: as in the arm file.', lowest=-1, highest=8,
        read_only=True)
    rigidity_scale: float = parameter_field(
        1.0, 'Factor on the flexural rigidity of every link.', lowest=1e-3, highest=1e3,
        read_only=True)
    added_friction: list[float] = parameter_field(
        [0.0], 'Viscous friction of each joint beyond that of the arm file [N m s/rad].',
        read_only=True)
    stiffness: list[float] = parameter_field(
        [100.0], 'Proportional gain of each joint [N m/rad].', read_only=True)
    damping: list[float] = parameter_field(
        [10.0], 'Derivative gain of each joint [N m s/rad].', read_only=True)
    feedback_gains: bool = parameter_field(
        False, 'Whether gains that come on the topic feedback_gains take the place of the PD.',
        read_only=True)
    feedforward: bool = parameter_field(
        True, 'Whether the torques of a trajectory are applied; if not, PD alone moves the arm.',
        read_only=True)
    effort_hold: str = parameter_field(
        EffortHold.END.value, 'Which torque of the trajectory is applied from one update to the '
        'next: that of its end, as joint_trajectory_controller does; start; middle.',
        read_only=True)
    limit_torques: bool = parameter_field(
        True, 'Whether the motors have the limits of the arm file.', read_only=True)
    control_rate: float = parameter_field(
        1000.0, 'Rate of the simulated controller [Hz].', lowest=MIN_RATE, highest=MAX_RATE,
        read_only=True)
    encoder_rate: float = parameter_field(
        0.0, 'Rate at which the joints are measured [Hz]; 0: that of the controller.',
        lowest=0.0, highest=MAX_RATE, read_only=True)
    encoder_resolution: float = parameter_field(
        0.0, 'Step of the measured joint angles [rad]; 0: exact.', lowest=0.0, highest=1.0,
        read_only=True)
    encoder_differences: bool = parameter_field(
        False, 'Whether joint speeds are differences of measured angles; if not, exact.',
        read_only=True)
    encoder_speed_filter: float = parameter_field(
        0.0, 'Corner frequency of the low pass for such differences [Hz]; 0: none.', lowest=0.0,
        highest=MAX_RATE, read_only=True)
    encoder_offsets: list[float] = parameter_field(
        [0.0], 'What the encoder of each joint says too much [rad].', read_only=True)
    torque_delay: float = parameter_field(
        0.0, 'Time from an update of the controller to its torque [s].', lowest=0.0,
        highest=MAX_DELAY, read_only=True)
    disturbance_joint: int = parameter_field(
        0, 'Joint that a pulse of torque from outside acts on, from 1 at the base; 0: none.',
        lowest=0, highest=8, read_only=True)
    disturbance_torque: float = parameter_field(
        0.0, 'Torque of the pulse [N m].', lowest=-_FAR, highest=_FAR, read_only=True)
    disturbance_start: float = parameter_field(
        0.0, 'Time from the start of a motion to the pulse [s].', lowest=0.0, highest=_FAR,
        read_only=True)
    disturbance_duration: float = parameter_field(
        0.0, 'Duration of the pulse [s].', lowest=0.0, highest=_FAR, read_only=True)
    vibration_window: float = parameter_field(
        1.0, 'Time after an arrival over which the residual vibration is measured [s].',
        lowest=0.01, highest=100.0, read_only=True)
    publish_rate: float = parameter_field(
        100.0, 'Rate of the published states [Hz].', lowest=1.0, highest=1000.0, read_only=True)
    start_tolerance: float = parameter_field(
        0.05, 'A trajectory that starts further from the arm than this is refused [rad].',
        lowest=0.0, highest=10.0, read_only=True)
    base_frame: str = parameter_field('base_link', 'Frame of the base.', read_only=True)
    frame_prefix: str = parameter_field(
        'bent_', 'What the names of the frames of the links and of the tip begin with on /tf, '
        'beside those of a robot_state_publisher, whose links do not bend.', read_only=True)
    picture_rate: float = parameter_field(
        25.0, 'Rate of the markers and frames [Hz]; 0: none.', lowest=0.0, highest=1000.0,
        read_only=True)

    def __post_init__(self) -> None:
        count = len(self.joint_names)
        plain_names('joint_names', self.joint_names)
        plain_names('frame_prefix', [self.frame_prefix])
        for name in ('stiffness', 'damping', 'added_friction'):
            vector(name, getattr(self, name), count, at_least=0, at_most=MAX_GAIN)
        vector('initial_positions', self.initial_positions, count, at_least=-MAX_JOINT_ANGLE,
               at_most=MAX_JOINT_ANGLE, unit='rad')
        self.control.check(count)
        self.mismatch  # noqa: B018 - refuses what is out of bounds

    @classmethod
    def for_arm(cls, arm: Arm) -> SimulatorSettings:
        """Return the defaults for an arm."""
        n, gains = arm.n_joints, default_gains(ArmDynamics.of(arm))
        return replace(cls(), joint_names=list(name_joints(arm)),
                       base_frame=name_frames(arm)[0],
                       initial_positions=[_within_limits(joint) for joint in arm.joints],
                       stiffness=gains.stiffness.tolist(),
                       damping=gains.damping.tolist(), added_friction=[0.0] * n,
                       encoder_offsets=[0.0] * n)

    @property
    def mismatch(self) -> Mismatch:
        """Return the differences of the simulated arm from that of the arm file."""
        return Mismatch(modes=self.modes, rigidity_scale=self.rigidity_scale,
                        added_friction=np.asarray(self.added_friction))

    @property
    def control(self) -> Control:
        """Return the control of the joints."""
        return Control(
            gains=Gains(stiffness=np.asarray(self.stiffness), damping=np.asarray(self.damping)),
            rate=self.control_rate, hold=EffortHold.named(self.effort_hold),
            feedforward=self.feedforward,
            limit_torques=self.limit_torques,
            encoder=Encoder(rate=self.encoder_rate, resolution=self.encoder_resolution,
                            differentiates=self.encoder_differences,
                            speed_filter=self.encoder_speed_filter,
                            offsets=tuple(self.encoder_offsets)),
            delay=self.torque_delay,
            disturbance=Disturbance(
                joint=self.disturbance_joint, torque=self.disturbance_torque,
                start=self.disturbance_start, duration=self.disturbance_duration))


def _within_limits(joint: Joint) -> float:
    """Return the angle nearest to 0 that a joint may have [rad]."""
    return float(np.clip(0.0, joint.lower_limit, joint.upper_limit))
