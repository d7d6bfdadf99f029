"""The rules of joint_trajectory_controller, one by one, on objects that are no messages."""

from __future__ import annotations

from collections.abc import Callable
import math
from types import SimpleNamespace
from typing import Any

from flex_planner.ros.messages.trajectory_rules import trajectory_violations
import numpy as np
import pytest

JOINTS = ['shoulder', 'elbow']


def stamp(nanoseconds: int) -> SimpleNamespace:
    return SimpleNamespace(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def trajectory() -> Any:
    """Return a trajectory of three points that breaks no rule."""
    points = [SimpleNamespace(
        time_from_start=stamp(time), positions=[0.1, 0.2], velocities=[speed, -speed],
        accelerations=[0.0, 1.0], effort=[3.0, 4.0])
        for time, speed in ((0, 0.0), (999_999_999, 0.5), (1_000_000_000, 0.0))]
    header = SimpleNamespace(stamp=stamp(0))
    return SimpleNamespace(header=header, joint_names=list(JOINTS), points=points)


def test_good_trajectory_breaks_no_rule() -> None:
    assert trajectory_violations(trajectory(), JOINTS) == []


@pytest.mark.parametrize('change', [
    lambda t: setattr(t, 'joint_names', JOINTS[::-1]),
    lambda t: setattr(t.points[0], 'velocities', [0.3, 0.0]),
    lambda t: setattr(t.points[-1], 'velocities', [1e-7, -1e-7]),  # single precision's epsilon
    lambda t: setattr(t, 'points', t.points[1:]),
    lambda t: setattr(t, 'points', t.points[-1:]),
    lambda t: setattr(t.points[1], 'effort', np.array([1.0, 2.0])),
], ids=['order of joints', 'moving at first', 'hardly moving at last', 'late start', 'one point',
        'numpy'])
def test_what_the_controller_accepts_is_accepted(change: Callable[[Any], None]) -> None:
    good = trajectory()
    change(good)
    assert trajectory_violations(good, JOINTS) == []


@pytest.mark.parametrize(('change', 'sentence'), [
    (lambda t: setattr(t, 'joint_names', ['shoulder', 'wrist']),
     "joint_names is ['shoulder', 'wrist'], but must be a permutation of ['shoulder', 'elbow']"),
    (lambda t: setattr(t, 'joint_names', ['shoulder']),
     "joint_names is ['shoulder'], but must be a permutation of ['shoulder', 'elbow']"),
    (lambda t: setattr(t, 'joint_names', ['shoulder', 'shoulder']),
     "joint_names is ['shoulder', 'shoulder'], but must be a permutation of ['shoulder', "
     "'elbow']"),
    (lambda t: setattr(t.header, 'stamp', stamp(1)),
     'header.stamp must be 0, which starts the motion on arrival'),
    (lambda t: setattr(t.header, 'stamp', stamp(10**9)),
     'header.stamp must be 0, which starts the motion on arrival'),
    (lambda t: t.points.clear(), 'points must not be empty'),
    (lambda t: setattr(t.points[0], 'time_from_start', stamp(-1)),
     'points[0].time_from_start must be >= 0'),
    (lambda t: setattr(t.points[2], 'time_from_start', stamp(999_999_999)),
     'points[2].time_from_start must be later than that of the point before'),
    (lambda t: setattr(t.points[1], 'time_from_start', stamp(0)),
     'points[1].time_from_start must be later than that of the point before'),
    (lambda t: setattr(t.points[1], 'positions', [0.1]),
     'points[1].positions has 1 entries, but must have 2'),
    (lambda t: setattr(t.points[0], 'velocities', []),
     'points[0].velocities has 0 entries, but must have 2'),
    (lambda t: setattr(t.points[2], 'accelerations', [0.0] * 3),
     'points[2].accelerations has 3 entries, but must have 2'),
    (lambda t: setattr(t.points[1], 'effort', []),
     'points[1].effort has 0 entries, but must have 2'),
    (lambda t: setattr(t.points[1], 'positions', [math.nan, 0.0]),
     'points[1].positions must be finite'),
    (lambda t: setattr(t.points[0], 'effort', [0.0, math.inf]),
     'points[0].effort must be finite'),
    (lambda t: setattr(t.points[2], 'velocities', [0.0, -2e-7]),
     'the last velocities must be 0'),
])
def test_each_broken_rule_is_one_sentence(change: Callable[[Any], None], sentence: str) -> None:
    bad = trajectory()
    change(bad)
    assert trajectory_violations(bad, JOINTS) == [sentence]


def test_all_broken_rules_are_told() -> None:
    bad = trajectory()
    bad.joint_names, bad.header.stamp = [], stamp(5)
    bad.points[1].effort = bad.points[1].positions = []
    bad.points[2].velocities = [1.0, 0.0]
    assert len(trajectory_violations(bad, JOINTS)) == 5
