"""Parameters of the planner node."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from flex_planner.arms.arm import Arm
from flex_planner.arms.frames import name_frames, name_joints
from flex_planner.base.errors import InvalidSizeError, InvalidValueError
from flex_planner.base.paths import expand_path, folder_from_environment
from flex_planner.base.validation import plain_names, vector
from flex_planner.collocation import Solver, SolverSettings
from flex_planner.control.default_gains import default_gains
from flex_planner.control.joint_controller import (
    EffortHold,
    Gains,
    JointController,
    MAX_RATE,
    MIN_RATE,
)
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.optimal_control.task import MAX_PAYLOAD
from flex_planner.planning.kinds.effort import SearchEffort
from flex_planner.planning.sampling import MAX_PERIOD, MAX_START_HOLD, SamplingSettings
from flex_planner.ros.settings.fields import parameter_field
import numpy as np

# of a joint [N m/rad], [N m s/rad]
MAX_GAIN = 1e9
# of the largest payload [kg]
MIN_ACCURACY, MAX_ACCURACY = 1e-6, 1e3
# of a file of a recording, and of all recordings [bytes]: a slip in the unit must not make a file
# of every message, nor remove all
MIN_RECORDING_SIZE, MAX_RECORDING_SIZE = 2**16, 2**40
MAX_WAITING = 1e6  # [s]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerSettings:
    """
    The node's parameters; a request uses those at the time of its arrival.

    Raises
    ------
    InvalidValueError
        If a value breaks a bound that a parameter's range cannot express.

    """

    elbow: int = parameter_field(
        -1, 'Sign of the second joint angle, +1 or -1, for requests whose elbow is 0.',
        lowest=-1, highest=1)
    tolerance: float = parameter_field(
        1e-3, 'Largest allowed boundary error, half the squared error of the final state.',
        lowest=1e-9, highest=1.0)
    allowed_planning_time: float = parameter_field(
        30.0, 'Time limit of a request that sets none [s].', lowest=1e-3, highest=3600.0)
    effort_weights: list[float] = parameter_field(
        [1.0], 'Diagonal of R for requests that give none: one entry per joint.')
    payload_accuracy: float = parameter_field(
        1e-3, 'Largest error of a maximum payload, for requests that give none [kg].',
        lowest=MIN_ACCURACY, highest=MAX_ACCURACY)
    payload_step: float = parameter_field(
        1.0, 'First step of the incremental search for a maximum payload, for requests that give '
        'none; at least the accuracy is used [kg].',
        lowest=MIN_ACCURACY, highest=MAX_PAYLOAD)
    joint_names: list[str] = parameter_field(
        ['joint1'], 'Names of the joints in trajectories, from the base outwards.',
        read_only=True)
    base_frame: str = parameter_field('base_link', 'Frame of tip paths.', read_only=True)
    stages: int = parameter_field(
        8, 'Gauss points in a mesh interval; the order is twice that.', lowest=2, highest=11)
    intervals: int = parameter_field(20, 'Intervals of the first mesh.', lowest=4, highest=20000)
    max_intervals: int = parameter_field(
        2000, 'Most intervals of a mesh.', lowest=4, highest=20000)
    max_iterations: int = parameter_field(
        60, 'Most Newton iterations on one mesh.', lowest=1, highest=1000)
    error_tolerance: float = parameter_field(
        1e-6, 'Largest estimated error of states and costates relative to their magnitude.',
        lowest=1e-11, highest=1.0)
    search: str = parameter_field(
        'normal', 'How many kinds of motion are looked for: fast (one), normal, or thorough. '
        'Requests that start from the cell of a map stay in its kind.')
    sampling_step: float = parameter_field(
        0.01, 'Longest time between published samples [s].', lowest=2.5e-4, highest=1.0)
    torque_tolerance: float = parameter_field(
        0.02, 'Largest error of linear interpolation of the torque between the samples [N m].',
        lowest=1e-6, highest=1e6)
    controller_rate: float = parameter_field(
        1000.0, 'Rate of the joint controller that published trajectories are for [Hz].',
        lowest=MIN_RATE, highest=MAX_RATE)
    effort_hold: str = parameter_field(
        EffortHold.END.value, 'Effort that it applies from one update to the next: that of the '
        'end of the time between (joint_trajectory_controller), start, middle, or linear.')
    controller_stiffness: list[float] = parameter_field(
        [100.0], 'Proportional gain of its PD, one entry per joint [N m/rad].')
    controller_damping: list[float] = parameter_field(
        [10.0], 'Derivative gain of its PD, one entry per joint [N m s/rad].')
    controller_period: float = parameter_field(
        -1.0, 'Efforts are shifted by half this time, so that their mean is right where they are '
        'held for it; -1: 1 / controller_rate, 0: not at all [s].', lowest=-1.0,
        highest=MAX_PERIOD)
    start_hold: float = parameter_field(
        0.0, 'How long a trajectory holds the arm before a motion that starts at rest, with the '
        'torque that this takes; at least four periods of the controller. A controller leads the '
        'arm there first. 0: not at all [s].', lowest=0.0, highest=MAX_START_HOLD)
    feedback_gains: bool = parameter_field(
        False, 'Whether gains of feedback are looked for along every plan, which takes some '
        'tenths of a second, and published with it. Not for arms in space.')
    reference_rate: float = parameter_field(
        100.0, 'Rate of the states that are streamed along a published plan [Hz].', lowest=1.0,
        highest=1000.0)
    map_store: str = parameter_field(
        '', 'Store of a map of this arm, made by flex-planner map: requests near one of its cells '
        'start from the motion of that cell. Empty for none.', read_only=True)
    queue_length: int = parameter_field(
        8, 'Requests that may wait; more are answered BUSY.', lowest=1, highest=1000,
        read_only=True)
    max_waiting_time: float = parameter_field(
        300.0, 'Largest sum of the allowed planning times of requests that wait; more are '
        'answered BUSY [s].', lowest=1e-3, highest=MAX_WAITING, read_only=True)
    joint_states_topic: str = parameter_field(
        'joint_states', 'Topic on which the arm says where it is, sensor_msgs/JointState; empty: '
        'not listened to.', read_only=True)
    check_start: bool = parameter_field(
        True, 'Whether a plan is not published where the arm is heard, but moves or is not at the '
        'start of the plan.')
    start_tolerance: float = parameter_field(
        0.05, 'Largest distance of a joint from the start of a plan that is published [rad].',
        lowest=1e-6, highest=10.0)
    start_speed_tolerance: float = parameter_field(
        0.05, 'Largest difference of the speed of a joint from that at the start of such a plan '
        '[rad/s].', lowest=1e-6, highest=10.0)
    joint_state_timeout: float = parameter_field(
        1.0, 'Joint states that are older do not tell where the arm is [s].', lowest=0.01,
        highest=3600.0)
    execute_action: str = parameter_field(
        '', 'Action of a controller, control_msgs/FollowJointTrajectory, that published plans are '
        'sent to; empty: none.', read_only=True)
    execute_timeout: float = parameter_field(
        5.0, 'Time that the controller has to appear, to accept a plan, to end after the end of '
        'the motion, and to cancel [s].', lowest=0.1, highest=3600.0)
    replan_lead: float = parameter_field(
        0.1, 'How long after the planner begins to work on it a plan begins that replaces another '
        'one, where its request has no start_time [s].', lowest=1e-3, highest=10.0)
    replan_sampling_step: float = parameter_field(
        0.02, 'As sampling_step, of plans that replace another one: fewer points are ready '
        'earlier; at least sampling_step is used [s].', lowest=2.5e-4, highest=1.0)
    replan_torque_tolerance: float = parameter_field(
        0.1, 'As torque_tolerance, of plans that replace another one: fewer points are ready '
        'earlier; at least torque_tolerance is used [N m].', lowest=1e-6, highest=1e6)
    state_estimate_timeout: float = parameter_field(
        0.1, 'Estimates of the state, and joint states, that are older do not tell how the moving '
        'arm is bent [s].', lowest=1e-3, highest=10.0)
    recording_folder: str = parameter_field(
        '', 'Folder of the recordings; empty for $ROS_HOME/flex_planner.', read_only=True)
    record: bool = parameter_field(True, 'Whether to record every request with its outcome.')
    record_motions: bool = parameter_field(
        False, 'Whether to record the joint states of every motion that is published, too: logs '
        'for flex-planner identify.', read_only=True)
    motion_settling: float = parameter_field(
        1.0, 'How long such a recording goes on after the motion [s].', lowest=0.0, highest=60.0)
    max_recording_size: int = parameter_field(
        0, 'Size at which a recording continues in another file, at least 65536 [bytes]; 0: '
        'recordings are never split.', lowest=0, highest=MAX_RECORDING_SIZE)
    max_recordings: int = parameter_field(
        0, 'Recordings that are kept in the folder: beyond it, the oldest finished one is removed '
        'once another is written; 0: all.', lowest=0, highest=10**6)
    max_total_recording_size: int = parameter_field(
        0, 'Size of all recordings together that are kept, at least 65536 [bytes]; 0: any. The '
        'newest is kept in any case.', lowest=0, highest=MAX_RECORDING_SIZE)
    recording_required: bool = parameter_field(
        False, 'Whether a plan that cannot be recorded fails (RECORDING_FAILED) and is not '
        'published; if not, its report has the warning NOT_RECORDED.')

    def __post_init__(self) -> None:
        if self.elbow not in (-1, 1):
            raise InvalidValueError('elbow', self.elbow, '+1 or -1')
        count = len(self.joint_names)
        vector('effort_weights', self.effort_weights, count, above=0)
        for name in ('controller_stiffness', 'controller_damping'):
            vector(name, getattr(self, name), count, at_least=0, at_most=MAX_GAIN)
        if len(set(self.joint_names)) != len(self.joint_names) or '' in self.joint_names:
            raise InvalidValueError('joint_names', self.joint_names, 'different names')
        plain_names('joint_names', self.joint_names)
        if -1 < self.controller_period < 0:
            raise InvalidValueError('controller_period', self.controller_period,
                                    f'-1, or from 0 to {MAX_PERIOD:g} s')
        for name in ('max_recording_size', 'max_total_recording_size'):
            if 0 < getattr(self, name) < MIN_RECORDING_SIZE:
                raise InvalidValueError(name, getattr(self, name),
                                        f'0 or at least {MIN_RECORDING_SIZE} bytes')
        expand_path(self.recording_folder)  # refuses what is no path
        SearchEffort.of(self.search)
        self.solver()
        self.sampling()

    @classmethod
    def for_arm(cls, arm: Arm) -> PlannerSettings:
        """Return the defaults for an arm."""
        gains = default_gains(ArmDynamics.of(arm))
        return replace(cls(), joint_names=list(name_joints(arm)),
                       base_frame=name_frames(arm)[0], effort_weights=[1.0] * arm.n_joints,
                       controller_stiffness=gains.stiffness.tolist(),
                       controller_damping=gains.damping.tolist())

    def check_joints(self, count: int) -> None:
        """Raise InvalidSizeError unless there is a name for each of the arm's joints."""
        if len(self.joint_names) != count:
            raise InvalidSizeError('joint_names', f'{len(self.joint_names)} names',
                                   f'a list of {count} names')

    def solver(self) -> Solver:
        """Return the solver of boundary-value problems."""
        return Solver(SolverSettings(
            stages=self.stages, intervals=self.intervals, max_intervals=self.max_intervals,
            max_iterations=self.max_iterations, error_tolerance=self.error_tolerance))

    def sampling(self) -> SamplingSettings:
        """Return the settings of the sampling of trajectories."""
        period = None if self.controller_period < 0 else self.controller_period
        return SamplingSettings(
            longest_step=self.sampling_step, torque_tolerance=self.torque_tolerance,
            controller=self.controller(), controller_period=period,
            start_hold=self.start_hold)

    def replan_sampling(self) -> SamplingSettings:
        """Return those of the sampling of plans that replace another one."""
        return replace(
            self.sampling(), start_hold=0.0,
            longest_step=max(self.sampling_step, self.replan_sampling_step),
            torque_tolerance=max(self.torque_tolerance, self.replan_torque_tolerance))

    def with_controller(self, controller: JointController) -> PlannerSettings:
        """Return the settings for another joint controller."""
        return replace(self, controller_rate=controller.rate, effort_hold=controller.hold.value,
                       controller_stiffness=controller.gains.stiffness.tolist(),
                       controller_damping=controller.gains.damping.tolist())

    def controller(self) -> JointController:
        """Return the joint controller that trajectories are for."""
        gains = Gains(stiffness=np.asarray(self.controller_stiffness),
                      damping=np.asarray(self.controller_damping))
        return JointController(gains=gains, rate=self.controller_rate,
                               hold=EffortHold.named(self.effort_hold))

    def output_folder(self) -> Path:
        """Return the folder of the recordings."""
        if self.recording_folder:
            return expand_path(self.recording_folder)
        return folder_from_environment('ROS_HOME', '~/.ros') / 'flex_planner'
