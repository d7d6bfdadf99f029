"""``flex-planner identify`` reads recordings, tables and drives, and writes an arm file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace as Message
from typing import Any

from bench.recorded_motions import record_motion
from flex_planner.arms.arm_files import load_arm
from flex_planner.base.yaml_text import parse_yaml
from flex_planner.cli import main
from flex_planner.control.joint_controller import Gains
from flex_planner.control.joint_reference import JointReference
from flex_planner.identification.drive import Drive
from flex_planner.identification.joint_log import JointLog
from flex_planner.identification.plant_parameters import arm_with
from flex_planner.logs.recorded_log import read_recorded_logs
from flex_planner.recording import MessageTypes, Recording, Topic
from flex_planner.reports.arm_file import format_arm_file
import numpy as np
import pytest

TRUTH = [0.11, 0.9, 0.01, 0.02, 0.01, 0.012, 0.0, 1e-3]
DRIVE = Drive(gains=Gains.of(1, 4.0, 0.3), speed_filter=50.0)
DRIVE_FILE = 'rate: 1000\nstiffness: 4\ndamping: 0.3\nspeed_filter: 50\n'
STATES = Topic('/joint_states', 'sensor_msgs/msg/JointState')
TRAJECTORY = Topic('/joint_trajectory', 'trajectory_msgs/msg/JointTrajectory')
NAMES, BEGIN = ['elbow'], 100.0  # [s], on the clock of the recordings


def swing() -> JointReference:
    """Return a turn by 1 rad within half a second."""
    s, T = np.linspace(0, 1, 101)[:, None], 0.5
    return JointReference(
        times=s[:, 0] * T, positions=s**3 * (10 - 15 * s + 6 * s**2),
        velocities=30 * s**2 * (1 - s)**2 / T, accelerations=60 * s * (1 - s) * (1 - 2 * s) / T**2,
        torques=8 * s * (1 - s) * (1 - 2 * s) / T**2)


def stamp(time: float) -> Message:
    """Return a time as messages have it."""
    seconds = int(time)
    return Message(sec=seconds, nanosec=round((time - seconds) * 1e9))


def record_log(folder: Path, log: JointLog) -> Path:
    """Write a recording of a log; a joint state has the effort of the period before."""
    assert log.reference is not None
    efforts = np.vstack([log.torques[:1], log.torques[:-1]])
    reference = log.reference
    points = [Message(positions=list(q), velocities=list(v), accelerations=list(a),
                      effort=list(u), time_from_start=stamp(float(t)))
              for t, q, v, a, u in zip(reference.times, reference.positions,
                                       reference.velocities, reference.accelerations,
                                       reference.torques, strict=True)]
    with Recording.create(folder, 'swing', MessageTypes.load()) as recording:
        sent = False
        for time, angle, effort in zip(log.times, log.angles, efforts, strict=True):
            if time >= -1e-9 and not sent:
                recording.write(TRAJECTORY, Message(
                    header=Message(stamp=stamp(BEGIN), frame_id=''), joint_names=NAMES,
                    points=points), int(BEGIN * 1e9))
                sent = True
            recording.write(STATES, Message(
                header=Message(stamp=stamp(BEGIN + time), frame_id=''), name=['other', *NAMES],
                position=[0.0, *angle], velocity=[], effort=[0.0, *effort]),
                round((BEGIN + time) * 1e9))
    return recording.path


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with an arm, a drive, and a recording of one motion."""
    folder = tmp_path_factory.mktemp('identify')
    arm = load_arm('single_link')
    arm = replace(arm, links=(arm.links[0].with_modes(1),))
    (folder / 'arm.yaml').write_text(format_arm_file(arm))
    (folder / 'drive.yaml').write_text(DRIVE_FILE)
    record_log(folder, record_motion(arm_with(arm, TRUTH), TRUTH[0], DRIVE, swing(), 1.0,
                                     delay=1e-3, resolution=0.0))
    return folder


def test_recording_is_read_as_it_was_made(folder: Path) -> None:
    log, = read_recorded_logs(folder / 'swing', 1, names=NAMES)
    assert log.reference is not None and log.rate == pytest.approx(1000, rel=1e-3)
    assert log.times[0] == pytest.approx(log.reference_start - 0.02, abs=1e-6)
    assert log.reference.motion(0.25)[0] == pytest.approx([0.5], abs=1e-6)
    # the torque of the drive is that of the sample, not of the one before
    angle, torque = log.angles[20, 0], log.torques[20, 0]
    assert torque == pytest.approx(swing().torque(1e-3)[0] - 4.0 * angle, abs=0.02)


def test_arm_file_has_what_was_found(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = folder / 'found.yaml'
    code = main(['identify', str(folder / 'arm.yaml'), str(folder / 'swing'), '-o', str(output),
                 '--drive', str(folder / 'drive.yaml'), '--payload', '0.1', '--more-modes', '0'])
    text = capsys.readouterr().out
    assert code == 0 and 'closed loop' in text and 'record a second motion' in text
    arm = load_arm(output)
    assert arm.links[0].flexural_rigidity == pytest.approx(0.9, rel=2e-3)
    assert arm.joints[0].motor.rotor_inertia == pytest.approx(0.012, rel=1e-2)
    details: Any = parse_yaml((folder / 'found_identification.yaml').read_text())
    payload = details['parameters'][0]
    assert (payload['name'], payload['verdict']) == ('payload_mass', 'identified')
    assert payload['value'] == pytest.approx(0.11, rel=2e-3)


def test_motions_to_record_are_planned_there_and_back(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'drive.yaml').write_text('rate: 500\nstiffness: 40\ndamping: 4\n')
    code = main(['excite', 'korayem_rigid', '--from', '0.5,0', '--to', '0.5,0.5', '--duration',
                 '1', '--payload', '1', '--drive', str(tmp_path / 'drive.yaml'), '--output',
                 str(tmp_path / 'motions')])
    assert code == 0 and 'payload_mass' in capsys.readouterr().out
    there, back = (np.genfromtxt(tmp_path / 'motions' / f'{name}.csv', delimiter=',', names=True)
                   for name in ('there', 'back'))
    for name in ('qd1', 'qd2'):
        assert (there[name][0], there[name][-1]) == pytest.approx((back[name][-1], back[name][0]))
    assert there['t'][1] == pytest.approx(2e-3) and there['t'][-1] > 1.9


@pytest.mark.parametrize(('options', 'message'), [
    (['--free', 'mass'], "free is 'mass', but must be"),
    (['--topic', '/states'], 'must have one topic of joint states'),
    (['--joints', 'wrist'], 'has the joints wrist'),
    (['--method', 'closed-loop'], 'needs the law of the drive')])
def test_what_does_not_fit_is_refused(folder: Path, capsys: pytest.CaptureFixture[str],
                                      options: list[str], message: str) -> None:
    code = main(['identify', str(folder / 'arm.yaml'), str(folder / 'swing'), *options,
                 '-o', str(folder / 'no.yaml')])
    assert code == 1 and message in capsys.readouterr().err
    assert not (folder / 'no.yaml').exists()
