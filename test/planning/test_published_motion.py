"""What the points of a trajectory stand for."""

from __future__ import annotations

from factories import PlanFactory
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.planning.plan import Plan
from flex_planner.planning.published_motion import PublishedMotion
import numpy as np
import pytest


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei50')


def published(plan: Plan, hold: EffortHold, period: float) -> PublishedMotion:
    controller = JointController(gains=Gains.of(2, 100.0, 10.0), rate=200.0, hold=hold)
    return PublishedMotion.of(plan, controller, period)


@pytest.mark.parametrize(('hold', 'delay'), [
    (EffortHold.END, 2e-3), (EffortHold.START, -2e-3), (EffortHold.MIDDLE, 0.0),
    (EffortHold.LINEAR, 0.0)])
def test_efforts_come_half_a_period_later_or_earlier(plan: Plan, hold: EffortHold,
                                                     delay: float) -> None:
    motion, times = published(plan, hold, 4e-3), np.array([0.1, 0.4, 0.9])
    np.testing.assert_allclose(motion.torque(times), plan.sample(times - delay).torques,
                               atol=1e-12)
    positions, velocities = motion.motion(times)
    exact = plan.sample(times)
    assert positions.tolist() == exact.coordinates[:, :2].tolist()
    assert velocities.tolist() == exact.rates[:, :2].tolist()


def test_held_effort_of_the_last_period_has_the_impulse_of_both_torques(plan: Plan) -> None:
    # the motion ends 0.3 periods after an update of the controller
    motion, period = published(plan, EffortHold.END, 0.0), 5e-3
    late = motion.end + 0.7 * period
    last = plan.sample([motion.end]).torques[0]
    expected = 0.3 * last + 0.7 * plan.problem.holding_torque
    np.testing.assert_allclose(motion.torque(np.array([late]))[0], expected, atol=1e-12)
    assert np.abs(last - plan.problem.holding_torque).max() > 1


@pytest.mark.parametrize('hold', [EffortHold.START, EffortHold.MIDDLE, EffortHold.LINEAR])
def test_other_controllers_go_to_the_holding_effort_at_once(plan: Plan, hold: EffortHold) -> None:
    motion = published(plan, hold, 0.0)
    after = motion.torque(motion.end + np.array([0.0, 1.1e-6]))
    assert after[0].tolist() == plan.sample([motion.end]).torques[0].tolist()
    assert after[1].tolist() == plan.problem.holding_torque.tolist()


def test_arm_stays_after_the_end(plan: Plan) -> None:
    positions, velocities = published(plan, EffortHold.END, 0.0).motion(np.array([1.0, 7.0]))
    np.testing.assert_allclose(positions, np.tile(plan.task.goal_positions, (2, 1)), atol=1e-7)
    assert not velocities.any()
