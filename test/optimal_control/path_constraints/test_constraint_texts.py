"""Limits as short texts: read, written, refused."""

from __future__ import annotations

from flex_planner.base.errors import InvalidValueError
from flex_planner.optimal_control.path_constraints import (
    BendingMoment,
    Capsule,
    Circle,
    Deflection,
    HalfPlane,
    JointRange,
    JointSpeed,
    KeepOut,
    PathConstraint,
    read_constraint,
    SelfClearance,
    write_constraint,
)
import pytest


@pytest.mark.parametrize(('text', 'constraint'), [
    ('keep_out:0.52,0.25,0.1;stations=4;name=post', KeepOut(
        region=Circle(center=(0.52, 0.25), radius=0.1), stations=4, name='post')),
    ('keep-out-capsule:0,0,1,0,0.1;tip_radius=0.05', KeepOut(
        region=Capsule(start=(0, 0), end=(1, 0), radius=0.1), tip_radius=0.05)),
    ('keep_out_half_plane:0,-0.2,0,1', KeepOut(
        region=HalfPlane(point=(0.0, -0.2), normal=(0.0, 1.0)))),
    ('joint_range:2,-inf,2.2', JointRange(joint=2, upper=2.2)),
    ('joint_speed:1,0.8', JointSpeed(joint=1, limit=0.8)),
    ('self_clearance:0.1;link_radius=0.02;stations=3', SelfClearance(
        base_radius=0.1, link_radius=0.02, stations=3)),
    ('bending_moment:1,0.6;stations=0.25/0.5', BendingMoment(
        link=1, limit=0.6, stations=(0.25, 0.5))),
    ('deflection:1,0.05', Deflection(link=1, limit=0.05))])
def test_texts_are_read_and_written(text: str, constraint: PathConstraint) -> None:
    assert read_constraint('limit', text) == constraint
    assert read_constraint('limit', write_constraint(constraint)) == constraint


@pytest.mark.parametrize(('text', 'said'), [
    ('wall:1,2', 'kind:values, kind '),
    ('keep_out', 'kind:values, kind '),
    ('keep_out:1,2', 'keep_out: with 3 numbers, x, y, radius'),
    ('keep_out:1,2,wide', 'numbers: x, y, radius'),
    ('keep_out:1,2,-3', r'limit \(keep_out\) radius is -3'),
    ('joint_speed:1,0.5;name=fast', 'options of joint_speed: none')])
def test_other_texts_are_refused_with_what_is_expected(text: str, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        read_constraint('limit', text)
