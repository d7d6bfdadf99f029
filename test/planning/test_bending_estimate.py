"""How far off its plan a moving arm will be, from an estimate and from its encoders."""

from __future__ import annotations

from factories import PlanFactory
from flex_planner.base.validation import Array
from flex_planner.control.controlled_motion import ControlledArm, ControlledMotion
from flex_planner.control.joint_reference import JointReference
from flex_planner.planning.bending_estimate import TrackedArm
from flex_planner.planning.plan import Plan
from flex_planner.planning.robust.differing_arms import differing_parameters
from flex_planner.planning.sampling import sample_plan, SampledPlan, SamplingSettings
import numpy as np
import pytest

NOW, LATER, STEP = 0.5, 0.55, 2 * np.pi / 2**16
BENT = slice(2, 6)


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei5')


@pytest.fixture(scope='module')
def sampled(plan: Plan) -> SampledPlan:
    return sample_plan(plan, SamplingSettings())


@pytest.fixture(scope='module')
def tracked(plan: Plan, sampled: SampledPlan) -> TrackedArm:
    samples = sampled.samples
    reference = JointReference(
        times=np.multiply(sampled.times_ns, 1e-9, dtype=np.float64), torques=sampled.efforts,
        positions=samples.coordinates, velocities=samples.rates,
        accelerations=samples.accelerations)
    return TrackedArm(dynamics=plan.model, parameters=plan.problem.parameters,
                      controller=sampled.execution.controller, reference=reference)


def carry_out(plan: Plan, sampled: SampledPlan, start: Array,
              stiffness: float = 0.0) -> ControlledMotion:
    """Return the motion of an arm under its controller, at every millisecond."""
    parameters = differing_parameters(plan.problem.parameters, stiffness, 0.0)
    arm = ControlledArm(dynamics=plan.model, parameters=parameters,
                        controller=sampled.execution.controller)
    return arm.follow(sampled.reference, start, 0.6)


def disturbed(plan: Plan) -> Array:
    """Return a start whose links are bent by a few millimetres and move."""
    start = plan.problem.start.copy()
    start[BENT] += [4e-3, -1e-3, -3e-3, 1e-3]
    return start


def test_deviation_is_carried_on_by_the_model(plan: Plan, sampled: SampledPlan,
                                              tracked: TrackedArm) -> None:
    motion = carry_out(plan, sampled, disturbed(plan))
    off = tracked.predict(motion.states[500], NOW, LATER)
    true = motion.states[550] - tracked.planned(LATER)
    assert np.abs(true[BENT]).max() > 2e-4
    np.testing.assert_allclose(off, true, rtol=0, atol=1e-6)
    now = tracked.predict(motion.states[500], NOW, NOW + 5e-4)  # less than a period
    np.testing.assert_array_equal(now, motion.states[500] - tracked.planned(NOW))


@pytest.mark.parametrize(('stiffness', 'share'), [(0.0, 0.3), (-0.1, 0.8)])
def test_bending_is_observed_from_the_angles_of_encoders(
        plan: Plan, sampled: SampledPlan, tracked: TrackedArm, stiffness: float,
        share: float) -> None:
    start = disturbed(plan) if not stiffness else plan.problem.start
    motion = carry_out(plan, sampled, start, stiffness)
    seen = np.arange(250, 501, 5)
    angles = np.round(motion.states[seen, :2] / STEP) * STEP
    off = tracked.observe(motion.times[seen], angles)
    true = motion.states[500] - tracked.planned(NOW)
    assert np.linalg.norm(true[BENT]) > 1e-4  # a tenth of a millimetre
    assert np.linalg.norm((off - true)[BENT]) < share * np.linalg.norm(true[BENT])
    assert np.abs((off - true)[:2]).max() < 2 * STEP


def test_one_angle_tells_little(tracked: TrackedArm) -> None:
    angles = tracked.planned(NOW)[:2] + [1e-3, 0.0]
    off = tracked.observe(np.array([NOW]), angles[None])
    np.testing.assert_allclose(off[:2], [1e-3, 0.0], atol=1e-5)
    np.testing.assert_allclose(off[2:], 0.0, atol=1e-12)
