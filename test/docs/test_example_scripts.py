"""Every script of the gallery runs, says what it should, and stays short."""

from __future__ import annotations

from pathlib import Path
import re
import time

from example_scripts import check, EXPECTED, FOLDER, LONGEST, run, SCRIPTS, WITH_ROS
import pytest


def test_gallery_is_complete() -> None:
    assert EXPECTED.keys() <= SCRIPTS.keys()
    table = (FOLDER / 'README.md').read_text()
    assert [name for name in SCRIPTS if f'[{name}]({name})' not in table] == []


@pytest.mark.parametrize('name', SCRIPTS)
def test_example_is_short_and_says_how_to_run_it(name: str) -> None:
    text = SCRIPTS[name].read_text()
    assert len(text.splitlines()) <= LONGEST
    assert f'\n    tools/run python examples/{name}\n' in text


@pytest.mark.parametrize('name', sorted(SCRIPTS.keys() - WITH_ROS))
def test_example_runs(name: str, tmp_path: Path) -> None:
    check(name, run(name, tmp_path, lambda: time.sleep(0.05)))
    written = {path.name for path in tmp_path.glob('output/*') if path.stat().st_size > 10_000}
    assert set(re.findall(r'\w+\.(?:png|html)', SCRIPTS[name].read_text())) <= written
