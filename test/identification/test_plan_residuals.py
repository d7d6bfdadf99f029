"""What recorded motions leave behind is simulated on the arm that was found, and so are plans."""

from __future__ import annotations

from dataclasses import replace

from bench.coverage import single_link
from flex_planner.control.joint_controller import Gains
from flex_planner.control.joint_reference import JointReference
from flex_planner.identification.experiments import Method
from flex_planner.identification.fit import Fit
from flex_planner.identification.identification import Identification
from flex_planner.identification.joint_log import JointLog
from flex_planner.identification.log_errors import Unknowns
from flex_planner.identification.plan_residuals import find_plan_residuals, PlanResiduals
import numpy as np
import pytest

CASE = single_link(10)
# of a size that its motor can do in half a second
MOTION = replace(CASE.motions[0], **{name: 0.1 * getattr(CASE.motions[0], name) for name in (
    'positions', 'velocities', 'accelerations', 'torques')})


def found_with(payload: float = 0.11) -> Identification:
    """Return an identification of the arm of the case, with another payload."""
    values = np.concatenate([[payload], CASE.truth[1:]])
    nothing = np.zeros((1, 0))
    fit = Fit(found=Unknowns(values=values, starts=nothing, swings=nothing, late=np.zeros(1)),
              free=(), half_widths=np.zeros(0), late=np.zeros(1), moving=(), rms=1.0, cost=0.0,
              fit_percent=np.full((1, 1), 100.0), evaluations=1, converged=True)
    return Identification(
        arm=CASE.arm, richer_arm=CASE.arm, method=Method.CLOSED_LOOP, logs=('log',), planned=fit,
        more_modes=None, best=fit, single=(), left_out=nothing, estimates=(), warnings=())


def residuals(reference: JointReference | None, *, payload: float = 0.11,
              stiffness: float = 4.0) -> PlanResiduals | None:
    """Return what a reference leaves behind, and what a plan would."""
    times = np.arange(100) / 100.0
    log = JointLog(name='log', times=times, angles=np.zeros((100, 1)), reference=reference)
    drive = replace(CASE.drive, gains=Gains.of(1, stiffness, 0.3))
    return find_plan_residuals(found_with(payload), log, drive)


def test_plan_for_the_arm_that_was_found_leaves_less_than_one_for_a_stiff_arm() -> None:
    found, shaking = residuals(MOTION), residuals(MOTION, stiffness=4e3)
    assert found is not None and (found.name, found.message) == ('log', '')
    assert 0 < found.after < 0.3 * found.before < 0.03
    # under a drive whose delay is more than its gains can stand; the motor's limits bound it
    assert shaking is not None
    assert shaking.before > 1.5 * found.before and shaking.after > 5 * found.after


def test_plan_that_there_is_not_is_told_with_the_reason() -> None:
    short = replace(MOTION, times=MOTION.times * 1e-3)
    found = residuals(short)
    assert found is not None and np.isnan(found.after)
    assert 'takes at least' in found.message and found.message.endswith('(POWER)')


@pytest.mark.parametrize('reference', [None, replace(
    MOTION, velocities=MOTION.velocities + 0.1)], ids=['none', 'in motion at its end'])
def test_without_a_motion_to_rest_there_is_nothing_to_say(
        reference: JointReference | None) -> None:
    assert residuals(reference) is None
