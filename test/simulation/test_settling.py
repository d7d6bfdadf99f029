"""What is left of a motion after the arrival."""

from __future__ import annotations

from flex_planner.arms.arm import Arm
from flex_planner.arms.kinematics import tip_position
from flex_planner.control.extent import peak_to_peak
from flex_planner.simulation.mismatch import Mismatch
from flex_planner.simulation.settling import (
    ArrivalWatch,
    bending_peak_to_peak,
    ResidualVibration,
)
import numpy as np
import pytest
from spatial_arms import flexible_3r


def test_extent_is_that_of_the_widest_direction() -> None:
    angles = np.linspace(0, 2 * np.pi, 1000)
    ellipse = np.stack([3 * np.cos(angles), np.sin(angles)], axis=-1)
    turn = np.array([[np.cos(0.7), np.sin(0.7)], [-np.sin(0.7), np.cos(0.7)]])
    assert peak_to_peak(ellipse @ turn + 5) == pytest.approx(6, rel=5e-5)
    assert peak_to_peak(np.ones((4, 2))) == 0


def test_bending_is_the_travel_of_the_middle_of_a_supported_link(ei50_arm: Arm) -> None:
    swing = np.zeros((200, 6))
    swing[:, 4] = 2e-3 * np.sin(np.linspace(0, 20, 200))  # first mode of the second link
    assert bending_peak_to_peak(ei50_arm, swing) == pytest.approx(4e-3, rel=1e-3)


def test_rigid_arm_does_not_bend(rigid_arm: Arm) -> None:
    assert ResidualVibration.of(rigid_arm,
                                np.array([[0.0, 1.0], [0.1, 1.0]])) == ResidualVibration(
        tip=pytest.approx(2 * 0.878 * np.sin(0.05), rel=1e-3), bending=0.0)


def test_watch_takes_the_window_after_the_arrival_once(rigid_arm: Arm) -> None:
    watch, results = ArrivalWatch(rigid_arm, 0.5), []
    watch.expect(1.0)
    for time in np.arange(0, 2.0, 0.01):
        watch.see(time, np.array([time, 1.0, 0.0, 0.0]))
        results.append(watch.result(time))
    found = [result for result in results if result is not None]
    ends = tip_position(rigid_arm, np.array([[1.0, 1.0], [1.5, 1.0]]))
    assert len(found) == 1
    assert found[0].tip == pytest.approx(np.linalg.norm(ends[1] - ends[0]), rel=1e-3)


def test_watch_begins_anew_with_a_new_motion(rigid_arm: Arm) -> None:
    watch = ArrivalWatch(rigid_arm, 0.5)
    watch.expect(0.0)
    watch.see(0.4, np.zeros(4))
    watch.expect(1.0)
    assert watch.result(0.6) is None
    watch.see(1.2, np.zeros(4))
    assert watch.result(1.6) == ResidualVibration(tip=0.0, bending=0.0)


def test_extent_in_space_is_that_of_the_widest_direction() -> None:
    rng = np.random.default_rng(3)
    ball = rng.normal(size=(4000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    widest = peak_to_peak(ball * [3, 1, 0.5] @ turn + 5)
    assert widest == pytest.approx(6, rel=5e-3)
    # of two points, wherever they are
    for a, b in rng.normal(size=(50, 2, 3)):
        distance = np.linalg.norm(a - b)
        assert 0.998 * distance < peak_to_peak(np.array([a, b])) <= distance * (1 + 1e-12)


def test_link_in_space_bends_in_both_planes() -> None:
    arm = flexible_3r()
    swing = np.zeros((400, arm.n_coordinates))
    turns = np.linspace(0, 20, 400)
    part = arm.modal_slices[1]
    swing[:, part] = 2e-3 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    shape = arm.links[1].beam.bend(arm.links[1].length, 0).tip_deflection
    assert bending_peak_to_peak(arm, swing) == pytest.approx(4e-3 * abs(shape[0]), rel=1e-3)


def test_simulated_arm_in_space_may_have_other_modes_and_be_softer() -> None:
    arm = flexible_3r()
    softer = Mismatch(modes=2, rigidity_scale=0.8).apply(arm)
    assert [link.modes for link in softer.links] == [0, 4, 4]
    np.testing.assert_allclose(softer.flexural_rigidities(),
                               0.8 * arm.flexural_rigidities())
    assert Mismatch(modes=0).apply(arm).n_modes == 0
