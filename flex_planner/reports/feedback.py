"""Gains of feedback as lines of text, and as plain values for a file."""

from __future__ import annotations

from typing import Any

from flex_planner.arms.arm import Arm
from flex_planner.control.state_feedback import StateFeedback
from flex_planner.planning.execution import say_gains, UNSTABLE_GROWTH
from flex_planner.planning.feedback.differing_arm import Response
from flex_planner.planning.feedback.gains import FeedbackGains, Record
from flex_planner.reports.motion import columns, Row
import numpy as np

_MILLI = 1e3
LAWS = {'joints': 'PD of each joint', 'coupled_joints': 'gains on all joints',
        'state': 'regulator and observer', 'disturbance': 'with estimated torques'}


def feedback_rows(gains: FeedbackGains) -> list[Row]:
    """Return what was found, and the gains that a simple controller takes."""
    rows = [('feedback', gains.message)]
    if gains.joints is not None:
        stiffness, damping = say_gains(gains.joints, form='.3g')
        rows += [('  p of the joints', stiffness),
                 ('  d of the joints', f'{damping}, on speeds '
                  f'filtered at {gains.cutoff:g} Hz'),
                 ('  encoders', f'{_MILLI * gains.resolution:.3g} mrad')]
    return rows


def feedback_table(gains: FeedbackGains) -> str:
    """
    Return the motion of the tip in the second after the arrival, one line per arm [mm].

    One column for each law, that of the controller's own gains first.

    """
    records = {'own gains': gains.given, **{LAWS[name]: record
                                            for name, record in gains.records.items()}}
    shown = {name: record for name, record in records.items() if record is not None}
    return columns(['tip motion after the arrival [mm]', *shown], [
        [str(difference), *(_say(record.responses[i]) for record in shown.values())]
        for i, difference in enumerate(gains.differences)])


def feedback_values(gains: FeedbackGains, arm: Arm) -> dict[str, Any]:
    """Return gains as plain values, in SI units and radians, for a file."""
    values: dict[str, Any] = {
        'arm': arm.name, 'message': gains.message, 'rate': gains.rate,
        'encoder_resolution': gains.resolution,
        'coordinates': [*(f'joint{i + 1}' for i in range(arm.n_joints)),
                        *arm.passive_names],
        'arms': [str(difference) for difference in gains.differences],
        'tip_motion_after_arrival': {name: _residuals(record)
                                     for name, record in gains.records.items()}}
    if gains.joints is not None:
        values['joints'] = {'p': gains.joints.stiffness.tolist(),
                            'd': gains.joints.damping.tolist(), 'speed_filter': gains.cutoff}
    if gains.coupled_joints.size:
        values['coupled_joints'] = {'gain': gains.coupled_joints.tolist(),
                                    'speed_filter': gains.cutoff}
    for name in ('state', 'disturbance'):
        feedback = getattr(gains, name)
        if feedback is not None:
            values[name] = _matrices(feedback)
    return values


def _matrices(feedback: StateFeedback) -> dict[str, Any]:
    """Return the matrices of a regulator and its observer, row by row."""
    names = ['state_gain', 'observer_gain', 'transition', 'inputs']
    names += ['disturbance_gain'] if feedback.disturbance_gain.size else []
    return {name: getattr(feedback, name).tolist() for name in names}


def _residuals(record: Record) -> list[float]:
    """Return the motion of the tip of every arm [m]."""
    return [float(value) for value in record.residuals]


def _say(response: Response) -> str:
    """Return what became of an arm in words."""
    if response.growth > UNSTABLE_GROWTH or not np.isfinite(response.residual):
        return 'unstable'
    return f'{_MILLI * response.residual:.3g}'
