"""What is known of a joint controller."""

from __future__ import annotations

from typing import Any

from flex_planner.base.errors import InvalidValueError, NotFiniteError
from flex_planner.control.joint_controller import EffortHold, Gains, JointController
from flex_planner.control.joint_reference import JointReference
import numpy as np
import pytest

# 10 N m/s, so that an effort tells its time
RAMP = JointReference(times=np.array([0.0, 1.0]), torques=np.array([[0.0], [10.0]]),
                      positions=np.zeros((2, 1)), velocities=np.zeros((2, 1)),
                      accelerations=np.zeros((2, 1)))


@pytest.mark.parametrize(('hold', 'first', 'last'), [
    (EffortHold.END, 3.1, 3.1), (EffortHold.START, 3.0, 3.0), (EffortHold.MIDDLE, 3.05, 3.05),
    (EffortHold.LINEAR, 3.0, 3.1)])
def test_effort_of_a_period_is_that_of_its_hold(hold: EffortHold, first: float,
                                                last: float) -> None:
    begin, end = hold.efforts(RAMP, np.array([0.3]), 0.01)
    np.testing.assert_allclose([begin[0, 0], end[0, 0]], [first, last], atol=1e-12)


def test_hold_has_the_name_of_its_parameter() -> None:
    assert [EffortHold.named(hold.value) for hold in EffortHold] == list(EffortHold)
    with pytest.raises(InvalidValueError, match='effort_hold is .+ one of end, start, middle'):
        EffortHold.named('END')


@pytest.mark.parametrize(('values', 'error', 'text'), [
    ({'rate': 1.0}, InvalidValueError, 'controller_rate is 1.0'),
    ({'rate': np.nan}, NotFiniteError, 'controller_rate is nan')])
def test_bad_controller_is_refused(values: dict[str, Any], error: type[Exception],
                                   text: str) -> None:
    with pytest.raises(error, match=text):
        JointController(gains=Gains.of(1, 1.0, 1.0), **values)


def test_gains_are_per_joint_and_not_negative() -> None:
    assert Gains.of(2, 3.0, 4.0).damping.tolist() == [4.0, 4.0]
    with pytest.raises(InvalidValueError, match=r'stiffness\[1\] is -1.0'):
        Gains(stiffness=np.array([1.0, -1.0]), damping=np.ones(2))
