"""Files as they come, also through pipes or without any text, and as they are written."""

from __future__ import annotations

import io
import os
from pathlib import Path
import socket
import sys
import threading

from flex_planner.base.text_files import MAX_BYTES, read_text, TextFileError, write_text
import pytest

TEXT = 'name: Größe 🦾\nlinks: []\n'


@pytest.mark.parametrize('encoding', ['utf-8', 'utf-8-sig', 'utf-16', 'utf-16-le', 'utf-16-be',
                                      'utf-32'])
def test_text_of_any_unicode_encoding_is_read(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / 'text'
    file.write_bytes(TEXT.encode(encoding))
    assert read_text(file) == TEXT


@pytest.mark.parametrize(('data', 'problem'), [
    (b'', 'it is empty'), (b' \r\n\t', 'it is empty'), ('\ufeff'.encode(), 'it is empty'),
    ('name: Größe'.encode('latin-1'), 'it is no text in UTF-8 .byte 9 of 11.; save it as UTF-8'),
    (b'\xff\xfe\x00', 'it is no text in UTF-16'), (b'\x89PNG\r\n', 'it is no text in UTF-8'),
    (b'#' * (MAX_BYTES + 1), 'it is larger than 1000000 bytes')])
def test_file_without_text_gets_a_sentence(tmp_path: Path, data: bytes, problem: str) -> None:
    file = tmp_path / 'text'
    file.write_bytes(data)
    with pytest.raises(TextFileError, match=f'^{file}: cannot be read: {problem}'):
        read_text(file)


@pytest.mark.parametrize(('path', 'problem'), [
    ('/', 'it is a folder'), ('/dev/null', 'it is empty'),
    ('/dev/zero', 'it is larger than 1000000 bytes'), ('/nowhere', 'No such file')])
def test_what_is_no_file_gets_a_sentence(path: str, problem: str) -> None:
    with pytest.raises(TextFileError, match=f'^{path}: cannot be read: {problem}'):
        read_text(Path(path))


def test_socket_gets_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    with socket.socket(socket.AF_UNIX) as server:
        server.bind('socket')
        with pytest.raises(TextFileError, match='^socket: cannot be read: '):
            read_text(Path('socket'))


def test_pipe_is_read(tmp_path: Path) -> None:
    pipe = tmp_path / 'pipe'
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_text, args=(TEXT,), daemon=True)
    writer.start()
    assert read_text(pipe) == TEXT


def test_minus_is_the_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, 'stdin', io.TextIOWrapper(io.BytesIO(TEXT.encode())))
    assert read_text(Path('-')) == TEXT
    with pytest.raises(TextFileError, match='^the standard input: cannot be read: it is empty'):
        read_text(Path('-'))


def test_closed_standard_input_gets_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, 'stdin', None)
    with pytest.raises(TextFileError, match='^the standard input: cannot be read: it is closed'):
        read_text(Path('-'))


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
