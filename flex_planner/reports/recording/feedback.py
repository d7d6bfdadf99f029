"""Gains of feedback that were recorded with a motion."""

from __future__ import annotations

from typing import Any

from flex_planner.base.validation import Array
from flex_planner.control.joint_controller import Gains
from flex_planner.planning.execution import say_gains
from flex_planner.reports.recording.contents import RecordedRequest
from flex_planner.reports.recording.report_table import NOTHING, ReportTable
import numpy as np

_LAWS = {'joints_leave': 'PD of each joint', 'joint_gain_leaves': 'gains on all joints',
         'state_gain_leaves': 'regulator and observer'}


def gain_tables(request: RecordedRequest) -> list[ReportTable]:
    """Return the gains and what they leave on every arm of the box; none if none were wanted."""
    message = request.gains
    if message is None:
        return []
    rows = [('feedback', str(message.message)),
            ('controller', f'{message.rate:g} Hz, encoders of '
             f'{1e3 * message.encoder_resolution:.3g} mrad')]
    if len(message.p):
        stiffness, damping = say_gains(Gains(stiffness=np.array(message.p),
                                             damping=np.array(message.d)), request.arm, '.3g')
        rows += [('p of the joints', stiffness),
                 ('d of the joints', f'{damping}, on speeds filtered at '
                  f'{message.speed_filter:g} Hz')]
    rows += _observer(message)
    found = [ReportTable(title='Gains of feedback', rows=tuple(rows))]
    shown = {title: list(getattr(message, field)) for field, title in _LAWS.items()
             if len(getattr(message, field)) == len(message.arms)}
    if not shown:
        return found
    return [*found, ReportTable(
        title='Motion of the tip in the second after the arrival, with feedback [mm]',
        columns=('if', *shown), rows=tuple(
            (str(arm), *(_millimetres(left[i]) for left in shown.values()))
            for i, arm in enumerate(message.arms)))]


def _observer(message: Any) -> list[tuple[str, str]]:
    """Return where the observer's errors die away: decay and frequency of its modes."""
    if not len(message.observer_gain):
        return [('observer', NOTHING)]
    n = len(message.joint_names)
    size = 2 * (n + len(message.modal_names))
    transition = np.reshape(message.transition, (size, size))
    correction = np.reshape(message.observer_gain, (size, n))
    # errors after a correction: (1 - L C) A, whose C are the joint angles
    kept = np.eye(size)
    kept[:, :n] -= correction
    states = [('observer', f'{size} states from {n} encoders')]
    if len(message.disturbance_gain):
        return [('observer', f'{size} states and {n} torques from {n} encoders')]
    rates = _rates(kept @ transition, float(message.rate))
    slow, fast = rates[np.argmax(rates.real)], rates[np.argmin(rates.real)]
    return [*states,
            ('  its errors die away with', f'{_say_rate(slow)} to {_say_rate(fast)}')]


def _rates(step: Array, rate: float) -> Array:
    """Return the rates of a matrix of a period [1/s]; those that end at once are left out."""
    values = np.linalg.eigvals(step).astype(complex)
    rates: Array = np.log(values[np.abs(values) > 1e-6]) * rate
    return rates


def _say_rate(rate: complex) -> str:
    """Return a rate in words."""
    frequency = abs(rate.imag) / (2 * np.pi)
    return f'{-rate.real:.3g} 1/s' + (f' at {frequency:.3g} Hz' if frequency > 0.01 else '')


def _millimetres(length: float) -> str:
    return f'{1e3 * length:.3g}' if np.isfinite(length) else 'unstable'
