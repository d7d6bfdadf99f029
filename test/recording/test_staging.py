"""All or nothing: no recording is ever half-done under its name."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import errno
import os
from pathlib import Path
import resource
from types import SimpleNamespace as Message

from flex_planner.base.errors import RecordingError
from flex_planner.recording import MessageTypes, read_metadata, Recording
import numpy as np
import pytest
from recording_support import record, state, STATES


def test_nothing_is_visible_before_the_end(tmp_path: Path, types: MessageTypes) -> None:
    with Recording.create(tmp_path, 'plan', types) as recording:
        recording.write(STATES, state(), 0)
        assert [path.name[:6] for path in tmp_path.iterdir()] == ['.plan.']
    assert [path.name for path in tmp_path.iterdir()] == ['plan']


@pytest.mark.parametrize('error', [KeyError, OSError, KeyboardInterrupt])
def test_exception_in_the_block_leaves_nothing(
    tmp_path: Path, types: MessageTypes, error: type[BaseException]
) -> None:
    with pytest.raises(error), Recording.create(tmp_path, 'plan', types) as recording:
        recording.write(STATES, state(), 0)
        raise error
    assert list(tmp_path.iterdir()) == []


def test_folder_is_complete_and_on_the_disk_when_renamed(
    tmp_path: Path, types: MessageTypes, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[str] = []
    fsync = os.fsync

    def note(descriptor: int) -> None:
        synced.append(Path(os.readlink(f'/proc/self/fd/{descriptor}')).name)
        fsync(descriptor)

    def check(stage: Path, target: Path) -> None:
        assert read_metadata(stage).message_count == 6
        assert synced == ['plan_0.mcap', 'metadata.yaml', stage.name]
        os.rename(stage, target)

    monkeypatch.setattr(os, 'fsync', note)
    monkeypatch.setattr(Path, 'rename', check)
    assert record(tmp_path, types).is_dir()
    assert synced[-1] == tmp_path.name


@pytest.mark.parametrize('taken', ['folder', 'empty', 'file', 'link'])
def test_existing_name_is_not_overwritten(
    tmp_path: Path, types: MessageTypes, taken: str
) -> None:
    target = tmp_path / 'plan'
    if taken in ('folder', 'empty'):
        target.mkdir()
    if taken == 'folder':
        (target / 'mine').write_text('precious')
    if taken == 'file':
        target.write_text('precious')
    if taken == 'link':
        target.symlink_to('nowhere')
    before = sorted(tmp_path.rglob('*'))
    with pytest.raises(RecordingError, match='exists and is never overwritten'):
        record(tmp_path, types)
    assert sorted(tmp_path.rglob('*')) == before


@pytest.mark.parametrize('content', [True, False])
def test_name_taken_meanwhile_is_not_overwritten(
    tmp_path: Path, types: MessageTypes, content: bool
) -> None:
    with (
        pytest.raises(RecordingError, match='exists and is never overwritten'),
        Recording.create(tmp_path, 'plan', types),
    ):
        (tmp_path / 'plan').mkdir()
        if content:
            (tmp_path / 'plan' / 'mine').write_text('precious')
    assert [path.name for path in tmp_path.iterdir()] == ['plan']


@contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    """Let the kernel refuse to write more, as on a full disk; root is no exception."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize('size', [0, 100, 4000])
def test_refused_write_is_an_error_and_leaves_nothing(
    tmp_path: Path, types: MessageTypes, size: int
) -> None:
    with pytest.raises(RecordingError, match='cannot write .*: File too large'):
        with file_size_limit(size):
            record(tmp_path, types)
    assert list(tmp_path.iterdir()) == []


def test_failed_write_cannot_be_passed_over(tmp_path: Path, types: MessageTypes) -> None:
    noise = np.random.default_rng(0).normal(size=400_000)
    with pytest.raises(RecordingError, match='a write to it has failed'):
        with Recording.create(tmp_path, 'plan', types) as recording:
            with file_size_limit(1000), pytest.raises(RecordingError, match='too large'):
                recording.write(STATES, Message(**{**vars(state()), 'position': noise}), 0)
    assert list(tmp_path.iterdir()) == []


def test_disk_that_fills_up_at_the_very_end_is_an_error(
    tmp_path: Path, types: MessageTypes, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, 'fsync', full)
    with pytest.raises(RecordingError, match=r'cannot write .*/plan: No space left'):
        record(tmp_path, types)
    assert list(tmp_path.iterdir()) == []


def test_recording_in_a_folder_that_cannot_be_synced_is_kept(
    tmp_path: Path, types: MessageTypes, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture
) -> None:
    fsync = os.fsync

    def refuse(descriptor: int) -> None:
        if os.readlink(f'/proc/self/fd/{descriptor}') == str(tmp_path):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        fsync(descriptor)

    monkeypatch.setattr(os, 'fsync', refuse)
    assert read_metadata(record(tmp_path, types)).message_count == 6
    assert 'is written, but not forced to the disk: ' in caplog.text


def test_unwritable_folder_is_an_error(tmp_path: Path, types: MessageTypes) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(RecordingError, match=r'cannot write .*/file/plan: '):
        record(tmp_path / 'file', types)


def test_recording_is_as_readable_as_any_new_folder(plan: Path, tmp_path: Path) -> None:
    (tmp_path / 'other').mkdir()
    assert plan.stat().st_mode == (tmp_path / 'other').stat().st_mode
