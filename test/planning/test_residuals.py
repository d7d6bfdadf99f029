"""What a plan leaves behind on arms that differ is what the search for gains saw of the PD."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory
from flex_planner.arms.arm_files import load_arm
from flex_planner.arms.spatial_arm import SpatialArm
from flex_planner.base.errors import InvalidTaskError, InvalidValueError
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.control.linear_feedback import pd_feedback
from flex_planner.optimal_control.task import Task
from flex_planner.planning.feedback.carried_motion import CarriedMotion
from flex_planner.planning.feedback.differing_arm import (
    Difference,
    DifferingArm,
    list_differences,
)
from flex_planner.planning.feedback.find_gains import find_feedback_gains, GainSettings
from flex_planner.planning.plan import Plan, PlanStatus
from flex_planner.planning.plan_path import plan_path
from flex_planner.planning.residuals import find_residuals, Residuals
from flex_planner.planning.sampling import sample_plan, SamplingSettings
from flex_planner.planning.uncertainty import Uncertainty
import pytest

PD = JointController(gains=Gains.of(2, 100.0, 10.0))


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei5')


@pytest.fixture(scope='module')
def found(plan: Plan) -> Residuals:
    return find_residuals(plan, PD)


def test_figures_are_those_that_gains_were_tried_with(plan: Plan, found: Residuals) -> None:
    given = find_feedback_gains(plan, GainSettings(controller=PD))
    assert given.given is not None
    known = dict(zip(found.differences, found.responses, strict=True))
    assert len(known) == 11 and found.stable
    for difference, response in zip(given.differences, given.given.responses, strict=True):
        assert known[difference].residual == response.residual
    assert found.worst == max(one.residual for one in found.responses)
    # of another simulation, without encoders that round
    nominal = sample_plan(plan, SamplingSettings(controller=PD)).execution
    assert known[Difference(stiffness=-0.1)].bending > 50 * nominal.residual_vibration


def test_smaller_errors_leave_less(plan: Plan, found: Residuals) -> None:
    known = find_residuals(plan, PD, uncertainty=Uncertainty(stiffness=0.01, payload=0.01))
    assert known.worst < 0.2 * found.worst


def test_planar_arm_in_space_leaves_the_same() -> None:
    planar, softer = load_arm('clamped_motors'), Difference(stiffness=-0.1, payload=0.1)
    controller = JointController(gains=Gains.of(2, 40.0, 4.0))
    found = []
    for arm in (planar, SpatialArm.of_planar(planar)):
        plan = plan_path(Task(arm=arm, start_positions=[0.3, 0.2], goal_positions=[0.35, 0.25],
                              duration=0.7, payload_mass=1.0), search='fast')
        motion = CarriedMotion.of(plan, controller)
        assert softer in list_differences(motion, 0.1, 0.1)
        differing = DifferingArm.of(motion, motion.course, softer, 0.0)
        found.append(differing.respond(pd_feedback(controller.gains, controller.rate)))
    assert found[0].residual > 1e-5
    assert found[1].growth == pytest.approx(found[0].growth, rel=1e-6)
    assert found[1].tip_error == pytest.approx(found[0].tip_error, rel=1e-6)
    # in space directions are further apart
    assert found[1].residual == pytest.approx(found[0].residual, rel=2e-3)


def test_payload_that_was_not_identified_may_be_off_by_a_tenth() -> None:
    known = Uncertainty(stiffness=0.01, payload=0.02, payload_mass=1.1)
    assert known.payload_error(1.1) == known.payload_error(1.11) == 0.02
    assert known.payload_error(1.0) == 0.1
    assert Uncertainty(payload=0.3).payload_error(7.0) == 0.3


def test_controller_that_shakes_an_arm_is_told(plan: Plan) -> None:
    firm = JointController(gains=Gains.of(2, 100.0, 10.0), rate=100.0)
    found = find_residuals(plan, firm)
    assert not found.stable and found.worst == float('inf')


def test_what_cannot_be_is_refused(plan: Plan) -> None:
    with pytest.raises(InvalidValueError, match='stiffness_error is 0.7'):
        Uncertainty(stiffness=0.7)
    with pytest.raises(InvalidTaskError, match='solved'):
        find_residuals(replace(plan, status=PlanStatus.NOT_FOUND), PD)
