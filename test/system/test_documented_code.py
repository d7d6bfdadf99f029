"""Everything that README.md and the tutorials tell people to run does what they say."""

from __future__ import annotations

from pathlib import Path
import re

from documents import compare, DOCS, Follower, read_blocks, ROOT
import pytest
import ros_support  # noqa: F401 - a ROS domain of the tests' own

README = ROOT / 'README.md'
TUTORIALS = sorted(DOCS.glob('tutorials/*.md'))


def follow(page: Path, folder: Path) -> None:
    """Do what a page says; what stands in fences is code, and is run."""
    with Follower(folder) as follower:
        left = [block for block in read_blocks(page) if not follower.follow(block)]
    assert left == []


def test_readme_does_what_it_says(tmp_path: Path) -> None:
    follow(README, tmp_path)


@pytest.mark.parametrize('page', TUTORIALS, ids=lambda page: page.stem)
def test_tutorial_does_what_it_says(page: Path, tmp_path: Path) -> None:
    follow(page, tmp_path)


def test_targets_of_make_exist() -> None:
    pages = [README, ROOT / 'CONTRIBUTING.md', DOCS / 'installation.md']
    targets = {name for page in pages for name in re.findall(
        r'(?:^    |`)make ([a-z][\w-]*)', page.read_text(encoding='utf-8'), re.MULTILINE)}
    assert {'demo', 'test', 'docs'} <= targets
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    assert targets <= set(re.findall(r'^([a-z][\w-]*):', makefile, re.MULTILINE))


def test_command_that_fails_or_says_something_else_is_seen(tmp_path: Path) -> None:
    page = tmp_path / 'page.md'
    for command, what in (('false', 'false: '), ('echo 1', "'2 ... 3' is not said")):
        page.write_text(f'```console\n$ {command}\n2 ... 3\n```\n')
        folder = tmp_path / command
        folder.mkdir()
        with Follower(folder) as follower, pytest.raises(AssertionError) as error:
            follower.follow(*read_blocks(page))
        assert what in str(error.value)
    with pytest.raises(AssertionError):
        compare(['b', 'a'], 'a\nb\n')
    compare(['a ... c', 'd'], 'a   b c\nx\n  d e\n')
