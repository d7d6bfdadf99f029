"""Logs from recordings of ROS 2: joint states, and the trajectories that a controller followed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from flex_planner.base.validation import Array
from flex_planner.control.joint_reference import JointReference
from flex_planner.identification.experiments import LogError
from flex_planner.identification.joint_log import FEWEST_SAMPLES, JointLog
from flex_planner.recording import MessageTypes, read_metadata, read_recording, shown_path
import numpy as np

STATES, TRAJECTORIES = 'sensor_msgs/msg/JointState', 'trajectory_msgs/msg/JointTrajectory'
_LEAD = 0.05  # [s] before a trajectory, in which the arm is at rest
_RECEIPT = 0.1  # [s], from a recorder's receipt of a trajectory to a controller's


def read_recorded_logs(path: Path, joints: int, *, topic: str = '',
                       names: Sequence[str] = ()) -> list[JointLog]:
    """
    Return the motions of a recording: one for each trajectory, or all of it without any.

    Efforts of joint states are taken for those of the period that ends with the sample, as
    ros2_control reads them and the simulator publishes them. A trajectory begins at its stamp; if
    it has none, somewhere about the time when it was received, which a fit in closed loop finds.

    Parameters
    ----------
    path : pathlib.Path
        Folder of the recording, or its .mcap file.
    joints : int
        n.
    topic : str
        Of the joint states; by default the one that ends with ``joint_states``.
    names : sequence of str
        Of the joints, from the base outwards; by default as the trajectory has them, or the
        states.

    Raises
    ------
    LogError
        If there are no joint states, several topics of them, or other joints.
    RecordingError
        If the recording cannot be read.

    """
    states, trajectories = _find_topics(path, topic)
    messages = list(read_recording(path, MessageTypes.load(), {states, *trajectories}))
    samples = [(_stamp(one.message.header, one.log_time_ns), one.message)
               for one in messages if one.topic.name == states]
    followed = [(_stamp(one.message.header, one.log_time_ns), one.message)
                for one in messages if one.topic.name in trajectories and one.message.points]
    order = list(names) or _names((followed or samples)[0][1])
    if len(order) != joints or any(name not in samples[0][1].name for name in order):
        raise LogError(f'{shown_path(path)} has the joints {", ".join(order)}, but the arm has '
                       f'{joints}: say which with --joints')
    return _split(shown_path(path), samples, followed, order)


def _find_topics(path: Path, wanted: str) -> tuple[str, set[str]]:
    """Return the topic of the joint states, and those of trajectories."""
    topics = [(one.topic.name, one.definition.type_name)
              for one in read_metadata(path).topics if one.message_count]
    states = [name for name, kind in topics if kind == STATES]
    chosen = [name for name in states if name == wanted or not wanted
              and name.rsplit('/', 1)[-1] == 'joint_states']
    if len(chosen) != 1:
        raise LogError(f'{shown_path(path)} must have one topic of joint states, and has '
                       f'{", ".join(chosen or states) or "none"}: say which with --topic')
    return chosen[0], {name for name, kind in topics if kind == TRAJECTORIES}


def _names(message: Any) -> list[str]:
    """Return the names of joints in a trajectory or a state."""
    return list(message.joint_names if hasattr(message, 'joint_names') else message.name)


def _stamp(header: Any, received_ns: int) -> float:
    """Return the time of a message [s]."""
    stamp = header.stamp.sec + header.stamp.nanosec * 1e-9
    return float(stamp or received_ns * 1e-9)


def _is_stamped(message: Any) -> bool:
    """Return whether a message says its time."""
    return bool(message.header.stamp.sec or message.header.stamp.nanosec)


def _split(name: str, samples: Sequence[tuple[float, Any]],
           followed: Sequence[tuple[float, Any]], order: Sequence[str]) -> list[JointLog]:
    """Return a log for each trajectory, up to the next one."""
    origin = samples[0][0]
    times = np.array([time - origin for time, _ in samples])
    columns = [list(samples[0][1].name).index(joint) for joint in order]
    angles = np.array([one.position for _, one in samples])[:, columns]
    efforts = [one.effort for _, one in samples]
    has_torques = all(len(one) == len(samples[0][1].name) for one in efforts)
    # the torque that a sample begins with is said by the next one
    torques = (np.array(efforts)[1:, columns] if has_torques
               else np.zeros((0, len(order))))
    times, angles = (times[:-1], angles[:-1]) if has_torques else (times, angles)
    if not followed:
        return [JointLog(name=name, times=times, angles=angles, torques=torques)]
    begins = [time - origin for time, _ in followed]
    ends = [*begins[1:], np.inf]
    logs = []
    for i, (begin, end) in enumerate(zip(begins, ends, strict=True)):
        unknown = 0.0 if _is_stamped(followed[i][1]) else _RECEIPT
        used = (times >= begin - _LEAD - unknown) & (times < end)
        if used.sum() >= FEWEST_SAMPLES:
            logs.append(JointLog(
                name=f'{name}, trajectory {i + 1}', times=times[used], angles=angles[used],
                torques=torques[used] if has_torques else torques,
                reference=_reference(followed[i][1], order, angles[used][0]),
                reference_start=begin,
                reference_start_error=unknown))
    if not logs:
        raise LogError(f'{name} has no trajectory with {FEWEST_SAMPLES} joint states')
    return logs


def _reference(message: Any, order: Sequence[str], start: Array) -> JointReference:
    """Return a trajectory; what its points lack is derived or none."""
    columns = [list(message.joint_names).index(joint) for joint in order]
    times = np.array([point.time_from_start.sec + point.time_from_start.nanosec * 1e-9
                      for point in message.points])

    def column(field: str) -> Array | None:
        rows = [getattr(point, field) for point in message.points]
        full = all(len(row) == len(message.joint_names) for row in rows)
        return np.array(rows)[:, columns] if full else None

    positions = column('positions')
    if positions is None:
        raise LogError('a recorded trajectory has points without positions')
    speeds = column('velocities')
    if speeds is None:
        speeds = np.gradient(positions, times, axis=0)
    accelerations, torques = column('accelerations'), column('effort')
    return JointReference(
        times=times, positions=positions, velocities=speeds,
        accelerations=(np.gradient(speeds, times, axis=0) if accelerations is None
                       else accelerations),
        torques=np.zeros_like(positions) if torques is None else torques,
    ).after(start, np.zeros_like(start),
            np.zeros_like(start) if torques is None else torques[0])
