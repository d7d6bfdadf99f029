"""Gains are handed out only where they were tried, and what is said of them is so."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory
from flex_planner.arms.kinematics import tip_position
from flex_planner.base.errors import InvalidTaskError, InvalidValueError
from flex_planner.base.progress import Monitor, StoppedError
from flex_planner.base.validation import Array
from flex_planner.control.extent import peak_to_peak
from flex_planner.control.joint_controller import Gains, JointController
from flex_planner.control.linear_feedback import LinearFeedback, pd_feedback
from flex_planner.dynamics.arm_dynamics import ArmDynamics
from flex_planner.dynamics.integration import HeldTorqueIntegrator
from flex_planner.optimal_control.torque_limits import TorqueLimits
from flex_planner.planning.execution import UNSTABLE_GROWTH
from flex_planner.planning.feedback.carried_motion import CarriedMotion
from flex_planner.planning.feedback.differing_arm import Difference, DifferingArm
from flex_planner.planning.feedback.find_gains import (
    find_feedback_gains,
    GainSettings,
    RESOLUTION,
)
from flex_planner.planning.feedback.gains import FeedbackGains
from flex_planner.planning.plan import Plan
from flex_planner.planning.published_motion import PublishedMotion
from flex_planner.planning.robust.differing_arms import differing_parameters, with_more_modes
import numpy as np
import pytest


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei5')


@pytest.fixture(scope='module')
def gains(plan: Plan) -> FeedbackGains:
    return find_feedback_gains(plan)


def law_of(gains: FeedbackGains) -> LinearFeedback:
    assert gains.state is not None
    return gains.state.law()


def test_every_law_was_stable_on_every_arm(gains: FeedbackGains) -> None:
    assert gains.found and gains.message == 'stable on 7 arms at 1000 Hz'
    assert set(gains.records) >= {'state', 'joints', 'coupled_joints'}
    assert len(gains.differences) == len(set(gains.differences)) == 7
    for record in gains.records.values():
        assert record.stable and len(record.responses) == 7
        assert max(one.growth for one in record.responses) <= UNSTABLE_GROWTH
        assert record.worst == np.max(record.residuals)


def test_gains_leave_less_than_the_default_ones(plan: Plan, gains: FeedbackGains) -> None:
    # with 10 % of errors; as modelled all leave next to nothing
    default = pd_feedback(Gains.of(2, 100.0, 10.0), 1000.0)
    left = worst_of(plan, default, gains.differences[4])
    for record in gains.records.values():
        assert record.worst < left / 3
        assert record.residuals[0] < 1e-4


def worst_of(plan: Plan, law: LinearFeedback, difference: Difference) -> float:
    return arm_of(plan, difference).respond(law).residual


def arm_of(plan: Plan, difference: Difference) -> DifferingArm:
    controller = JointController(gains=Gains.of(2, 100.0, 10.0))
    motion = CarriedMotion.of(plan, controller)
    return DifferingArm.of(motion, motion.course, difference, RESOLUTION)


@pytest.mark.parametrize('number', [4, 6])
def test_residual_is_that_of_a_simulation(plan: Plan, gains: FeedbackGains, number: int) -> None:
    difference, law = gains.differences[number], law_of(gains)
    arm = with_more_modes(plan.arm) if difference.more_modes else plan.arm
    plant = Plant(ArmDynamics.of(arm), plan, difference)
    tips = plant.carry_out(law, gains.resolution)
    assert gains.records['state'].residuals[number] == pytest.approx(peak_to_peak(tips), rel=0.02)
    # linearised about the goal; encoders that round are not
    predicted = arm_of(plan, difference).predict_residual(law)
    assert predicted == pytest.approx(peak_to_peak(tips), rel=0.1)


class Plant:
    """A differing arm, moved by the integrator of the arm simulator, period by period."""

    def __init__(self, dynamics: ArmDynamics, plan: Plan, difference: Difference) -> None:
        parameters = differing_parameters(plan.problem.parameters, difference.stiffness,
                                          difference.payload)
        self._plan, self._arm = plan, dynamics.arm
        self._integrator = HeldTorqueIntegrator(dynamics, parameters.physical, period=1e-3,
                                                longest_step=1e-3, rtol=1e-8, atol=1e-10)

    def carry_out(self, law: LinearFeedback, resolution: float) -> Array:
        """Return the path of the tip in the second after the arrival."""
        controller = JointController(gains=Gains.of(2, 100.0, 10.0))
        motion = PublishedMotion.of(self._plan, controller, controller.period)
        times, n_t = np.arange(2000) * 1e-3, self._arm.n_coordinates
        angles, efforts = motion.motion(times)[0], motion.torque(times + 1e-3)
        state, xi, after = np.zeros(2 * n_t), np.zeros(law.order), []
        state[:2] = self._plan.task.start_positions
        limits = TorqueLimits.of(self._arm)
        for k in range(times.size):
            error = np.floor(state[:2] / resolution + 0.5) * resolution - angles[k]
            torque = np.clip(efforts[k] + law.C @ xi + law.D @ error,
                             *limits.bounds(state[n_t:n_t + 2]))
            xi = law.A @ xi + law.B @ error + law.E @ (torque - efforts[k])
            following = self._integrator.advance(state, torque)
            assert following is not None
            state = following
            if k >= 999:
                after.append(state[:n_t])
        return tip_position(self._arm, np.array(after))


SLOW = JointController(gains=Gains.of(2, 1e4, 1e3), rate=10.0)


def test_without_gains_that_are_stable_nothing_is_handed_out(plan_of: PlanFactory) -> None:
    found = find_feedback_gains(plan_of('ei5'), GainSettings(
        controller=SLOW, stiffness_error=0.5, payload_error=0.5))
    assert not found.found and not found.records
    assert found.joints is None
    assert found.state is None
    assert 'try a faster controller' in found.message


def test_slow_controllers_have_gains_too(plan_of: PlanFactory) -> None:
    found = find_feedback_gains(plan_of('ei50'), GainSettings(controller=SLOW))
    assert found.found and found.given is not None and not found.given.stable
    assert all(record.stable for record in found.records.values())
    # the tip swings by some millimetres, of soft gains
    assert found.joints is not None and found.joints.stiffness.max() < 20
    assert found.records['joints'].worst < 0.02


def test_rigid_arm_has_the_corners_of_its_payload(plan_of: PlanFactory) -> None:
    found = find_feedback_gains(plan_of('rigid'))
    assert [str(difference) for difference in found.differences] == [
        'as modelled', 'payload -10%', 'payload +10%']
    assert found.found and found.records[found.best].worst < 1e-3


def test_wrong_plans_and_settings_are_refused(plan: Plan) -> None:
    with pytest.raises(InvalidTaskError, match='plans that are solved'):
        find_feedback_gains(replace(plan, solution=None, status=type(plan.status).NOT_FOUND))
    with pytest.raises(InvalidValueError, match='encoder_resolution is 0'):
        GainSettings(encoder_resolution=0.0)
    with pytest.raises(InvalidValueError, match='stiffness_error is 0.6'):
        GainSettings(stiffness_error=0.6)


def test_monitor_may_stop_the_search(plan: Plan) -> None:
    with pytest.raises(StoppedError):
        find_feedback_gains(plan, monitor=Monitor(canceled=lambda: True))
