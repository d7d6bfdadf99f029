"""The contents of the recording of one request."""

from __future__ import annotations

from datetime import datetime, timezone
import itertools
from pathlib import Path
import time

from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import plain_arm
from flex_planner.base.errors import RecordingError
from flex_planner.base.version import VERSION
from flex_planner.planning.plan import Plan
from flex_planner.planning.sampling import SampledPlan
from flex_planner.recording import (
    DEFAULT,
    definition_folder,
    LATCHED,
    MessageTypes,
    Recording,
    Topic,
)
from flex_planner.ros.messages.plans import reference_state
from flex_planner.ros.planner.outcome import Outcome
from flex_planner.ros.planner.request_state import RequestState
from flex_planner.ros.runtime.parameters import as_mapping
from flex_planner.ros.settings.planner import PlannerSettings
from flex_planner_interfaces.msg import MotionTask, PlanReport
import yaml


class OutcomeRecorder:
    """
    Writes one recording per request.

    The request comes first, at the time it was accepted; report and trajectories follow when
    they were ready, then the samples at the times a controller would reach them.

    Parameters
    ----------
    arm : Arm
        Described in an attachment.
    namespace : str
        Full name of the node, which the topics start with.

    """

    def __init__(self, arm: Arm, namespace: str) -> None:
        self._arm = arm
        self._types = MessageTypes.load([definition_folder('flex_planner_interfaces')])
        self._numbers = itertools.count(1)
        interfaces = 'flex_planner_interfaces/msg/'
        self._task = Topic(f'{namespace}/motion_task', f'{interfaces}MotionTask')
        self._report = Topic(f'{namespace}/plan_report', f'{interfaces}PlanReport')
        self._search = Topic(f'{namespace}/payload_search', f'{interfaces}PayloadSearch')
        self._joints = Topic(f'{namespace}/joint_trajectory',
                             'trajectory_msgs/msg/JointTrajectory', LATCHED)
        self._flexible = Topic(f'{namespace}/flexible_trajectory',
                               f'{interfaces}FlexibleTrajectory', LATCHED)
        self._states = Topic(f'{namespace}/reference_states', 'sensor_msgs/msg/JointState',
                             DEFAULT)

    def write(self, task: MotionTask, state: RequestState, outcome: Outcome) -> Path:
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

        Raises
        ------
        RecordingError
            If it cannot be written; nothing is left behind then.

        """
        settings, stamp, report = state.settings, state.stamp_ns, outcome.report
        ready = stamp + report.planning_time.sec * 10**9 + report.planning_time.nanosec
        path = settings.output_folder() / self._name(
            stamp, 'plan_path' if outcome.search is None else 'find_max_payload')
        report.recording = str(path)
        with Recording.create(path.parent, path.name, self._types,
                              custom_data={'flex_planner': VERSION},
                              max_bytes=settings.max_recording_size or None) as recording:
            recording.attach('scenario.yaml', self._scenario(settings).encode(),
                             media_type='application/yaml', time_ns=stamp)
            recording.write(self._task, task, stamp)
            recording.write(self._report, report, ready)
            if outcome.search is not None:
                recording.write(self._search, outcome.search, ready)
            if outcome.plan is not None and outcome.reference is not None:
                recording.write(self._joints, outcome.trajectory.joint_trajectory, ready)
                recording.write(self._flexible, outcome.trajectory, ready)
                self._write_states(recording, state, outcome.plan, outcome.reference, ready)
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
        report.execution_recording = str(path)
        with Recording.create(path.parent, path.name, self._types,
                              custom_data={'flex_planner': VERSION}) as recording:
            recording.attach('scenario.yaml', self._scenario(settings).encode(),
                             media_type='application/yaml', time_ns=now)
            recording.write(self._task, task, now)
            recording.write(self._report, report, now)

    def _write_states(self, recording: Recording, state: RequestState, plan: Plan,
                      reference: SampledPlan, ready: int) -> None:
        """Write the samples of a plan that is ready at a time [ns]."""
        names = [*state.settings.joint_names, *plan.arm.modal_names]
        for k, passed in enumerate(reference.times_ns):
            if state.stopping():
                raise RecordingError(f'writing stopped after {k} of {len(reference.times_ns)} '
                                     'samples')
            stamp = ready + int(passed)
            message = reference_state(plan, reference.samples, k, names, stamp)
            recording.write(self._states, message, stamp)

    def _name(self, stamp: int, kind: str) -> str:
        """Return a name that sorts by kind and time and is not used twice."""
        moment = datetime.fromtimestamp(stamp // 10**9, timezone.utc)
        return f'{kind}_{moment:%Y%m%dT%H%M%S}_{stamp % 10**9:09d}_{next(self._numbers):04d}'

    def _scenario(self, settings: PlannerSettings) -> str:
        """Return arm and parameters as YAML."""
        text: str = yaml.safe_dump({'arm': plain_arm(self._arm),
                                    'parameters': dict(as_mapping(settings))}, sort_keys=False)
        return text
