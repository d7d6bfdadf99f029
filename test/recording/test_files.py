"""Recordings of several files, on full disks, of killed processes, and in Foxglove's reader."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import json
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time
from types import SimpleNamespace as Message
from typing import Any

from flex_planner.base.errors import InvalidValueError, RecordingError
from flex_planner.cli import main
from flex_planner.recording import (
    LATCHED,
    MessageTypes,
    read_attachments,
    read_metadata,
    read_recording,
    Recording,
    recover_recording,
    Topic,
)
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
import yaml

STATES = Topic('/arm/states', 'sensor_msgs/msg/JointState')
PLAN = Topic('/arm/plan', 'std_msgs/msg/String', LATCHED)
START = 1_700_000_000_000_000_000  # [ns]
ROOT = Path(__file__).parents[2]
SIZE = 30_000  # [bytes]
INDEX = 10_000  # [bytes], schemas, message index and summary of a small file
WRITER = """
import sys, time
sys.path.insert(0, sys.argv[2])
import pathlib, test_files as t
types = t.MessageTypes.load()
with t.Recording.create(pathlib.Path(sys.argv[1]), 'plan', types, max_bytes=200_000) as recording:
    t.fill(recording, 1000)
    print('written', flush=True)
    time.sleep(60)
"""
FOXGLOVE = """
const fs = require('node:fs');
const { McapIndexedReader } = require('@mcap/core');
const { FileHandleReadable } = require('@mcap/nodejs');
const { loadDecompressHandlers } = require('@mcap/support');
const { parse } = require('@foxglove/rosmsg');
const { MessageReader } = require('@foxglove/rosmsg2-serialization');
const plain = (key, value) => ArrayBuffer.isView(value) ? Array.from(value) : value;
async function main(path) {
  const handle = await fs.promises.open(path, 'r');
  const decompressHandlers = await loadDecompressHandlers();
  const reader = await McapIndexedReader.Initialize({
    readable: new FileHandleReadable(handle), decompressHandlers });
  const found = [];
  for await (const { channelId, data } of reader.readMessages()) {
    const { topic, schemaId } = reader.channelsById.get(channelId);
    const text = new TextDecoder().decode(reader.schemasById.get(schemaId).data);
    found.push([topic, new MessageReader(parse(text, { ros2: true })).readMessage(data)]);
  }
  await handle.close();
  console.log(JSON.stringify(found, plain));
}
main(process.argv[1]);
"""


def state(i: int) -> Message:
    """Return a state that does not compress."""
    noise = np.random.default_rng(i).normal(size=50)
    header = Message(stamp=Message(sec=i, nanosec=7), frame_id='base')
    return Message(header=header, name=['q1'], position=noise, velocity=[], effort=[0.5 * i])


def fill(recording: Recording, count: int) -> None:
    """Write a plan and states, and an attachment."""
    recording.attach('scenario.yaml', b'payload: 1\n', media_type='application/yaml')
    recording.write(PLAN, Message(data='the plan'), START)
    for i in range(count):
        recording.write(STATES, state(i), START + i)


@pytest.fixture(scope='module')
def types() -> MessageTypes:
    return MessageTypes.load()


@pytest.fixture
def split(tmp_path: Path, types: MessageTypes) -> Path:
    with Recording.create(tmp_path, 'plan', types, custom_data={'a': 'b'},
                          max_bytes=SIZE) as recording:
        fill(recording, 200)
    return recording.path


def parts(path: Path) -> list[Path]:
    return sorted(path.glob('*.mcap'), key=lambda file: int(file.stem.rpartition('_')[2]))


# Several files


def test_recording_is_split_by_size(split: Path, types: MessageTypes) -> None:
    sizes = [file.stat().st_size for file in parts(split)]
    assert [file.name for file in parts(split)] == [f'plan_{i}.mcap' for i in range(len(sizes))]
    assert len(sizes) > 2
    assert max(sizes) < SIZE + INDEX
    assert min(sizes[:-1]) > SIZE / 2
    found = list(read_recording(split, types))
    assert [m.log_time_ns - START for m in found] == [0, *range(200)]
    assert all((m.message.position == state(i).position).all() for i, m in enumerate(found[1:]))
    assert read_attachments(split) == {'scenario.yaml': b'payload: 1\n'}


def test_metadata_list_the_files_as_rosbag2_does(split: Path) -> None:
    content = yaml.safe_load((split / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    names = [file.name for file in parts(split)]
    assert content['relative_file_paths'] == names == [f['path'] for f in content['files']]
    assert sum(f['message_count'] for f in content['files']) == content['message_count'] == 201
    starts = [f['starting_time']['nanoseconds_since_epoch'] for f in content['files']]
    ends = [start + f['duration']['nanoseconds']
            for start, f in zip(starts, content['files'], strict=True)]
    assert (starts[0], ends[-1]) == (START, START + 199)
    assert all(end < start for end, start in zip(ends, starts[1:], strict=False))
    counts = {t['topic_metadata']['name']: t['message_count']
              for t in content['topics_with_message_count']}
    assert counts == {PLAN.name: 1, STATES.name: 200}
    assert read_metadata(split).to_dict() == content


def test_other_readers_read_all_files(split: Path, types: MessageTypes) -> None:
    with AnyReader([split]) as reader:
        found = [reader.deserialize(data, connection.msgtype)
                 for connection, _, data in reader.messages() if connection.topic == STATES.name]
    assert [message.header.stamp.sec for message in found] == list(range(200))
    seconds = []
    for file in parts(split):
        with file.open('rb') as stream:
            reader_of_file = make_reader(stream, True, [DecoderFactory()])
            seconds += [decoded.header.stamp.sec for _, channel, _, decoded
                        in reader_of_file.iter_decoded_messages() if channel.topic == STATES.name]
            (record,) = reader_of_file.iter_metadata()
        own = yaml.safe_load(record.metadata['serialized_metadata'])
        assert own['relative_file_paths'] == [file.name]
    assert seconds == list(range(200))


def test_message_larger_than_a_file_has_a_file_of_its_own(tmp_path: Path,
                                                          types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types, max_bytes=1) as recording:
        fill(recording, 2)
    assert [read_metadata(file).message_count for file in parts(recording.path)] == [1, 1, 1]
    with pytest.raises(InvalidValueError, match='max_bytes is 0, but must be at least 1'):
        Recording.create(tmp_path, 'other', types, max_bytes=0).__enter__()


def test_a_file_that_is_lost_is_missed(split: Path, types: MessageTypes) -> None:
    files = parts(split)
    files[-1].unlink()
    with pytest.raises(RecordingError, match=f'lacks {files[-1].name}, which its metadata.yaml'):
        list(read_recording(split, types))
    files[0].unlink()
    with pytest.raises(RecordingError, match=r'lacks plan_0\.mcap'):
        read_metadata(split)
    (split / 'metadata.yaml').unlink()
    with pytest.raises(RecordingError, match=r'the parts <name>_0\.mcap, <name>_1\.mcap'):
        read_metadata(split)


def test_damage_in_the_last_file_is_found_before_anything_is_used(split: Path,
                                                                  types: MessageTypes) -> None:
    last = parts(split)[-1]
    last.write_bytes(last.read_bytes()[:-40])
    with pytest.raises(RecordingError, match=f'{last.name} is damaged'):
        next(read_recording(split, types))


# No space, no permission


@contextmanager
def full_disk(monkeypatch: pytest.MonkeyPatch, name: str) -> Iterator[None]:
    """Let a file lie on a device that is always full."""
    opened = Path.open

    def open_full(self: Path, *arguments: Any, **options: Any) -> Any:
        if self.name == name:
            return Path('/dev/full').open('wb')
        return opened(self, *arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr(Path, 'open', open_full)
        yield


@pytest.mark.parametrize('name', ['plan_0.mcap', 'plan_2.mcap', 'metadata.yaml'])
def test_full_disk_is_an_error_and_leaves_nothing(tmp_path: Path, types: MessageTypes, name: str,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    if not Path('/dev/full').exists():
        pytest.skip('there is no /dev/full')
    with pytest.raises(RecordingError, match='cannot write .*/plan: No space left on device'):
        with (full_disk(monkeypatch, name),
              Recording.create(tmp_path, 'plan', types, max_bytes=SIZE) as recording):
            fill(recording, 200)
    assert list(tmp_path.iterdir()) == []


def test_folder_without_permission_is_an_error(tmp_path: Path, types: MessageTypes) -> None:
    folder = tmp_path / 'locked'
    folder.mkdir(mode=0o500)
    root = os.geteuid() == 0
    if root:  # whom permissions do not stop
        os.seteuid(65534)
    try:
        with pytest.raises(RecordingError, match='cannot write .*/plan: Permission denied'):
            with Recording.create(folder, 'plan', types):
                raise AssertionError('not reached')
    finally:
        if root:
            os.seteuid(0)
    assert list(folder.iterdir()) == []


# Killed


@pytest.fixture(scope='module')
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the hidden folder of a process that was killed while it wrote."""
    folder = tmp_path_factory.mktemp('killed')
    process = subprocess.Popen([sys.executable, '-c', WRITER, str(folder), Path(__file__).parent],
                               stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == b'written\n'
        (stage,) = folder.iterdir()
        with pytest.raises(RecordingError, match='is still being written'):
            recover_recording(stage, MessageTypes.load())
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    assert [path.name for path in folder.iterdir()] == [stage.name]
    return stage


def test_recording_of_a_killed_process_is_refused_but_recovered(
        killed: Path, types: MessageTypes, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RecordingError, match='is damaged or not an MCAP file'):
        read_metadata(killed)
    assert main(['recover', str(killed)]) == 0
    recovered = killed.with_name('plan')
    assert str(recovered) in capsys.readouterr().out
    found = list(read_recording(recovered, types))
    # all but the last chunk, of 64 KiB before compression and with messages of half a KiB
    assert 1001 - 130 < len(found) <= 1001
    assert [m.topic for m in found] == [PLAN, *(len(found) - 1) * [STATES]]
    assert [m.log_time_ns - START for m in found] == [0, *range(len(found) - 1)]
    assert all((m.message.position == state(i).position).all() for i, m in enumerate(found[1:]))
    assert read_attachments(recovered) == {'scenario.yaml': b'payload: 1\n'}
    assert dict(read_metadata(recovered).custom_data) == {'recovered_from': killed.name}
    assert main(['recover', str(killed)]) == 1
    assert 'exists and is never overwritten' in capsys.readouterr().err


def test_complete_part_of_any_truncated_file_is_recovered(tmp_path: Path,
                                                          types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        fill(recording, 300)
    file = next(recording.path.glob('*.mcap'))
    content, counts = file.read_bytes(), []
    for size in np.linspace(0, len(content) - 1, 12).astype(int):
        file.write_bytes(content[:size])
        try:
            path = recover_recording(recording.path, types)
        except RecordingError as error:
            assert 'holds no complete message or attachment' in str(error)
            counts.append(0)
            continue
        assert path.name == 'plan_recovered'
        counts.append(len(list(read_recording(path, types))))
        shutil.rmtree(path)
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (0, 301)


@pytest.mark.parametrize('content', [b'', b'no recording', b'\x89MCAP0\r\n' + bytes(40)])
def test_nothing_is_recovered_where_there_is_nothing(tmp_path: Path, types: MessageTypes,
                                                     content: bytes) -> None:
    (tmp_path / 'a.mcap').write_bytes(content)
    with pytest.raises(RecordingError, match=r'a\.mcap holds no complete message or attachment'):
        recover_recording(tmp_path / 'a.mcap', types)
    with pytest.raises(RecordingError, match='cannot read .*: No such file'):
        recover_recording(tmp_path / 'b.mcap', types)
    assert [path.name for path in tmp_path.iterdir()] == ['a.mcap']


# Bytes


def test_split_recordings_are_identical_too(split: Path, types: MessageTypes,
                                            tmp_path: Path) -> None:
    time.sleep(0.01)
    with Recording.create(tmp_path / 'again', 'plan', types, custom_data={'a': 'b'},
                          max_bytes=SIZE) as recording:
        fill(recording, 200)
    for file in split.iterdir():
        assert (recording.path / file.name).read_bytes() == file.read_bytes()


@pytest.fixture(scope='module')
def foxglove() -> dict[str, str]:
    """Install Foxglove's own readers where there is npm; return the environment with them."""
    folder = ROOT / 'build' / 'foxglove'
    environment = {**os.environ, 'NODE_PATH': str(folder / 'node_modules')}
    check = ['node', '-e', FOXGLOVE.partition('const plain')[0]]
    if not shutil.which('node') or not shutil.which('npm'):
        pytest.skip('there is no node with npm')
    if subprocess.run(check, env=environment, capture_output=True).returncode:
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(Path(__file__).parents[1] / 'data' / 'foxglove.json', folder / 'package.json')
        done = subprocess.run(['npm', 'install', '--no-audit', '--no-fund'], cwd=folder,
                              capture_output=True, text=True, timeout=200)
        if done.returncode and 'CI' not in os.environ:
            pytest.skip(f'npm cannot install the readers: {done.stderr[-300:]}')
        assert done.returncode == 0, done.stderr
    return environment


def test_foxglove_reads_every_message(tmp_path: Path, types: MessageTypes,
                                      foxglove: dict[str, str]) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        fill(recording, 20)
    result = subprocess.run(['node', '-e', FOXGLOVE, str(next(recording.path.glob('*.mcap')))],
                            env=foxglove, capture_output=True, text=True, check=True)
    (_, plan), *states = json.loads(result.stdout)
    assert plan == {'data': 'the plan'}
    assert [(topic, message['position'], message['effort']) for topic, message in states] == [
        (STATES.name, state(i).position.tolist(), [0.5 * i]) for i in range(20)]
