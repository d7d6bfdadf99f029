"""Text files that appear whole or not at all."""

from __future__ import annotations

from pathlib import Path

from flex_planner.base.text_files import write_text
import pytest


def test_text_is_utf_8_whatever_it_holds(tmp_path: Path) -> None:
    path = tmp_path / ('n' * 250)
    write_text(path, 'λ \udcff')
    assert path.read_bytes() == 'λ '.encode() + rb'\udcff'


def test_older_text_stays_where_the_new_one_is_not_complete(tmp_path: Path) -> None:
    path = tmp_path / 'text'
    write_text(path, 'old')
    with pytest.raises(TypeError):
        write_text(path, 3)  # type: ignore[arg-type]
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [('text', 'old')]
