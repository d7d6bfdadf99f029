"""Pictures are written for every kind of arm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.arms.arm import Arm, Joint, Motor
from flex_planner.capacity.incremental import PayloadTrial
from flex_planner.capacity.results import MaxPayload, PayloadFront, PayloadMethod
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan import PlanStatus
from flex_planner.plotting import draw_max_payload, draw_motion, Execution, Motion
from flex_planner.plotting.figures import save
import matplotlib
from matplotlib import image
from matplotlib.figure import Figure
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


def search(arm: Arm, method: PayloadMethod, **found: Any) -> MaxPayload:
    """Return a search, whether or not it would have gone like that."""
    task = Task(arm=arm, start_positions=[0, 1], goal_positions=[1, 1], duration=1.0)
    return MaxPayload(task=task, method=method, message='', **{
        'status': PlanStatus.SOLVED, 'payload': 2.0, 'upper': 2.001, **found})


def trials(*outcomes: tuple[float, bool, float]) -> tuple[PayloadTrial, ...]:
    return tuple(PayloadTrial(payload=payload, step=1.0, solved=solved, boundary_error=error,
                              result=None) for payload, solved, error in outcomes)


FRONT = PayloadFront(payloads=np.array([1.0, 1.9, 2.0]), efforts=np.array([1.0, 3.0, 4.0]),
                     prices=np.array([1.0, 20.0, 300.0]))
MET = {'front': FRONT}
TRIED = {'trials': trials((1, True, 1e-18), (2, True, 0.0), (3, False, np.inf), (2.5, False, 1))}
FAILED = {'status': PlanStatus.NOT_CONVERGED, 'payload': 0.0, 'upper': np.inf}


@pytest.mark.parametrize(('method', 'found'), [
    (PayloadMethod.DIRECT, MET), (PayloadMethod.INCREMENTAL, TRIED),
    (PayloadMethod.DIRECT, FAILED), (PayloadMethod.INCREMENTAL, FAILED),
    (PayloadMethod.INCREMENTAL, {'trials': trials((1, False, np.inf)), **FAILED})])
def test_search_for_the_largest_payload_is_drawn(tmp_path: Path, rigid_arm: Arm,
                                                 method: PayloadMethod,
                                                 found: dict[str, Any]) -> None:
    path = tmp_path / 'payload.png'
    carried = motion(rigid_arm) if 'status' not in found else None
    draw_max_payload(path, search(rigid_arm, method, **found), NAMES, carried)
    assert np.ptp(pixels(path)[..., :3]) > 0.9  # not blank


def test_picture_is_written_whole_or_not_at_all(tmp_path: Path,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: Figure, path: Path, **options: Any) -> None:
        path.write_bytes(b'half')
        raise KeyboardInterrupt

    path = tmp_path / 'picture.png'
    path.write_bytes(b'whole')
    monkeypatch.setattr(Figure, 'savefig', interrupted)
    with pytest.raises(KeyboardInterrupt):
        save(Figure(), path)
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [
        ('picture.png', b'whole')]
