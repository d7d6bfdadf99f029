"""Gains of feedback as a message."""

from __future__ import annotations

from collections.abc import Sequence

from flex_planner.base.text import printable
from flex_planner.base.validation import Array
from flex_planner.control.linear_feedback import joint_feedback, LinearFeedback
from flex_planner.control.state_feedback import StateFeedback
from flex_planner.planning.feedback.gains import FeedbackGains
from flex_planner.planning.plan import Plan
from flex_planner.ros.messages.classes import FeedbackGains as FeedbackGainsMessage
import numpy as np


def feedback_message(gains: FeedbackGains, plan: Plan, joint_names: Sequence[str],
                     frame: str) -> FeedbackGainsMessage:
    """Return gains as a message, without a stamp."""
    message = FeedbackGainsMessage(
        joint_names=list(joint_names), modal_names=list(plan.arm.passive_names),
        message=printable(gains.message), rate=gains.rate, speed_filter=gains.cutoff,
        encoder_resolution=gains.resolution, arms=[str(one) for one in gains.differences],
        joint_gain=gains.coupled_joints.ravel().tolist(),
        joints_leave=_residuals(gains, 'joints'),
        joint_gain_leaves=_residuals(gains, 'coupled_joints'))
    message.header.frame_id = frame
    if gains.joints is not None:
        message.p, message.d = gains.joints.stiffness.tolist(), gains.joints.damping.tolist()
    name = 'state' if gains.disturbance is None else 'disturbance'
    feedback = gains.disturbance or gains.state
    if feedback is not None:
        message.state_gain_leaves = _residuals(gains, name)
        for field, matrix in (('state_gain', feedback.state_gain), ('input', feedback.inputs),
                              ('observer_gain', feedback.observer_gain),
                              ('transition', feedback.transition),
                              ('disturbance_gain', feedback.disturbance_gain)):
            setattr(message, field, matrix.ravel().tolist())
    return message


def law_from_message(message: FeedbackGainsMessage) -> LinearFeedback | None:
    """
    Return the law of a message that leaves least on its worst arm; None where it has none.

    Raises
    ------
    ValueError
        If its arrays do not fit together.

    """
    laws = {'state': message.state_gain_leaves, 'coupled': message.joint_gain_leaves,
            'joints': message.joints_leave}
    worst = {name: max(left) for name, left in laws.items() if len(left)}
    if not worst:
        return None
    best, n = min(worst, key=lambda name: worst[name]), len(message.joint_names)
    if best == 'state':
        return _state_feedback(message).law()
    gain = (np.reshape(message.joint_gain, (n, 2 * n)) if best == 'coupled'
            else np.hstack([np.diag(message.p), np.diag(message.d)]))
    return joint_feedback(gain, message.rate, message.speed_filter)


def _state_feedback(message: FeedbackGainsMessage) -> StateFeedback:
    """Return the regulator and observer of a message."""
    n = len(message.joint_names)
    size = 2 * (n + len(message.modal_names))

    def matrix(name: str, rows: int, columns: int) -> Array:
        return np.reshape(np.asarray(getattr(message, name), dtype=np.float64), (rows, columns))

    disturbances = n if len(message.disturbance_gain) else 0
    return StateFeedback(
        transition=matrix('transition', size, size), inputs=matrix('input', size, n),
        state_gain=matrix('state_gain', n, size), observer_gain=matrix('observer_gain', size, n),
        disturbance_gain=matrix('disturbance_gain', disturbances, n), rate=message.rate)


def _residuals(gains: FeedbackGains, name: str) -> list[float]:
    """Return what a kind of gains leaves on every arm; nothing where it is not handed out."""
    record = gains.records.get(name)
    return [] if record is None else record.residuals.tolist()
