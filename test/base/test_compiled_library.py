"""Libraries that are one file of C code."""

from __future__ import annotations

import ctypes
from pathlib import Path

from flex_planner.base import compiled_library
from flex_planner.base.compiled_library import load_once
from flex_planner.base.compiler import CompilerError
import pytest


def open_library(library: Path) -> ctypes.CDLL:
    return ctypes.CDLL(str(library))


def test_file_is_loaded_once(tmp_path: Path) -> None:
    source = tmp_path / 'answer.c'
    source.write_text('int answer(void) { return 42; }')
    library = load_once(source, ('-O1',), open_library, 'nothing is answered')
    assert library is not None
    assert library.answer() == 42
    assert load_once(source, ('-O1',), open_library, 'nothing is answered') is library


def test_missing_compiler_is_told_with_what_follows(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def find_none() -> list[str]:
        raise CompilerError('no C compiler found')

    told: list[str] = []
    monkeypatch.setattr(compiled_library, 'find_compiler', find_none)
    monkeypatch.setattr(compiled_library, 'warn_once', told.append)
    source = tmp_path / 'other.c'
    source.write_text('int other(void) { return 43; }  /* not kept */')
    for _ in range(2):
        assert load_once(source, (), open_library, 'it takes longer') is None
    assert told == ['no C compiler found: it takes longer']
