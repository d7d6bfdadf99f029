"""Parameters of a simulated arm are found from its logs, and what cannot be found is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from bench.recorded_motions import LSB, record_motion
from flex_planner.arms.arm import Arm
from flex_planner.arms.arm_files import load_arm
from flex_planner.control.joint_controller import Gains
from flex_planner.control.joint_reference import JointReference
from flex_planner.identification.drive import Drive
from flex_planner.identification.excitation import predict_identification
from flex_planner.identification.experiments import LogError, Method
from flex_planner.identification.identification import (
    Finding,
    Identification,
    judge_estimate,
    Verdict,
)
from flex_planner.identification.identify import ALL, identify
from flex_planner.identification.joint_log import JointLog
from flex_planner.identification.plant_parameters import (
    arm_with,
    list_parameters,
    parameters_of,
    Quantity,
)
from flex_planner.optimal_control.task import Task
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.sampling import sample_plan, SamplingSettings
import numpy as np
import pytest

PAYLOAD, DELAY = 0.11, 1.4e-3
# payload, E I, damping ratio, viscous and Coulomb friction, rotor, offset, delay
TRUTH = np.array([PAYLOAD, 0.9, 0.01, 0.02, 0.01, 0.012, 0.0, DELAY])
DRIVE = Drive(gains=Gains.of(1, 4.0, 0.3), speed_filter=50.0)


def one_link(modes: int = 1) -> Arm:
    """Return a light arm that is assumed to have no friction, and a rotor of its own."""
    arm = load_arm('single_link')
    return replace(arm, links=tuple(link.with_modes(modes) for link in arm.links))


def true_arm(modes: int = 1) -> Arm:
    """Return the arm that moves."""
    return arm_with(one_link(modes), TRUTH)


def swing(size: float, seconds: float = 0.5) -> JointReference:
    """Return a motion of a polynomial of fifth order, with the torque of a stiff arm."""
    times = np.linspace(0, seconds, 101)
    s = times / seconds
    position = size * (10 * s**3 - 15 * s**4 + 6 * s**5)
    speed = size * (30 * s**2 - 60 * s**3 + 30 * s**4) / seconds
    acceleration = size * (60 * s - 180 * s**2 + 120 * s**3) / seconds**2
    return JointReference(times=times, positions=position[:, None], velocities=speed[:, None],
                          accelerations=acceleration[:, None],
                          torques=0.14 * acceleration[:, None])


def record(modes: int = 1, *, resolution: float = 0.0, every: int = 1,
           sizes: Sequence[float] = (1.2, -0.8)) -> list[JointLog]:
    """Return logs of the true arm."""
    return [record_motion(true_arm(modes), PAYLOAD, DRIVE, swing(size), 1.2, delay=DELAY,
                          resolution=resolution, every=every, seed=i)
            for i, size in enumerate(sizes)]


def errors(found: Identification) -> np.ndarray:
    """Return the relative errors of all parameters but the offset, which nothing tells."""
    values = np.array([one.value for one in found.estimates])
    true = np.delete(TRUTH, -2)
    return np.abs(values - true) / true


@pytest.mark.parametrize(('method', 'resolution', 'every', 'most'), [
    (Method.CLOSED_LOOP, 0.0, 1, 1e-3),
    (Method.OUTPUT_ERROR, 0.0, 1, 1e-3),
    (Method.CLOSED_LOOP, 0.0, 10, 1e-2)])
def test_parameters_are_those_of_the_arm(method: Method, resolution: float, every: int,
                                         most: float) -> None:
    found = identify(one_link(), record(resolution=resolution, every=every), payload_mass=0.1,
                     drive=DRIVE, method=method, more_modes=0)
    assert found.method is method and found.best.rms < 0.1
    assert errors(found).max() < most
    assert {one.verdict for one in found.estimates} == {Verdict.IDENTIFIED}
    assert found.left_out.min() > 99.9 and not found.warnings


def test_fits_of_a_wrong_model_that_agree_are_no_evidence() -> None:
    parameter = list_parameters(1)[0]

    def judged(*, withheld: bool) -> Verdict:
        return judge_estimate(parameter, 1.0, 1.0, 0.01, 0.001, free=True,
                              withheld=withheld).verdict

    assert (judged(withheld=False), judged(withheld=True)) == (Verdict.IDENTIFIED, Verdict.WEAK)


@pytest.mark.parametrize('late', [-0.0312, 0.0173])
def test_start_of_a_motion_that_is_not_known_is_found(late: float) -> None:
    logs = [replace(log, reference_start=-late, reference_start_error=0.05)
            for log in record(every=10)]
    found = identify(one_link(), logs, payload_mass=0.1, drive=DRIVE, more_modes=0)
    assert found.best.late == pytest.approx([late, late], abs=5e-5)
    assert errors(found).max() < 1e-2


def test_rounded_angles_lead_into_the_intervals() -> None:
    found = identify(one_link(), record(resolution=LSB), payload_mass=0.1,
                     drive=replace(DRIVE, resolution=LSB), more_modes=0)
    widths = np.array([one.half_width for one in found.estimates]) / np.delete(TRUTH, -2)
    assert 0.8 < found.best.rms < 1.25
    # intervals of 95 %: three of them bound nearly all
    assert (errors(found) < 3 * widths).all()


def test_intervals_are_those_that_were_predicted() -> None:
    known = replace(DRIVE, resolution=LSB)
    found = identify(one_link(), record(resolution=LSB, every=10), payload_mass=0.1, drive=known,
                     more_modes=0)
    predicted = predict_identification(
        found.identified_arm(), [swing(1.2), swing(-0.8)], known,
        payload_mass=found.payload_mass, settling=0.7)
    assert [one.parameter for one in predicted] == [one.parameter for one in found.estimates]
    for one, estimate in zip(predicted, found.estimates, strict=True):
        # errors of one log are not exactly as large as expected
        assert one.half_width == pytest.approx(estimate.half_width, rel=0.5)
    assert not any(one.is_weak for one in predicted)
    slow = predict_identification(found.identified_arm(), [swing(0.01, 5.0)], known,
                                  payload_mass=found.payload_mass)
    assert slow[1].is_weak


def test_input_error_finds_what_the_motors_have_to_move() -> None:
    found = identify(one_link(), record(), payload_mass=0.1, method=Method.INPUT_ERROR,
                     more_modes=0)
    # payload and E I; smoothing of the angles costs what it lets not pass
    assert errors(found)[:2].max() < 0.02
    assert found.left_out.min() > 95


def test_arm_with_more_modes_than_planned_for_is_told_and_found() -> None:
    truth = TRUTH.copy()
    truth[1] = 0.1  # so soft that further modes are seen
    logs = [record_motion(arm_with(one_link(3), truth), PAYLOAD, DRIVE, swing(1.2), 1.2,
                          delay=DELAY, resolution=0.0)]
    arm = arm_with(one_link(), [0.0, 0.11, *parameters_of(one_link(), 0.0)[2:]])
    poor = identify(arm, logs, payload_mass=0.1, drive=DRIVE, more_modes=0)
    assert poor.has(Finding.NOT_THE_PLANT) and np.isnan(poor.estimates[0].half_width)
    found = identify(arm, logs, payload_mass=0.1, drive=DRIVE, more_modes=2)
    assert found.has(Finding.MODES_MATTER) and found.identified_arm().n_modes == 3
    for one in (poor, found):
        assert one.payload_mass == pytest.approx(PAYLOAD, rel=0.02)
        assert one.estimates[1].value == pytest.approx(0.1, rel=0.05)


def test_arm_that_still_moves_when_a_motion_begins_is_told_and_taken_into_account() -> None:
    # of the bending, about 0.4 mm at the tip, and the speed of joint and mode
    away = np.array([2e-4, 0.02, 0.0])
    log = record_motion(true_arm(), PAYLOAD, DRIVE, swing(1.2), 1.0, delay=DELAY, every=10,
                        away=away)
    found = identify(one_link(), [log], payload_mass=0.1, drive=replace(DRIVE, resolution=LSB),
                     more_modes=0)
    assert found.has(Finding.BEGAN_IN_MOTION) and 0.8 < found.best.rms < 1.25
    widths = np.array([one.half_width for one in found.estimates]) / np.delete(TRUTH, -2)
    assert (errors(found) < 3 * widths).all()


def test_what_is_not_free_stays() -> None:
    found = identify(one_link(), record(sizes=(1.2,)), payload_mass=PAYLOAD, drive=DRIVE,
                     free=ALL - {Quantity.PAYLOAD}, more_modes=0)
    assert found.estimates[0].verdict is Verdict.FIXED and found.payload_mass == PAYLOAD
    assert found.has(Finding.ONE_LOG)
    arm = found.identified_arm('Identified.')
    assert parameters_of(arm, PAYLOAD, found.delay) == pytest.approx(found.best.values)
    assert arm.source.endswith('Identified.')


@pytest.mark.parametrize(('every', 'changes', 'message'), [
    (10, {}, 'torques at 100 Hz'),
    (1, {'torques': np.zeros((0, 0))}, 'no torques'),
    (1, {'angles': np.linspace(0, 1, 1220)[:, None]}, 'begins in motion')])
def test_logs_that_say_too_little_are_refused(every: int, changes: dict[str, Any],
                                              message: str) -> None:
    log = replace(record(every=every, sizes=(0.5,))[0], **changes)
    with pytest.raises(LogError, match=message):
        identify(one_link(), [log])


def test_two_links_are_identified_from_two_plans() -> None:
    arm = load_arm('clamped_motors')
    truth = np.array([1.1, 45, 54, 0.01, 0.015, 0.3, 0.2, 0.08, 0.05, 0.03, 0.02, 0, 0.012,
                      DELAY])
    drive = Drive(gains=Gains.of(2, 40.0, 4.0), speed_filter=50.0)
    logs = []
    for start, goal in (((0.5, 0), (0.5, 0.5)), ((0.5, 0.5), (0.5, 0))):
        task = Task.between_points(arm, start, goal, elbow=-1, duration=1.0, payload_mass=1.0,
                                   effort_weights=[0.125, 0.125])
        reference = sample_plan(plan_path(task), SamplingSettings()).reference
        logs.append(record_motion(arm_with(arm, truth), 1.1, drive, reference, 2.0, delay=DELAY,
                                  offset=truth[-3:-1], resolution=0.0, every=10))
    found = identify(arm, logs, payload_mass=1.0, drive=drive, more_modes=0)
    values = np.array([one.value for one in found.estimates])
    assert values == pytest.approx(np.delete(truth, 11), rel=1e-3)
