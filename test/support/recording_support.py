"""A small recording, and messages of every kind of field that it holds."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace as Message
from typing import Any

from flex_planner.recording import LATCHED, MessageTypes, Recording, Topic
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.summary import Summary
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest

TRAJECTORY = Topic('/planner/trajectory', 'trajectory_msgs/msg/JointTrajectory', LATCHED)
STATES = Topic('/planner/states', 'sensor_msgs/msg/JointState')
TREE = Topic('/planner/tree', 'tiny_interfaces/msg/Tree')
# rclpy's type support imports lark, which imports a deprecated module.
of_lark = pytest.mark.filterwarnings('ignore:module .sre_:DeprecationWarning')
START = 1_700_000_000_000_000_000  # [ns]
LEAF = """\
uint8 GREEN=1
uint8 BROWN=2

uint8 colour       # GREEN or BROWN
float64 length     # [m]
"""
TREE_TEXT = """\
string<=8 name     # of the tree
bool alive
Leaf best
Leaf[] leaves
Leaf[2] pair
float64[3] position   # [m]
int16[<=4] rings
float32[] sap
string[] notes
builtin_interfaces/Duration age
byte flag
byte[] flags
"""


def header(seconds: int = 0) -> Message:
    return Message(stamp=Message(sec=seconds, nanosec=7), frame_id='base')


def point(i: int) -> Message:
    effort = [] if i == 0 else [4.0, -5.0]
    when = Message(sec=i, nanosec=999_999_999)
    return Message(positions=[0.1 * i, 1.0], velocities=[0.0, -0.0], accelerations=[],
                   effort=effort, time_from_start=when)


def trajectory(count: int = 3) -> Message:
    points = [point(i) for i in range(count)]
    return Message(header=header(), joint_names=['shoulder', 'ellbögen'], points=points)


def state(i: int = 0) -> Message:
    return Message(header=header(i), name=['q1'], position=np.array([0.5 * i]),
                   velocity=(1, 2), effort=[])


def leaf(colour: int = 1) -> Message:
    return Message(colour=colour, length=0.25)


def tree(**changes: object) -> Message:
    fields: dict[str, object] = {
        'name': 'elm', 'alive': True, 'best': leaf(), 'leaves': [leaf(2), leaf()],
        'pair': (leaf(), leaf()), 'position': [1.0, 2.0, 3.0], 'rings': [-1, 2], 'sap': [0.5],
        'notes': ['', 'a'], 'age': Message(sec=-1, nanosec=5), 'flag': b'\xff',
        'flags': [b'\x00', b'\x80']}
    return Message(**{**fields, **changes})


def record(folder: Path, types: MessageTypes, name: str = 'plan') -> Path:
    with Recording.create(folder, name, types, custom_data={'version': '0.1'}) as recording:
        recording.attach('task.yaml', b'payload: 1\n', media_type='application/yaml', time_ns=5)
        recording.write(TRAJECTORY, trajectory(), START)
        for i in range(4):
            recording.write(STATES, state(i), START + i)
        recording.write(TREE, tree(), START + 10)
    return recording.path


def mcap_records(path: Path) -> list[tuple[Any, Any, Any, Any]]:
    with (path / 'plan_0.mcap').open('rb') as stream:
        reader = make_reader(stream, True, [DecoderFactory()])
        return list(reader.iter_decoded_messages())


def summary_of(path: Path) -> Summary:
    with (path / 'plan_0.mcap').open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return summary


leaves = st.builds(leaf, st.integers(0, 255))
