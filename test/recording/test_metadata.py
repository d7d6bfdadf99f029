"""The metadata of a recording, beside the file and inside."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from flex_planner.recording import DEFAULT, MessageTypes
from flex_planner.recording.metadata import FileSummary, RecordingMetadata, TopicSummary
from mcap.reader import make_reader
import pytest
from recording_support import START, TREE
import yaml


def test_metadata_file_has_every_key_of_version_9(plan: Path, types: MessageTypes) -> None:
    content = yaml.safe_load((plan / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    topics = content.pop('topics_with_message_count')
    extent = {'duration': {'nanoseconds': 10}, 'message_count': 6,
              'starting_time': {'nanoseconds_since_epoch': START}}
    assert content == {
        'version': 9, 'storage_identifier': 'mcap', **extent, 'compression_format': '',
        'compression_mode': '', 'relative_file_paths': ['plan_0.mcap'],
        'files': [{'path': 'plan_0.mcap', **extent}], 'custom_data': {'version': '0.1'},
        'ros_distro': 'jazzy'}
    assert [topic['message_count'] for topic in topics] == [1, 4, 1]
    assert topics[2]['topic_metadata'] == {
        'name': TREE.name, 'type': TREE.type_name, 'serialization_format': 'cdr',
        'offered_qos_profiles': [DEFAULT.to_dict()],
        'type_description_hash': types.type_hash(TREE.type_name)}


def test_metadata_record_in_the_file_repeats_the_metadata_file(plan: Path) -> None:
    content = yaml.safe_load((plan / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    with (plan / 'plan_0.mcap').open('rb') as stream:
        (record,) = make_reader(stream).iter_metadata()
    assert record.name == 'rosbag2'
    assert yaml.safe_load(record.metadata['serialized_metadata']) == content


@pytest.mark.parametrize('count', [0, 1, 3])
def test_texts_are_those_of_the_whole_mapping(types: MessageTypes, count: int) -> None:
    odd = {'lines': 'a\n\n  b: c\n', 'mark': '\ntopics_with_message_count: []\n', 'no': 'x ' * 900}
    topics = tuple(TopicSummary(topic=replace(TREE, name=f'/t{k}'), message_count=k,
                                definition=types.definition(TREE.type_name))
                   for k in range(count))
    extent = FileSummary(name='x_0.mcap', start_ns=START, end_ns=START + 5, message_count=count)
    metadata = RecordingMetadata(files=(extent,), topics=topics, custom_data=odd)
    assert yaml.safe_load(metadata.to_record()) == metadata.to_dict()
    assert yaml.safe_load(metadata.to_file()) == {
        'rosbag2_bagfile_information': metadata.to_dict()}
