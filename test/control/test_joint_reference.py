"""Points of a trajectory, interpolated as joint_trajectory_controller does."""

from __future__ import annotations

from flex_planner.control.joint_reference import JointReference
import numpy as np
import pytest
from scipy.interpolate import BPoly


@pytest.fixture
def reference() -> JointReference:
    """Return random points at uneven times."""
    rng = np.random.default_rng(7)
    times = np.append(0.0, np.cumsum(rng.uniform(0.01, 0.2, 9)))
    positions, velocities, accelerations, torques = rng.normal(size=(4, 10, 2))
    return JointReference(times=times, positions=positions, velocities=velocities,
                          accelerations=accelerations, torques=torques)


def test_joints_follow_the_quintic_of_scipy(reference: JointReference) -> None:
    derivatives = np.stack([reference.positions, reference.velocities, reference.accelerations],
                           axis=1)
    spline = BPoly.from_derivatives(reference.times, derivatives)
    times = np.linspace(0, reference.times[-1] * 0.9999, 211)
    positions, velocities = reference.motion(times)
    np.testing.assert_allclose(positions, spline(times), atol=1e-12)
    np.testing.assert_allclose(velocities, spline.derivative()(times), atol=1e-10)


def test_efforts_are_linear_and_the_last_point_is_held(reference: JointReference) -> None:
    times = np.linspace(0, reference.times[-1] + 1, 101)
    expected = np.stack([np.interp(times, reference.times, column)
                         for column in reference.torques.T], axis=1)
    np.testing.assert_allclose(reference.torque(times), expected, atol=1e-12)
    positions, velocities = reference.motion(reference.times[-1] + np.array([0.0, 5.0]))
    assert positions.tolist() == [reference.positions[-1].tolist()] * 2
    assert velocities.tolist() == [reference.velocities[-1].tolist()] * 2


def test_one_time_gives_what_many_do(reference: JointReference) -> None:
    for time in (0.0, 0.123, reference.times[3], reference.times[-1], 99.0):
        many = reference.motion(np.array([time]))
        for one, row in zip(reference.motion(time), many, strict=True):
            assert one.tolist() == row[0].tolist()
        assert reference.torque(time).tolist() == reference.torque(np.array([time]))[0].tolist()


def test_reference_that_starts_late_begins_where_the_arm_is(reference: JointReference) -> None:
    late = JointReference(
        times=reference.times + 0.5, positions=reference.positions, torques=reference.torques,
        velocities=reference.velocities, accelerations=reference.accelerations)
    here = np.array([0.3, -0.2])
    led = late.after(here, 2 * here, 3 * here)
    assert led.motion(0.0)[0].tolist() == here.tolist()
    np.testing.assert_allclose(led.motion(0.0)[1], 2 * here)
    assert led.torque(0.0).tolist() == (3 * here).tolist()
    assert reference.after(here, here, here) is reference


def test_reference_that_stays_stays() -> None:
    held = JointReference.hold(np.array([1.0, 2.0]), np.array([3.0, 4.0]))
    positions, velocities = held.motion(np.array([0.0, 10.0]))
    assert positions.tolist() == [[1.0, 2.0]] * 2
    assert not velocities.any()
    assert held.torque(5.0).tolist() == [3.0, 4.0]
