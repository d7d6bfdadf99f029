"""Pictures are written whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flex_planner.plotting.figures import save
from matplotlib.figure import Figure
import pytest


def test_picture_is_written_whole_or_not_at_all(tmp_path: Path,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: Figure, path: Path, **options: Any) -> None:
        path.write_bytes(b'half')
        raise KeyboardInterrupt

    path = tmp_path / 'picture.png'
    path.write_bytes(b'whole')
    monkeypatch.setattr(Figure, 'savefig', interrupted)
    with pytest.raises(KeyboardInterrupt):
        save(Figure(), path)
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [
        ('picture.png', b'whole')]
