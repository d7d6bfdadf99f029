"""Pictures are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

from flex_planner.base.errors import InvalidValueError
from flex_planner.plotting.figures import plain, save
from matplotlib.figure import Figure
import pytest


def test_picture_is_written_whole_or_not_at_all(tmp_path: Path,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: Path, data: bytes) -> None:
        with self.open('wb') as file:
            file.write(data[:10])
        raise KeyboardInterrupt

    path = tmp_path / 'picture.png'
    path.write_bytes(b'whole')
    monkeypatch.setattr(Path, 'write_bytes', interrupted)
    with pytest.raises(KeyboardInterrupt):
        save(Figure(), path)
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [
        ('picture.png', b'whole')]


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('name', ['$\\frac{a$', '$$', 'a_$x^2$_b', '長腕 🦾 \\$'])
def test_any_name_can_be_drawn(name: str, tmp_path: Path) -> None:
    figure = Figure()
    figure.suptitle(plain(name))
    path = tmp_path / ('n' * 250 + '.PNG')
    save(figure, path)
    assert path.read_bytes().startswith(b'\x89PNG')


def test_name_without_ending_is_a_png(tmp_path: Path) -> None:
    save(Figure(), tmp_path / 'picture')
    assert (tmp_path / 'picture').read_bytes().startswith(b'\x89PNG')
    with pytest.raises(InvalidValueError, match='must be named like a picture'):
        save(Figure(), tmp_path / 'picture.yaml')


@pytest.mark.parametrize('backend', ['nonsense', 'TkAgg'])
def test_windows_do_not_matter(backend: str, tmp_path: Path) -> None:
    code = ('from pathlib import Path\nfrom flex_planner.plotting.figures import save\n'
            'from matplotlib.figure import Figure\nimport os\n'
            f'save(Figure(), Path({str(tmp_path / "a.png")!r}))\n'
            f'assert os.environ["MPLBACKEND"] == {backend!r}\n')
    environment = {**os.environ, 'MPLBACKEND': backend, 'MPLCONFIGDIR': str(tmp_path)}
    environment.pop('DISPLAY', None)
    ended = subprocess.run([sys.executable, '-c', code], env=environment, capture_output=True,
                           text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, '')
