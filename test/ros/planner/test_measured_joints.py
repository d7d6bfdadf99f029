"""Where the joints are, from all the ways in which drivers say so."""

from __future__ import annotations

from collections.abc import Sequence
import math

from flex_planner.ros.messages.measured_starts import ArmStateError
from flex_planner.ros.planner.measured_joints import JointReading, MeasuredJoints
from flex_planner_interfaces.msg import PlanReport
import pytest
from sensor_msgs.msg import JointState

SECOND = 10**9
NOW = 1_700_000_000 * SECOND


@pytest.fixture
def joints() -> MeasuredJoints:
    return MeasuredJoints(['joint1', 'joint2'], '/joint_states')


def state(stamp_ns: int = 0, **values: tuple[float, ...]) -> JointState:
    """Return a message of position, or position and velocity, by joint."""
    message = JointState(name=list(values), position=[float(v[0]) for v in values.values()])
    message.velocity = [float(v[1]) for v in values.values() if len(v) > 1]
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, SECOND)
    return message


def hear(joints: MeasuredJoints, *messages: JointState, now_ns: int = NOW) -> JointReading:
    for message in messages:
        joints.hear(message, now_ns)
    return joints.read(now_ns, 1.0)


def refusal(joints: MeasuredJoints, *messages: JointState, later: float = 0.0) -> str:
    for message in messages:
        joints.hear(message, NOW)
    with pytest.raises(ArmStateError) as caught:
        joints.read(NOW + int(later * SECOND), 1.0)
    assert caught.value.code == PlanReport.ARM_STATE_UNKNOWN
    return str(caught.value)


@pytest.mark.parametrize('messages', [
    [state(joint1=(0.1, 0.3), joint2=(0.2, 0.4))],
    [state(joint2=(0.2, 0.4), joint1=(0.1, 0.3))],
    [state(gripper=(9, 9), joint2=(0.2, 0.4), joint1=(0.1, 0.3), rail=(8, 8))],
    [state(joint2=(0.2, 0.4)), state(gripper=(9, 9)), state(joint1=(0.1, 0.3))],
    [state(NOW, joint1=(0.1, 0.3), joint2=(0.2, 0.4))],
    [state(joint1=(math.nan,), joint2=(0.2,)), state(joint1=(0.1, 0.3), joint2=(0.2, 0.4))],
    [state(), state(joint1=(0.1, 0.3), joint2=(0.2, 0.4)), state()],
], ids=['in order', 'reversed', 'among others', 'one by one', 'stamped', 'after nan', 'empty'])
def test_joints_are_found_however_they_come(joints: MeasuredJoints,
                                            messages: Sequence[JointState]) -> None:
    reading = hear(joints, *messages)
    assert reading.positions.tolist() == [0.1, 0.2]
    assert reading.speeds.tolist() == [0.3, 0.4]


@pytest.mark.parametrize(('messages', 'words'), [
    ([], 'no message comes on /joint_states'),
    ([state(a=(1,), b=(2,))], 'names joint1, joint2; they name a, b'),
    ([state(joint1=(1,), b=(2,))], 'names joint2; they name joint1, b'),
    ([state(joint1=(1,), joint2=(math.nan,))], 'the position of joint2 is nan'),
    ([state(joint1=(math.inf,), joint2=(1,))], 'the position of joint1 is inf'),
    ([state(NOW - 5 * SECOND, joint1=(1,), joint2=(1,))], 'is 5 s old by its stamp'),
    ([state(12 * SECOND, joint1=(1,), joint2=(1,))], 'use_sim_time'),
    ([state(NOW + 5 * SECOND, joint1=(1,), joint2=(1,))], 'is 5 s ahead by its stamp'),
    ([JointState(name=['joint1', 'joint2'], velocity=[0.0, 0.0])], 'one position per name'),
    ([JointState(name=['joint1', 'joint2'], position=[0.0])], 'one position per name'),
], ids=['nothing', 'others', 'a part', 'nan', 'infinite', 'stale', 'simulated time',
        'from the future', 'no positions', 'too few positions'])
def test_what_is_not_known_is_a_sentence(joints: MeasuredJoints, messages: Sequence[JointState],
                                         words: str) -> None:
    assert words in refusal(joints, *messages)


def test_joint_that_falls_silent_is_named(joints: MeasuredJoints) -> None:
    whole = state(joint1=(1,), joint2=(2,))
    assert 'joint1 was last heard of 1.5 s ago' in refusal(joints, whole, later=1.5)
    joints.hear(state(joint1=(1,)), NOW + SECOND * 3 // 2)
    assert 'joint2 was last heard of' in refusal(joints, later=1.5)


def test_clock_that_was_set_back_is_named(joints: MeasuredJoints) -> None:
    words = refusal(joints, state(joint1=(1,), joint2=(2,)), later=-3.0)
    assert 'set back by 3 s' in words
    reading = hear(joints, state(joint1=(1.5,), joint2=(2,)), now_ns=NOW - 3 * SECOND)
    assert reading.speeds.tolist() == reading.drifts.tolist() == [0, 0]


@pytest.mark.parametrize('velocity', [(), (math.nan,)], ids=['none', 'nan'])
def test_speed_is_found_without_velocities(joints: MeasuredJoints,
                                           velocity: tuple[float, ...]) -> None:
    for k in range(100):
        reading = hear(joints, state(joint1=(0.5 + 0.002 * k, *velocity), joint2=(1.0, *velocity)),
                       now_ns=NOW + k * SECOND // 100)
    assert reading.speeds.tolist() == pytest.approx([0.2, 0])
    assert reading.drifts.tolist() == pytest.approx([0.05, 0])  # 0.25 s at 0.2 rad/s


def test_two_publishers_that_contradict_each_other_show_as_drift(joints: MeasuredJoints) -> None:
    for k in range(20):
        reading = hear(joints, state(joint1=(0.3 * (k % 2), 0.0), joint2=(1.0, 0.0)),
                       now_ns=NOW + k * SECOND // 50)
    assert reading.drifts.tolist() == [0.3, 0]
    assert reading.speeds.tolist() == [0, 0]


def test_velocities_that_jump_at_rest_are_no_motion(joints: MeasuredJoints) -> None:
    for k in range(50):  # rounded to 0.001 rad, and differentiated over a millisecond
        jumps = k % 5 == 4
        reading = hear(joints, state(joint1=(0.001 * jumps, 1.0 * jumps), joint2=(1.0, 0.3)),
                       now_ns=NOW + k * SECOND // 100)
    assert reading.speeds.tolist() == [0, 0.3]
    assert reading.drifts[0] <= 0.001


def test_rest_after_a_motion_is_seen_soon(joints: MeasuredJoints) -> None:
    for k in range(60):
        reading = hear(joints, state(joint1=(0.1 * min(k, 30),), joint2=(1.0,)),
                       now_ns=NOW + k * SECOND // 100)
    assert reading.drifts[0] == reading.speeds[0] == 0
