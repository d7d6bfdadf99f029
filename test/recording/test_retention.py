"""The oldest recordings go, and nothing else does."""

from __future__ import annotations

from pathlib import Path
import re

from flex_planner.recording import find_recordings, MessageTypes, recover_recording, remove_oldest
import pytest
from recording_support import record

NAME = re.compile(r'plan_(\d+)')


@pytest.fixture
def folder(tmp_path: Path, types: MessageTypes) -> Path:
    """Return five recordings, and what only looks like some."""
    for i in (3, 1, 4, 2, 5):
        record(tmp_path, types, f'plan_{i}')
    record(tmp_path, types, 'mine')
    record(tmp_path, types, 'plan_0').rename(tmp_path / '.plan_0.0123456789abcdef')
    (record(tmp_path, types, 'plan_00') / 'notes.txt').write_text('precious')
    (record(tmp_path, types, 'plan_000') / 'metadata.yaml').unlink()
    (tmp_path / 'plan_0000').write_text('a file')
    (tmp_path / 'plan_00000').symlink_to(tmp_path / 'mine')
    (tmp_path / 'plan_000000').mkdir()
    (tmp_path / 'plan_000000' / 'metadata.yaml').mkdir()
    return tmp_path


def names(folder: Path) -> list[str]:
    return [recording.path.name for recording in find_recordings(folder, NAME)]


def test_only_finished_recordings_of_the_writer_are_found(folder: Path) -> None:
    assert names(folder) == [f'plan_{i}' for i in (1, 2, 3, 4, 5)]
    sizes = {recording.size for recording in find_recordings(folder, NAME)}
    assert sizes == {sum(file.stat().st_size for file in (folder / 'plan_1').iterdir())}


@pytest.mark.parametrize(('most', 'sizes', 'left'), [
    (0, 0, [1, 2, 3, 4, 5]), (5, 0, [1, 2, 3, 4, 5]), (2, 0, [4, 5]), (0, 3.5, [3, 4, 5]),
    (4, 2.5, [4, 5]), (1, 0, [5]), (0, 0.5, [5])])
def test_oldest_go_until_the_others_are_within_bounds(folder: Path, most: int, sizes: float,
                                                      left: list[int]) -> None:
    found, others = find_recordings(folder, NAME), set(folder.iterdir())
    removed = remove_oldest(found, folder / 'plan_5', most=most,
                            most_bytes=int(sizes * found[0].size))
    assert names(folder) == [f'plan_{i}' for i in left]
    assert [recording.path.name for recording in removed] == [
        f'plan_{i}' for i in range(1, 6) if i not in left]
    assert others - set(folder.iterdir()) == {recording.path for recording in removed}
    assert (folder / 'plan_00' / 'notes.txt').read_text() == 'precious'


def test_newest_stays_even_if_its_name_says_it_is_old(folder: Path) -> None:
    remove_oldest(find_recordings(folder, NAME), folder / 'plan_1', most=1)
    assert names(folder) == ['plan_1']


def test_one_that_another_process_removes_meanwhile_is_no_error(folder: Path) -> None:
    found = find_recordings(folder, NAME)
    (folder / 'plan_1').rename(folder / 'kept')
    remove_oldest(found, folder / 'plan_5', most=1)
    assert names(folder) == ['plan_5']


def test_one_that_cannot_be_removed_stays_whole(folder: Path, types: MessageTypes,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path) -> None:
        raise PermissionError(13, 'Permission denied')

    monkeypatch.setattr('shutil.rmtree', refuse)
    with pytest.raises(PermissionError):
        remove_oldest(find_recordings(folder, NAME), folder / 'plan_5', most=1)
    assert names(folder) == [f'plan_{i}' for i in (1, 2, 3, 4, 5)]
    monkeypatch.undo()
    assert recover_recording(folder / 'plan_1', types).name == 'plan_1_recovered'
