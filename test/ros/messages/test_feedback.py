"""Gains of feedback there and back."""

from __future__ import annotations

from dataclasses import replace

from factories import PlanFactory
from flex_planner.control.linear_feedback import joint_feedback, LinearFeedback, pd_feedback
from flex_planner.planning.feedback.find_gains import find_feedback_gains
from flex_planner.planning.feedback.gains import FeedbackGains
from flex_planner.planning.plan import Plan
from flex_planner.ros.messages.feedback import feedback_message, law_from_message
import numpy as np
import pytest


@pytest.fixture(scope='module')
def plan(plan_of: PlanFactory) -> Plan:
    return plan_of('ei5')


@pytest.fixture(scope='module')
def gains(plan: Plan) -> FeedbackGains:
    return find_feedback_gains(plan)


def there_and_back(gains: FeedbackGains, plan: Plan) -> LinearFeedback | None:
    return law_from_message(feedback_message(gains, plan, ['a', 'b'], 'base'))


def only(gains: FeedbackGains, name: str) -> FeedbackGains:
    return replace(gains, records={name: gains.records[name]})


def test_message_has_what_was_found(plan: Plan, gains: FeedbackGains) -> None:
    message = feedback_message(gains, plan, ['a', 'b'], 'base')
    assert (message.joint_names, message.header.frame_id) == (['a', 'b'], 'base')
    assert list(message.modal_names) == list(plan.arm.passive_names)
    assert message.message == gains.message and len(message.arms) == 7
    assert gains.joints is not None and gains.state is not None
    assert np.array_equal(message.p, gains.joints.stiffness)
    assert np.array_equal(np.reshape(message.joint_gain, (2, 4)), gains.coupled_joints)
    assert np.array_equal(np.reshape(message.observer_gain, (12, 2)), gains.state.observer_gain)
    assert np.array_equal(message.state_gain_leaves, gains.records['state'].residuals)


def test_law_of_a_message_is_the_one_that_was_tried(plan: Plan, gains: FeedbackGains) -> None:
    assert gains.joints is not None and gains.state is not None
    laws = {'joints': pd_feedback(gains.joints, 1000.0), 'state': gains.state.law(),
            'coupled_joints': joint_feedback(gains.coupled_joints, 1000.0)}
    for name, law in laws.items():
        found = there_and_back(only(gains, name), plan)
        assert found is not None
        assert np.array_equal(found.entries, law.entries) and found.rate == law.rate
    best = there_and_back(gains, plan)
    assert best is not None
    assert np.array_equal(best.entries, laws[gains.best].entries)


def test_estimated_torques_go_along(plan: Plan, gains: FeedbackGains) -> None:
    assert gains.state is not None
    wandering = replace(gains.state, disturbance_gain=np.array([[1.0, 2.0], [3.0, 4.0]]))
    made = replace(gains, disturbance=wandering,
                   records={'disturbance': gains.records['state']})
    found = there_and_back(made, plan)
    assert found is not None
    assert np.array_equal(found.entries, wandering.law().entries)


def test_nothing_that_was_found_makes_no_law(plan: Plan, gains: FeedbackGains) -> None:
    none = FeedbackGains(rate=1000.0, cutoff=50.0, resolution=1e-4, message='no gains are stable',
                         differences=gains.differences)
    message = feedback_message(none, plan, ['a', 'b'], 'base')
    assert message.message == 'no gains are stable' and not message.p
    assert law_from_message(message) is None
