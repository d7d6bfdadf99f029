"""Paths: the home folder is found, and a user who does not exist gets a sentence."""

from __future__ import annotations

from pathlib import Path

from flex_planner.base.paths import expand_path, file_stem, folder_from_environment, PathError
import pytest


@pytest.fixture(autouse=True)
def home(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv('HOME', str(tmp_path))
    return tmp_path


@pytest.mark.parametrize(('path', 'expected'), [
    ('~', '{home}'), ('~/a b/arm.yaml', '{home}/a b/arm.yaml'), ('a/~/b', 'a/~/b'),
    ('./~nobody', '~nobody'), ('', '.'), ('-', '-'), ('/a', '/a'), (Path('~/a'), '{home}/a')])
def test_home_folder_is_found_where_it_begins_a_path(home: Path, path: str | Path,
                                                     expected: str) -> None:
    assert expand_path(path) == Path(expected.format(home=home))


def test_home_folder_of_a_user_is_found() -> None:
    assert expand_path('~root/a') == Path(Path('~root').expanduser(), 'a')


@pytest.mark.parametrize('path', ['~no-such-user', '~no-such-user/arm.yaml'])
def test_user_who_does_not_exist_gets_a_sentence(path: str) -> None:
    with pytest.raises(PathError, match=f"^'{path}' is no path, because there is no home "
                                        "folder of a user 'no-such-user'; write './~no-such-user"):
        expand_path(path)


def test_null_character_gets_a_sentence() -> None:
    with pytest.raises(PathError, match='is no path: it holds a null character'):
        expand_path('a\0b')


@pytest.mark.parametrize(('given', 'expected'), [
    (None, '{home}/there'), ('', '{home}/there'), ('relative', '{home}/there'), ('/a', '/a'),
    ('~/b', '{home}/b')])
def test_folder_of_an_environment_variable_is_absolute(
        monkeypatch: pytest.MonkeyPatch, home: Path, given: str | None, expected: str) -> None:
    monkeypatch.delenv('SOME_FOLDER', raising=False)
    if given is not None:
        monkeypatch.setenv('SOME_FOLDER', given)
    found = folder_from_environment('SOME_FOLDER', '~/there')
    assert found == Path(expected.format(home=home))


@pytest.mark.parametrize(('path', 'stem'), [
    ('my arm.yaml', 'my arm'), ('a/b.YML', 'b'), ('korayem_rigid', 'korayem_rigid'),
    ('-', 'stdin'), ('/dev/stdin', 'stdin'), ('/dev/fd/63', 'pipe'), ('/proc/self/fd/0', 'stdin')])
def test_files_are_named_after_files_not_after_pipes(path: str, stem: str) -> None:
    assert file_stem(path) == stem


def test_user_without_a_home_folder_gets_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    # as of nobody, on many systems
    monkeypatch.setattr('os.path.isdir', lambda path: False)
    with pytest.raises(PathError, match="'~root/a' is no path, because there is no home folder"):
        expand_path('~root/a')
