"""The contents of the recording of one request."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timezone
import itertools
import logging
from pathlib import Path
import re
import time
from typing import Final

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import plain_arm
from flex_planner.base.errors import RecordingError
from flex_planner.base.text import printable
from flex_planner.base.version import VERSION
from flex_planner.base.yaml_text import format_yaml
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import SampledPlan
from flex_planner.recording import (
    DEFAULT,
    find_recordings,
    LATCHED,
    Recording,
    remove_oldest,
    Topic,
)
from flex_planner.ros.messages.classes import MotionTask, PlanReport, TYPES
from flex_planner.ros.messages.feedback import feedback_message
from flex_planner.ros.messages.reference_states import encode_states
from flex_planner.ros.messages.trajectory_bytes import (
    encode_flexible_trajectory,
    encode_joint_trajectory,
    FLEXIBLE_TRAJECTORY,
    JOINT_TRAJECTORY,
)
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.recorded_motion import in_order, RecordedMotion
from flex_planner.ros.settings.fields import as_mapping
from flex_planner.ros.settings.planner import PlannerSettings

# the groups sort by the time of the request
NAME: Final = re.compile(
    r'(?:plan_path|find_max_payload|execution|motion)_(\d{8}T\d{6}_\d{9})_(\d{4,})')

JOINT_STATE: Final = 'sensor_msgs/msg/JointState'

_LOG = logging.getLogger(__name__)


class OutcomeRecorder:
    """
    Writes one recording per request.

    The request comes first, at the time it was accepted; report and trajectories follow when
    they were ready, then the samples at the times a controller would reach them.

    Parameters
    ----------
    arm : Arm
        Described in an attachment.
    names : str or callable
        Full name of the node, which the topics start with; or what returns the name of a topic,
        as it may be remapped, given that in the node.

    """

    def __init__(self, arm: Arm, names: str | Callable[[str], str]) -> None:
        self._arm = arm
        self._described: tuple[PlannerSettings, str] | None = None  # and as YAML

        def name(topic: str) -> str:
            return f'{names}/{topic}' if isinstance(names, str) else names(f'~/{topic}')

        self._numbers = itertools.count(1)
        interfaces = 'flex_planner_interfaces/msg/'
        self._task = Topic(name('motion_task'), f'{interfaces}MotionTask')
        self._report = Topic(name('plan_report'), f'{interfaces}PlanReport')
        self._search = Topic(name('payload_search'), f'{interfaces}PayloadSearch')
        self._joints = Topic(name('joint_trajectory'), JOINT_TRAJECTORY, LATCHED)
        self._flexible = Topic(name('flexible_trajectory'), FLEXIBLE_TRAJECTORY, LATCHED)
        self._gains = Topic(name('feedback_gains'), f'{interfaces}FeedbackGains', LATCHED)
        self._states = Topic(name('reference_states'), JOINT_STATE, DEFAULT)

    def find_place(self, state: RequestState, outcome: Outcome) -> Path:
        """
        Return a folder for the recording of a request, and enter it into the report.

        Parameters
        ----------
        state, outcome : RequestState, Outcome
            As of `write`.

        """
        kind = 'plan_path' if outcome.search is None else 'find_max_payload'
        path = state.settings.output_folder() / self._name(state.stamp_ns, kind)
        outcome.report.recording = printable(str(path))
        return path

    def write(self, task: MotionTask, state: RequestState, outcome: Outcome,
              place: Path | None = None) -> Path:
        """
        Write a recording and return its folder.

        Parameters
        ----------
        task : MotionTask
            The request.
        state : RequestState
            Of the request. The settings are kept in an attachment; they also give the folder and
            the size at which the recording is split. Once it is stopping, writing is an error.
        outcome : Outcome
            Of the request; the recording's path is entered into the report. A search for the
            maximum payload gives the folder another name.
        place : Path, optional
            From `find_place`, if that was called before.

        Raises
        ------
        RecordingError
            If it cannot be written; nothing is left behind then.

        """
        settings, stamp, report = state.settings, state.stamp_ns, outcome.report
        ready = stamp + report.planning_time.sec * 10**9 + report.planning_time.nanosec
        path = place or self.find_place(state, outcome)
        with Recording.create(path.parent, path.name, TYPES,
                              custom_data={'flex_planner': VERSION},
                              max_bytes=settings.max_recording_size or None) as recording:
            recording.attach('scenario.yaml', self._scenario(settings).encode(),
                             media_type='application/yaml', time_ns=stamp)
            recording.write(self._task, task, stamp)
            recording.write(self._report, report, ready)
            if outcome.search is not None:
                recording.write(self._search, outcome.search, ready)
            if outcome.plan is not None and outcome.reference is not None:
                trajectory = outcome.trajectory
                recording.copy(self._joints, TYPES.definition(JOINT_TRAJECTORY),
                               encode_joint_trajectory(trajectory.joint_trajectory), ready)
                recording.copy(self._flexible, TYPES.definition(FLEXIBLE_TRAJECTORY),
                               encode_flexible_trajectory(trajectory), ready)
                if outcome.gains is not None:
                    recording.write(self._gains, feedback_message(
                        outcome.gains, outcome.plan, settings.joint_names, settings.base_frame),
                        ready)
                self._write_states(recording, state, outcome.plan, outcome.reference, ready)
        _remove_old(settings, path)
        return path

    def write_execution(self, task: MotionTask, state: RequestState, report: PlanReport) -> None:
        """
        Write a recording of how a plan was carried out; the arguments are those of `write`.

        Raises
        ------
        RecordingError
            If it cannot be written; nothing is left behind then.

        """
        settings, now = state.settings, time.time_ns()
        path = settings.output_folder() / self._name(now, 'execution')
        report.execution_recording = printable(str(path))
        with Recording.create(path.parent, path.name, TYPES,
                              custom_data={'flex_planner': VERSION}) as recording:
            recording.attach('scenario.yaml', self._scenario(settings).encode(),
                             media_type='application/yaml', time_ns=now)
            recording.write(self._task, task, now)
            recording.write(self._report, report, now)
        _remove_old(settings, path)

    def write_motion(self, motion: RecordedMotion, states_topic: str) -> Path:
        """
        Write a recording of what the arm said of a motion, and return its folder.

        Parameters
        ----------
        motion : RecordedMotion
            The motion.
        states_topic : str
            Full name of the topic of the joint states.

        Raises
        ------
        RecordingError
            If it cannot be written; nothing is left behind then.

        """
        settings, began = motion.settings, motion.began_ns
        path = settings.output_folder() / self._name(time.time_ns(), 'motion')
        topic = Topic(states_topic, JOINT_STATE, DEFAULT)
        definition = TYPES.definition(JOINT_STATE)
        with Recording.create(path.parent, path.name, TYPES,
                              custom_data={'flex_planner': VERSION}) as recording:
            recording.attach('scenario.yaml', self._scenario(settings).encode(),
                             media_type='application/yaml', time_ns=began)
            before, after = in_order(motion.states, began)
            for received, data in before:
                recording.copy(topic, definition, data, received)
            recording.write(self._joints, motion.trajectory, began)
            for received, data in after:
                recording.copy(topic, definition, data, received)
        _remove_old(settings, path)
        return path

    def _write_states(self, recording: Recording, state: RequestState, plan: Plan,
                      reference: SampledPlan, ready: int) -> None:
        """Write the samples of a plan that is ready at a time [ns]."""
        names = [*state.settings.joint_names, *plan.arm.passive_names]
        stamps, definition = reference.times_ns + ready, TYPES.definition(JOINT_STATE)
        encoded = encode_states(reference.samples, names, stamps)
        for k, (stamp, data) in enumerate(zip(stamps.tolist(), encoded, strict=True)):
            if state.stopping():
                raise RecordingError(f'writing stopped after {k} of {len(stamps)} samples')
            recording.copy(self._states, definition, data, stamp)

    def _name(self, stamp: int, kind: str) -> str:
        """Return a name that sorts by kind and time and is not used twice."""
        moment = datetime.fromtimestamp(stamp // 10**9, timezone.utc)
        return f'{kind}_{moment:%Y%m%dT%H%M%S}_{stamp % 10**9:09d}_{next(self._numbers):04d}'

    def _scenario(self, settings: PlannerSettings) -> str:
        """Return arm and parameters as YAML, which takes longer than all else of a recording."""
        known = self._described
        if known is None or known[0] != settings:
            known = self._described = settings, format_yaml(
                {'arm': plain_arm(self._arm), 'parameters': dict(as_mapping(settings))})
        return known[1]


def _remove_old(settings: PlannerSettings, newest: Path) -> None:
    """Remove recordings beyond the bounds of the parameters, which is logged."""
    most, most_bytes = settings.max_recordings, settings.max_total_recording_size
    if not most and not most_bytes:
        return
    try:
        removed = remove_oldest(find_recordings(newest.parent, NAME), newest, most=most,
                                most_bytes=most_bytes)
    except OSError as error:
        _LOG.warning('an old recording cannot be removed: %s', error)
        return
    bounds = [text for bound, text in ((most, f'max_recordings is {most}'), (
        most_bytes, f'max_total_recording_size is {most_bytes} bytes')) if bound]
    for recording in removed:
        _LOG.info('removed the recording %s of %d bytes: %s', recording.path, recording.size,
                  ', '.join(bounds))
