"""The replay node: what was recorded comes again, in order, in time, latched where it was."""

from __future__ import annotations

from pathlib import Path
import re
import shutil
import signal
import subprocess
import sys
import time
from typing import Any

from flex_planner.cli import main
from flex_planner.recording import LATCHED as LATCHED_QOS
from flex_planner.recording import MessageTypes, Recording, SerializedMessage, Topic
from flex_planner.recording.playback import from_time
from flex_planner.ros.runtime.processes import NodeProcess
from other_writers import OPTIONS, rewrite
import pytest
from ros_support import Client, LATCHED, PATIENCE
from sensor_msgs.msg import JointState
from std_msgs.msg import String

STATES = Topic('/arm/states', 'sensor_msgs/msg/JointState')
PLAN = Topic('/arm/plan', 'std_msgs/msg/String', LATCHED_QOS)
ALIEN = Topic('/arm/alien', 'velodyne_msgs/msg/VelodynePacket')
START = 1_700_000_000_000_000_000  # [ns]
STEP = 200_000_000  # [ns]
RELIABLE = 10  # [messages]
DISCOVERY = 4.0  # [s]; a node that was not noticed announces itself again after 3 s


@pytest.fixture(scope='module')
def types(tmp_path_factory: pytest.TempPathFactory) -> MessageTypes:
    folder = tmp_path_factory.mktemp('alien') / 'velodyne_msgs'
    (folder / 'msg').mkdir(parents=True)
    (folder / 'msg' / 'VelodynePacket.msg').write_text('uint8 data\n')
    return MessageTypes.load([folder])


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory, types: MessageTypes) -> Path:
    """Return a plan, then five states 0.2 s apart, and something of a type not installed."""
    with Recording.create(tmp_path_factory.mktemp('replayed'), 'plan', types) as recording:
        recording.write(PLAN, String(data='the plan'), START)
        recording.write(ALIEN, types.message_class(ALIEN.type_name)(7), START)
        for i in range(5):
            recording.write(STATES, JointState(name=['a'], position=[0.1 * i]), START + i * STEP)
    return recording.path


def replaying(path: Path, log: Path, **parameters: object) -> NodeProcess:
    return NodeProcess('flex_planner.ros.replay', {'recording': path, **parameters}, log=log)


def positions(messages: list[Any]) -> list[float]:
    return [message.position[0] for message in messages]


def test_recording_comes_again_in_its_order_at_its_rate(recording: Path, tmp_path: Path) -> None:
    times: list[float] = []
    # of a writer that leaves out all it may, with channels of other kinds
    file = rewrite(recording, tmp_path / 'ü x.mcap', OPTIONS['unchunked_nothing'])
    with Client() as client:
        plans = client.listen(String, PLAN.name)
        states = client.listen(JointState, STATES.name, RELIABLE)
        client.node.create_subscription(
            JointState, STATES.name, lambda _: times.append(time.monotonic()), RELIABLE)
        with replaying(file, tmp_path / 'log', rate=0.5, delay=DISCOVERY) as node:
            client.wait('end', lambda: node.process.poll() is not None)
            client.spin(0.1)
    assert node.process.returncode == 0
    assert [message.data for message in plans] == ['the plan']
    assert positions(states) == [0.1 * i for i in range(5)]
    # 4 steps of 0.2 s at half the speed; at full speed it would be 0.8 s
    assert times[-1] - times[0] > 1.2
    log = (tmp_path / 'log').read_text()
    for name in ('/arm/alien', '/unknown', '/service', '/flex_planner/plan_path/_action/feedback'):
        assert f'{name} is left out: ' in log
    for name in ('/json', '/protobuf', 'no name of ROS', '/untyped'):
        assert f'left out: {name} (1 message): ' in log
    assert 'a message of /compressed is left out: its messages are compressed' in log
    assert '6 messages sent' in log


def test_loop_from_a_late_start_goes_on_until_it_is_stopped(recording: Path,
                                                            tmp_path: Path) -> None:
    with Client() as client:
        states = client.listen(JointState, STATES.name, RELIABLE)
        with replaying(recording, tmp_path / 'log', start=0.5, loop=True, delay=0.3) as node:
            client.wait('passes', lambda: len(states) >= 5)
            # what a latched topic holds is not left out
            assert client.latched(String, PLAN.name).data == 'the plan'
            assert node.stop(signal.SIGINT) == 0
    # the first ones may come before the subscriber is found
    order = [round(10 * position) for position in positions(states)]
    assert order[:5] in ([3, 4, 3, 4, 3], [4, 3, 4, 3, 4])
    assert 'Traceback' not in (tmp_path / 'log').read_text()


def test_replay_whose_recording_vanishes_fails_and_says_why(recording: Path,
                                                            tmp_path: Path) -> None:
    copy, log = tmp_path / 'copy', tmp_path / 'log'
    shutil.copytree(recording, copy)
    with Client() as client:
        states = client.listen(JointState, STATES.name, RELIABLE)
        with replaying(copy, log, loop=True, delay=0.2) as node:
            client.wait('states', lambda: bool(states))
            shutil.rmtree(copy)
            assert node.process.wait(PATIENCE) == 1
    text = log.read_text()
    assert re.search(rf'the replay ends after \d+ messages: cannot read {copy}.*: No such', text)
    assert 'Traceback' not in text


def test_command_replays_and_ends_well(recording: Path) -> None:
    command = [sys.executable, '-m', 'flex_planner.cli', 'replay', str(recording), '--rate', '10',
               '--delay', '0.1']
    with Client() as client:
        process = subprocess.Popen(command, stderr=subprocess.PIPE)
        late = client.listen(String, PLAN.name, LATCHED)
        client.wait('end', lambda: process.poll() is not None)
        assert process.communicate()[1].count(b'Traceback') == 0
    assert process.returncode == 0
    assert [message.data for message in late] in ([], ['the plan'])  # found in time, or not


@pytest.mark.parametrize(('parameters', 'complaint'), [
    ({'path': '/nowhere.mcap'}, 'cannot read /nowhere.mcap: No such file'),
    ({'path': __file__}, 'is damaged or not an MCAP file'),
    ({'start': 0.9}, 'start is 0.9, but must be at most the duration of the recording, 0.8 s'),
    ({'rate': 0.0}, 'rate')])
def test_node_that_cannot_replay_says_why(recording: Path, tmp_path: Path,
                                          parameters: dict[str, Any], complaint: str) -> None:
    with replaying(**{'path': recording, 'log': tmp_path / 'log', **parameters}) as node:
        assert node.process.wait(PATIENCE) == 1
    log = (tmp_path / 'log').read_text()
    assert complaint in log
    assert 'Traceback' not in log


@pytest.mark.parametrize(('arguments', 'complaint'), [
    (['/nowhere'], 'cannot read /nowhere: No such file or directory'),
    ([__file__], 'is damaged or not an MCAP file'),
    (['{}', '--rate', '0'], '--rate is 0.0, but must be a number >= 0.001'),
    (['{}', '--start', '5'], '--start is 5.0, but must be a number >= 0 and <= 0.8 s'),
    (['{}', '--delay', 'nan'], '--delay is nan')])
def test_command_that_cannot_replay_says_why(recording: Path, arguments: list[str], complaint: str,
                                             capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['replay', *(word.format(recording) for word in arguments)]) == 1
    assert complaint in capsys.readouterr().err


def test_latched_topic_holds_as_many_messages_as_its_depth() -> None:
    def message(topic: Topic, when: int) -> SerializedMessage:
        return SerializedMessage(topic, '', when, str(when).encode())

    messages = [message(PLAN, 1), message(STATES, 2), message(PLAN, 3), message(STATES, 5)]
    assert [(m.log_time_ns, m.data) for m in from_time(messages, 4)] == [(4, b'3'), (5, b'5')]
    assert [(m.log_time_ns, m.data) for m in from_time(messages, 9)] == [(9, b'3')]
    assert list(from_time(messages, 0)) == messages
