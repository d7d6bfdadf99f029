"""Pictures are written for every kind of arm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.arm import Arm, Joint, Motor
from flex_planner.plotting import draw_motion, Execution, Motion
import matplotlib
from matplotlib import image
import numpy as np
import pytest

NAMES = ['shoulder', 'elbow']
TIMES = np.linspace(0, 1, 21)


def motion(arm: Arm) -> Motion:
    """Return a smooth motion, whether or not the arm would move like that."""
    shape = (TIMES.size, arm.n_coordinates)
    wave = np.sin(np.outer(TIMES, np.linspace(1, 2, arm.n_coordinates)))
    assert wave.shape == shape
    return Motion(times=TIMES, coordinates=0.1 * wave, rates=0.2 * wave, torques=wave[:, :2],
                  tip=wave[:, :2])


def execution() -> Execution:
    """Return what the arm did, with times of its own for the tip."""
    wave = np.sin(np.outer(TIMES, [1.0, 2.0]))
    return Execution(times=TIMES, positions=wave, speeds=wave, torques=wave,
                     tip_times=np.linspace(0, 2, 33), tip=np.full((33, 2), 0.1))


@pytest.fixture
def unlimited_arm(rigid_arm: Arm) -> Arm:
    return Arm(name='unlimited', links=rigid_arm.links, joints=(Joint(), Joint()))


@pytest.fixture
def half_limited_arm(rigid_arm: Arm) -> Arm:
    joints = (Joint(motor=Motor(stall_torque=3.0)), Joint())
    return Arm(name='half limited', links=rigid_arm.links, joints=joints)


def pixels(path: Path) -> Any:
    """Return a picture, read from PNG."""
    assert path.read_bytes().startswith(b'\x89PNG\r\n\x1a\n')
    return image.imread(path)


@pytest.mark.parametrize(('arm', 'done'), [
    ('ei50_arm', None), ('ei50_arm', execution()), ('rigid_arm', None),
    ('unlimited_arm', execution()), ('half_limited_arm', None)])
def test_motion_is_drawn_as_png(tmp_path: Path, request: pytest.FixtureRequest, arm: str,
                                done: Execution | None) -> None:
    drawn: Arm = request.getfixturevalue(arm)
    draw_motion(tmp_path / 'motion.png', drawn, NAMES, motion(drawn), done)
    picture = pixels(tmp_path / 'motion.png')
    assert picture.shape[0] > 600
    assert picture.shape[1] > 1000
    assert np.ptp(picture[..., :3]) > 0.9  # not blank


def test_folder_is_made_and_a_picture_replaced(tmp_path: Path, rigid_arm: Arm,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / 'new' / 'motion.png'
    monkeypatch.setitem(matplotlib.rcParams, 'backend', 'svg')
    draw_motion(path, rigid_arm, NAMES, motion(rigid_arm))
    path.write_text('old')
    draw_motion(path, rigid_arm, NAMES, motion(rigid_arm), execution())
    assert pixels(path).size
    assert matplotlib.rcParams['backend'] == 'svg'  # that of the user stays
