"""
Motions of spatial arms within limits on the way and through points of the tip.

The costs of those within limits are compared with IPOPT on Gauss collocation of three points, 30
intervals, with the limits at its points and the equations of motion as constraints.

"""

from __future__ import annotations

from dataclasses import replace

from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.kinematics import bent_distances, tip_position
from flex_planner.base.errors import InvalidValueError
from flex_planner.optimal_control.path_constraints import (
    Deflection,
    KeepOut,
    PathConstraint,
    SpatialCapsule,
    Sphere,
)
from flex_planner.optimal_control.task import Task
from flex_planner.optimal_control.via_points import ViaPoint
from flex_planner.planning.plan import Plan
from flex_planner.planning.plan_path import plan_path
import numpy as np
import pytest
from spatial_arms import yaw_pitch

TIMES = np.linspace(0, 0.8, 801)
BALL = KeepOut(region=Sphere(center=(0.63, 0.38, 0.18), radius=0.08), name='ball')
PILLAR = KeepOut(region=SpatialCapsule(start=(0.63, 0.38, 0), end=(0.63, 0.38, 0.13), radius=0.06),
                 tip_radius=0.03, name='pillar')


def within(*constraints: PathConstraint) -> Plan:
    return plan_path(Task(
        arm=yaw_pitch(), start_positions=[0, -0.2], goal_positions=[1.2, 0.3], duration=0.8,
        payload_mass=0.4, payload_inertia=1e-3, path_constraints=constraints), search='fast')


def test_tip_passes_a_ball_at_its_edge() -> None:
    plan = within(BALL)
    assert plan.solved, plan.message
    assert 'ball on its -z side' in plan.message
    away = np.linalg.norm(plan.sample(TIMES).tip - BALL.region.middle, axis=1)
    assert 0.08 - 1e-6 < away.min() < 0.0801
    # a barrier is left, see docs/path_constraints.md
    assert plan.cost == pytest.approx(19.158073, rel=1e-4)


def test_tip_passes_beside_a_pillar() -> None:
    plan = within(PILLAR)
    assert plan.solved, plan.message
    tip = plan.sample(TIMES).tip
    nearest = np.stack([np.full(801, 0.63), np.full(801, 0.38), np.clip(tip[:, 2], 0, 0.13)], -1)
    away = np.linalg.norm(tip - nearest, axis=1)
    assert 0.09 - 1e-6 < away.min() < 0.0901
    assert plan.cost == pytest.approx(19.269424, rel=2e-4)


def test_link_bends_no_further_than_it_may() -> None:
    plan = within(Deflection(link=2, limit=0.032, stations=(1.0,)))
    assert plan.solved, plan.message
    modal = plan.sample(TIMES).coordinates[:, 2:]
    bent = bent_distances(plan.arm, 1, modal, 2)[:, 1].max() / 0.7
    assert 0.0319 < bent < 0.032 + 1e-6
    assert plan.cost == pytest.approx(19.067696, rel=1e-4)


def test_point_of_an_arm_whose_tip_moves_on_a_surface_is_refused() -> None:
    task = within().task
    with pytest.raises(InvalidValueError, match=r'via_points\[0\].point .* on a surface'):
        replace(task, via_points=(ViaPoint(point=[0.6, 0.3, 0.3], time=0.4),))
    with pytest.raises(InvalidValueError, match='has 2 numbers, but must be .* 3 numbers'):
        replace(task, via_points=(ViaPoint(point=[0.6, 0.3], time=0.4),))


@pytest.mark.thorough
@pytest.mark.parametrize('time', [0.65, None])
def test_tip_passes_a_point_in_space(time: float | None) -> None:
    arm, point = load_arm('tudor_like'), np.array([0.36, 0.30, 0.22])
    plan = plan_path(Task(
        arm=arm, start_positions=[0, -0.5, 1.0], goal_positions=[1.0, -1.0, 0.6], duration=1.0,
        payload_mass=0.1, via_points=[ViaPoint(point=point, time=time)]), search='fast')
    assert plan.solved, plan.message
    assert plan.certificate.via_error < 1e-5
    passed = plan.sample(plan.via_times).coordinates[0]
    np.testing.assert_allclose(tip_position(arm, passed), point, atol=1e-9)
    if time is None:
        for other in (0.98, 1.02):  # no time near it is better
            via = ViaPoint(point=point, time=other * float(plan.via_times[0]))
            moved = plan_path(replace(plan.task, via_points=(via,)), search='fast',
                              start_from=plan)
            assert plan.cost < moved.cost < 1.1 * plan.cost
