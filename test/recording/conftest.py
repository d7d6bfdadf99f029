"""Definitions of messages, and a recording of some."""

from __future__ import annotations

from pathlib import Path

from flex_planner.recording import MessageTypes
import pytest
from recording_support import LEAF, record, TREE_TEXT


@pytest.fixture(scope='session')
def interfaces(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('definitions') / 'tiny_interfaces'
    (folder / 'msg').mkdir(parents=True)
    (folder / 'msg' / 'Leaf.msg').write_text(LEAF)
    (folder / 'msg' / 'Tree.msg').write_text(TREE_TEXT)
    return folder


@pytest.fixture(scope='session')
def types(interfaces: Path) -> MessageTypes:
    return MessageTypes.load([interfaces])


@pytest.fixture
def plan(tmp_path: Path, types: MessageTypes) -> Path:
    return record(tmp_path, types)
