"""The recording of a request, read back into arm, parameters and arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import arm_from_plain
from flex_planner.arms.frames import name_joints
from flex_planner.base.errors import FlexPlannerError, RecordingError
from flex_planner.base.paths import expand_path
from flex_planner.base.validation import Array
from flex_planner.base.yaml_text import parse_yaml, YamlTextError
from flex_planner.control.joint_reference import JointReference
from flex_planner.optimal_control.parameters import Parameters
from flex_planner.optimal_control.path_constraints import (
    limits_of_arm,
    PathConstraint,
    read_constraint,
)
from flex_planner.recording import (
    Decoder,
    Definition,
    definition_folder,
    ForeignChannel,
    MessageTypes,
    read_attachments,
    read_metadata,
    read_recording,
    StandIns,
)
import numpy as np

_PACKAGE = 'flex_planner_interfaces'
_TYPES = f'{_PACKAGE}/msg/'
_NANOSECOND = 1e-9
_LIMIT_FIELDS = ('names', 'margins', 'units', 'shares', 'times')
_WANTED = ('MotionTask', 'PlanReport', 'PayloadSearch', 'FlexibleTrajectory', 'FeedbackGains')


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedMotion:
    """
    The samples of a recorded plan, n joints and n_t coordinates.

    Attributes
    ----------
    times : numpy.ndarray, shape (k,)
        [s]; the last sample holds the arm, shortly after the end of the motion, and so do the
        first ones if the arm is held before it.
    coordinates, rates : numpy.ndarray, shape (k, n_t)
        Joints [rad], then modes [m], and their rates.
    accelerations : numpy.ndarray, shape (k, n)
        Of the joints [rad/s^2].
    torques : numpy.ndarray, shape (k, n)
        Efforts of the joint trajectory [N m].
    position_costates, velocity_costates : numpy.ndarray, shape (k, n_t)
        psi_1 and psi_2.
    torque_costates : numpy.ndarray, shape (k, n), or (k, 0) where torques may jump
        psi_tau.
    tip : numpy.ndarray, shape (k, 2), of a spatial arm (k, 3)
        [m].
    payload_mass : float
        Planned for [kg].
    begin : float
        Of the motion: the samples before hold the arm [s].

    """

    times: Array
    coordinates: Array
    rates: Array
    accelerations: Array
    torques: Array
    position_costates: Array
    velocity_costates: Array
    torque_costates: Array
    tip: Array
    payload_mass: float
    begin: float = 0.0

    @classmethod
    def of(cls, message: Any, begin: float, dimension: int = 2) -> RecordedMotion:
        """Return the motion of a FlexibleTrajectory, whose points have so many coordinates."""
        joints, bends = message.joint_trajectory.points, message.points
        stamps = [point.time_from_start for point in joints]
        return cls(
            times=np.array([stamp.sec + stamp.nanosec * 1e-9 for stamp in stamps]),
            coordinates=np.hstack([_rows(joints, 'positions'),
                                   _rows(bends, 'modal_displacements')]),
            rates=np.hstack([_rows(joints, 'velocities'), _rows(bends, 'modal_rates')]),
            accelerations=_rows(joints, 'accelerations'), torques=_rows(joints, 'effort'),
            position_costates=_rows(bends, 'position_costates'),
            velocity_costates=_rows(bends, 'velocity_costates'),
            torque_costates=np.array([getattr(point, 'torque_costates', ()) for point in bends],
                                     dtype=np.float64),
            tip=np.array([(point.x, point.y, point.z)[:dimension] for point in message.tip_path]),
            payload_mass=float(message.payload_mass), begin=begin)

    @property
    def moving(self) -> slice:
        """Return the samples of the motion, without those that hold the arm before and after."""
        return self.since(self.begin)

    def since(self, time: float) -> slice:
        """Return the samples of the motion from a time on [s]."""
        return slice(int(np.searchsorted(self.times, time - _NANOSECOND)), -1)

    @property
    def extended_states(self) -> Array:
        """Return states and costates z, shape (k, 4 n_t)."""
        return np.hstack([self.coordinates, self.rates, self.position_costates,
                          self.velocity_costates])

    @property
    def reference(self) -> JointReference:
        """Return the trajectory that the joint controller gets, led into from rest."""
        n = self.torques.shape[1]
        reference = JointReference(
            times=self.times, positions=self.coordinates[:, :n], velocities=self.rates[:, :n],
            accelerations=self.accelerations, torques=self.torques)
        return reference.after(self.coordinates[0, :n], self.rates[0, :n], self.torques[0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Messages:
    """The messages of a request by the names of their types, and what else there is."""

    messages: Mapping[str, Any]
    left_out: tuple[ForeignChannel, ...]

    @classmethod
    def read(cls, path: Path | str) -> _Messages:
        """Read them; a message of an older planner is completed by defaults."""
        types = MessageTypes.load([definition_folder(_PACKAGE)])
        metadata, decoder, stand_ins = read_metadata(path), Decoder(types), StandIns(types)
        definitions: dict[str, Definition] = {
            entry.topic.name: entry.definition for entry in metadata.topics
            if entry.topic.type_name in {f'{_TYPES}{name}' for name in _WANTED}}
        left_out, messages = list(metadata.foreign), {}
        for entry in read_recording(path, types, definitions, left_out.append):
            own = decoder.types_of(definitions[entry.topic.name])
            name = entry.topic.type_name
            messages[name.removeprefix(_TYPES)] = entry.message if own is types else (
                stand_ins.complete(entry.message, own, name))
        if 'MotionTask' not in messages or 'PlanReport' not in messages:
            others = ''.join(f'; {channel} ' for channel in left_out).rstrip()
            raise RecordingError(f'{path} is not the recording of a request: it has no MotionTask '
                                 f'with a PlanReport{others}')
        return cls(messages=messages, left_out=tuple(left_out))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedRequest:
    """
    A request with its outcome, as it was recorded.

    Attributes
    ----------
    path : Path
        The recording.
    arm : Arm
        From the attached scenario.
    settings : mapping
        Parameters of the planner, by name.
    task, report : object
        The messages MotionTask and PlanReport.
    search : object or None
        The message PayloadSearch, where a maximum payload was asked for.
    gains : object or None
        The message FeedbackGains, where gains were looked for.
    joint_names : tuple of str
        As the arm's controller knows them.
    motion : RecordedMotion or None
        None where there is no plan.
    left_out : tuple of ForeignChannel
        What the recording holds besides, or what of it cannot be read.

    """

    path: Path
    arm: Arm
    settings: Mapping[str, Any]
    task: Any
    report: Any
    search: Any | None
    joint_names: tuple[str, ...]
    motion: RecordedMotion | None
    left_out: tuple[ForeignChannel, ...] = ()
    gains: Any | None = None

    @classmethod
    def read(cls, path: Path | str) -> RecordedRequest:
        """
        Read a recording of the planner.

        Raises
        ------
        RecordingError
            If it cannot be read, or is not what the planner records.

        """
        found = _Messages.read(path)
        trajectory = found.messages.get('FlexibleTrajectory')
        scenario = _scenario(path)
        try:
            arm = arm_from_plain(scenario['arm'])
            settings = dict(scenario['parameters'])
            # older recordings do not know of it
            begin = float(getattr(found.messages['PlanReport'], 'start_hold', 0.0))
            motion = (RecordedMotion.of(trajectory, begin, arm.dimension) if trajectory
                      else None)
            if motion is not None:
                _check_sizes(arm, motion)
            request = cls(
                path=expand_path(path), arm=arm, settings=settings,
                task=found.messages['MotionTask'],
                report=found.messages['PlanReport'], search=found.messages.get('PayloadSearch'),
                motion=motion, joint_names=_joint_names(settings, arm), left_out=found.left_out,
                gains=found.messages.get('FeedbackGains'))
            request._check()
            return request
        except (FlexPlannerError, AttributeError, LookupError, OverflowError, TypeError,
                ValueError) as error:
            raise RecordingError(f'{path} contradicts itself: {error}') from error

    def _check(self) -> None:
        """Raise one of many exceptions unless what is derived from the messages can be."""
        if len({len(getattr(self.report, f'limit_{name}', ())) for name in _LIMIT_FIELDS}) > 1:
            raise ValueError('its limits on the way differ in number')
        tolerance = self.tolerance
        if self.motion is not None and not tolerance >= 0:
            raise ValueError(f'the tolerance is {tolerance}')
        if self.motion is not None:
            self.parameters  # noqa: B018 - refuses what is out of bounds
            self.path_constraints  # noqa: B018 - as well

    @property
    def solved(self) -> bool:
        """Return whether there is a plan that may be executed."""
        return self.report.error_code == self.report.NONE and self.motion is not None

    @property
    def tolerance(self) -> float:
        """Return eps of eq. (17), that of the task or of the parameters."""
        return float(self.task.tolerance or self.settings['tolerance'])

    @property
    def parameters(self) -> Parameters:
        """Return payload, limits and weights of the plan, which a search may have changed."""
        payload = self.task.payload_mass if self.motion is None else self.motion.payload_mass
        n, n_t = self.arm.n_joints, self.arm.n_coordinates

        def weights(values: Any, count: int) -> Array | None:
            given = np.asarray(values, dtype=np.float64)
            return np.append(given, np.zeros(count - given.size)) if given.size else None

        return Parameters.of(
            self.arm, payload_mass=payload,
            payload_inertia=self.task.payload_inertia or self.arm.payload_inertia,
            effort_weights=weights(self.report.effort_weights, n),
            position_weights=weights(self.task.position_weights, n_t),
            velocity_weights=weights(self.report.velocity_weights, n_t))

    @property
    def path_constraints(self) -> tuple[PathConstraint, ...]:
        """Return the limits on the way of arm and task; in older recordings tasks have none."""
        asked = []
        for i, text in enumerate(getattr(self.task, 'path_constraints', ())):
            asked.append(read_constraint(f'path_constraints[{i}]', str(text)))
            asked[-1].check(f'path_constraints[{i}]', self.arm)
        return tuple(one for one in (*limits_of_arm(self.arm), *asked)
                     if self.arm.n_modes or not one.bends)


def _scenario(path: Path | str) -> Mapping[str, Any]:
    """Return the attachment with arm and parameters."""
    attached = read_attachments(path).get('scenario.yaml')
    if attached is None:
        raise RecordingError(f'{path} is not the recording of a request: it has no scenario.yaml')
    try:
        scenario = parse_yaml(attached.decode('utf-8'))
    except (UnicodeDecodeError, YamlTextError) as error:
        raise RecordingError(f'{path} has a scenario.yaml that is not YAML: {error}') from error
    if not isinstance(scenario, Mapping):
        raise RecordingError(f'{path} has a scenario.yaml that is no YAML with arm and parameters')
    return scenario


def _joint_names(settings: Mapping[str, Any], arm: Arm) -> tuple[str, ...]:
    """Return the names of the joints, made up where they are not those of the arm."""
    names = settings.get('joint_names')
    if isinstance(names, list) and len(names) == arm.n_joints:
        return tuple(map(str, names))
    return name_joints(arm)


def _rows(points: Sequence[Any], field: str) -> Array:
    """Return a field of all points, one row per point."""
    return np.array([getattr(point, field) for point in points], dtype=np.float64)


def _check_sizes(arm: Arm, motion: RecordedMotion) -> None:
    """Raise ValueError unless a motion is one of an arm."""
    count, n_t = motion.times.size, arm.n_coordinates
    shapes = {'coordinates': n_t, 'rates': n_t, 'torques': arm.n_joints, 'tip': arm.dimension,
              'accelerations': arm.n_joints,
              'position_costates': n_t, 'velocity_costates': n_t,
              'torque_costates': arm.n_joints if motion.torque_costates.size else 0}
    for name, columns in shapes.items():
        shape = getattr(motion, name).shape
        if shape != (count, columns):
            raise ValueError(f'{name} are {shape}, but must be {(count, columns)}')
    if count < 3 or not (np.diff(motion.times) > 0).all():
        raise ValueError('the times of the motion do not increase, or are fewer than 3')
