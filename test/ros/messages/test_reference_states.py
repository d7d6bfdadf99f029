"""Reference states as recordings have them."""

from __future__ import annotations

from factories import PlanFactory
from flex_planner.planning.plan import Plan
from flex_planner.ros.messages.classes import JointState, TYPES
from flex_planner.ros.messages.reference_states import encode_states
import numpy as np
import pytest


@pytest.mark.parametrize('names', [['joint1', 'joint2'], ['j', 'the second']])
def test_states_are_encoded_as_one_by_one(plan_of: PlanFactory, names: list[str]) -> None:
    plan: Plan = plan_of('ei50')
    names, samples = [*names, *plan.arm.passive_names], plan.uniform_samples(5)
    stamps = 1_700_000_000_123_456_789 + np.arange(5) * 400_000_000
    for k, (stamp, data) in enumerate(zip(
            stamps.tolist(), encode_states(samples, names, stamps), strict=True)):
        state = JointState(
            name=names, position=samples.coordinates[k].tolist(),
            velocity=samples.rates[k].tolist(), effort=[*samples.torques[k], 0.0, 0.0, 0.0, 0.0])
        state.header.stamp.sec, state.header.stamp.nanosec = divmod(stamp, 10**9)
        assert data == TYPES.encode('sensor_msgs/msg/JointState', state)
