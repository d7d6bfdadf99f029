"""Motions of a spatial arm are planned, made by a simulated arm, and tell its numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.arms.arm_files import load_arm
from flex_planner.base.yaml_text import parse_yaml
from flex_planner.cli import main
from flex_planner.control.joint_controller import Gains
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.identification.plant_parameters import arm_with, parameters_of
from flex_planner.logs.csv_log import read_csv_log
from flex_planner.simulation.joint_control import Encoder
from flex_planner.simulation.plant import Control, Plant
import numpy as np
import pytest

ARM = """
name: Yaw and pitch
source: made up
kind: spatial
gravity: [0.0, 0.0, -9.81]
joints:
  - axis: [0, 0, 1]
    viscous_friction: 0.1
    motor: {stall_torque: 40.0, no_load_speed: 6.0, max_torque: unlimited, gear_ratio: 100.0, rotor_inertia: 5.0e-6}
  - xyz: [0, 0, 0.3]
    axis: [0, 1, 0]
    viscous_friction: 0.1
    motor: {stall_torque: 60.0, no_load_speed: 6.0, max_torque: unlimited, gear_ratio: 100.0, rotor_inertia: 5.0e-6}
tip: {xyz: [0.8, 0, 0]}
links:
  - inertial: {mass: 3.0, center_of_mass: [0, 0, 0.15], inertia: [0.03, 0.03, 0.01]}
  - section: {outer_diameter: 0.02, wall: 0.001}
    density: 2700.0
    youngs_modulus: 7.0e+10
    modes: {across: 1, across2: 1}
    shape_mass: 1.0
"""  # noqa: E501
DRIVE = 'rate: 250\nstiffness: 60\ndamping: 6\nspeed_filter: 50\nresolution: 9.6e-5\n'
LSB = 9.6e-5  # [rad]
PAYLOAD, DELAY, OFFSET = 0.55, 1.2e-3, 0.004


def make_motion(folder: Path, name: str, true: Any) -> Path:
    """Let the true arm follow a table, and return the table with the angles that it said."""
    path = folder / 'motions' / f'{name}.csv'
    table = np.genfromtxt(path, delimiter=',', names=True)
    angles = np.stack([table['qd1'], table['qd2']], axis=1)
    followed = read_csv_log(_with(path, angles), 2).reference
    assert followed is not None
    plant = Plant(ArmDynamics.of(true), Control(
        gains=Gains.of(2, 60.0, 6.0), rate=250.0, delay=DELAY, limit_torques=False,
        encoder=Encoder(resolution=LSB, differentiates=True, speed_filter=50.0,
                        offsets=(0.0, OFFSET))), payload_mass=PAYLOAD, positions=angles[0])
    plant.advance(3.0)  # to rest, where the PD holds it
    plant.follow(followed)
    seen = [plant.sensor.positions]
    plant.advance(3.0 + float(table['t'][-1]), lambda one: seen.append(one.sensor.positions))
    return _with(path, np.array(seen)[:len(table)])


def _with(path: Path, angles: Any) -> Path:
    """Write the angles beside the other columns of a table into another one."""
    head, *lines = path.read_text().splitlines()
    rows = [f'{line},{q[0]!r},{q[1]!r}' for line, q in zip(lines, angles.tolist(), strict=True)]
    output = path.with_name(f'{path.stem}_log.csv')
    output.write_text('\n'.join([f'{head},q1,q2', *rows]) + '\n')
    return output


def test_spatial_arm_is_identified_from_the_motions_that_excite_plans(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arm_file, drive = tmp_path / 'arm.yaml', tmp_path / 'drive.yaml'
    arm_file.write_text(ARM)
    drive.write_text(DRIVE)
    assert main(['excite', str(arm_file), '--from-angles', '0,10', '--to-angles', '50,-20',
                 '--duration', '0.8', '--payload', '0.5', '--drive', str(drive), '--output',
                 str(tmp_path / 'motions')]) == 0
    assert 'links[1].flexural_rigidity' in capsys.readouterr().out
    arm = load_arm(arm_file)
    truth = parameters_of(arm, PAYLOAD)
    truth[2] *= 0.9  # E I of the second link
    truth[4], truth[5] = 0.01, 0.15  # its damping ratio, friction of the first joint
    logs = [make_motion(tmp_path, name, arm_with(arm, truth)) for name in ('there', 'back')]
    assert main(['identify', str(arm_file), *map(str, logs), '--drive', str(drive), '--payload',
                 '0.5', '--more-modes', '0', '-o', str(tmp_path / 'found.yaml')]) == 0
    content: Any = parse_yaml((tmp_path / 'found_identification.yaml').read_text())
    found = {one['name']: one for one in content['parameters']}
    for name, value in (('payload_mass', PAYLOAD), ('delay', DELAY),
                        ('links[1].flexural_rigidity', truth[2]),
                        ('links[1].damping_ratio', truth[4]),
                        ('joints[0].friction.viscous', truth[5]),
                        ('joints[1].encoder_offset', OFFSET)):
        assert abs(found[name]['value'] - value) <= found[name]['half_width'] < 0.35 * value, name
    assert load_arm(tmp_path / 'found.yaml').links[1].flexural_rigidity == pytest.approx(
        truth[2], rel=5e-3)
    # in the second after the arrival, not after what is held behind it
    assert 1e-3 < content['plan_residual']['before'] < 3e-3
