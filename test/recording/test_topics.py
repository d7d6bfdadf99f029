"""Names, types and quality of service of topics."""

from __future__ import annotations

from flex_planner.base.errors import InvalidValueError
from flex_planner.recording import DEFAULT, Durability, LATCHED, QosProfile, Reliability, Topic
import pytest
from recording_support import STATES


@pytest.mark.parametrize('name', ['relative', '/', '/a//b', '/a b', '/1a', '/a/', '~/a', '/a\n'])
def test_topic_name_that_rosbag2_refuses_is_refused(name: str) -> None:
    with pytest.raises(InvalidValueError, match='topic name'):
        Topic(name, STATES.type_name)


@pytest.mark.parametrize('name', ['JointState', 'sensor_msgs/JointState', 'a/msg/b', 'A/msg/B'])
def test_type_name_is_that_of_a_message(name: str) -> None:
    with pytest.raises(InvalidValueError, match='message type'):
        Topic('/a', name)


@pytest.mark.parametrize(('text', 'expected'), [
    ('', DEFAULT),
    ('[]', DEFAULT),
    ('nonsense', DEFAULT),
    (LATCHED.to_yaml(), LATCHED),
    ('- {reliability: best_effort, durability: unknown, depth: 0}',
     QosProfile(reliability=Reliability.BEST_EFFORT)),
    ('- {reliability: 2, durability: 1, depth: 3}',  # metadata version 8
     QosProfile(reliability=Reliability.BEST_EFFORT, durability=Durability.TRANSIENT_LOCAL,
                depth=3)),
])
def test_quality_of_service_is_read_as_far_as_a_bag_knows_it(
    text: str, expected: QosProfile
) -> None:
    assert QosProfile.from_yaml(text) == expected
