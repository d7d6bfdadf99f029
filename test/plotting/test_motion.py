"""Pictures of motions."""

from __future__ import annotations

from pathlib import Path

from flex_planner.arms.arm import Arm, Joint, Motor
from flex_planner.plotting import draw_motion, Execution, save
import matplotlib
import numpy as np
from plotting_support import motion, pixels, TIMES
import pytest


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


@pytest.mark.parametrize(('arm', 'done'), [
    ('ei50_arm', None), ('ei50_arm', execution()), ('rigid_arm', None),
    ('unlimited_arm', execution()), ('half_limited_arm', None)])
def test_motion_is_drawn_as_png(tmp_path: Path, request: pytest.FixtureRequest, arm: str,
                                done: Execution | None) -> None:
    drawn: Arm = request.getfixturevalue(arm)
    save(draw_motion(motion(drawn), done), tmp_path / 'motion.png')
    picture = pixels(tmp_path / 'motion.png')
    assert picture.shape[0] > 600
    assert picture.shape[1] > 1000
    assert np.ptp(picture[..., :3]) > 0.9  # not blank


def test_folder_is_made_and_a_picture_replaced(tmp_path: Path, rigid_arm: Arm,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / 'new' / 'motion.png'
    monkeypatch.setitem(matplotlib.rcParams, 'backend', 'svg')
    save(draw_motion(motion(rigid_arm)), path)
    path.write_text('old')
    save(draw_motion(motion(rigid_arm), execution()), path)
    assert pixels(path).size
    assert matplotlib.rcParams['backend'] == 'svg'  # that of the user stays
