"""Addresses of schedulers, right and wrong, and what answers there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import socket
import sys
import threading

from flex_planner.base.errors import InvalidValueError
from flex_planner.cli import main
from flex_planner.maps.addresses import check_address, greet
import pytest


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    with socket.create_server(('127.0.0.1', 0)) as server:
        yield server


def address(server: socket.socket) -> str:
    return f'tcp://127.0.0.1:{server.getsockname()[1]}'


@pytest.mark.parametrize(('text', 'place'), [
    ('tcp://host:8786', ('host', 8786)), ('10.0.0.1:80', ('10.0.0.1', 80)),
    ('tls://[::1]:9', ('::1', 9)), ('ws://a.b-c:65535', ('a.b-c', 65535))])
def test_address_is_host_and_port(text: str, place: tuple[str, int]) -> None:
    assert check_address(text) == place


@pytest.mark.parametrize('text', [
    '', 'nonsense', 'tcp://', 'tcp://host', 'tcp://host:', 'tcp://:8786', 'tcp://host:0',
    'tcp://host:65536', 'tcp://host:port', 'http://host:80', 'tcp://host:1/path', '://host:1',
    'tcp://[::1:80', 'tcp://a b:80', 'tcp://\x1b[31m:80', 'file:///etc/passwd', 'tcp://h:-1'])
def test_nonsense_is_refused_before_anything_is_loaded_or_written(
        text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch) -> None:
    for slow in ('dask', 'distributed', 'zarr'):
        monkeypatch.setitem(sys.modules, slow, None)
    store = tmp_path / 'new.zarr'
    assert main(['map', 'study.yaml', '--output', str(store), '--scheduler', text]) == 1
    said = capsys.readouterr().err
    assert said.startswith(f'flex-planner: --scheduler is {ascii(text)}, but must be an address')
    assert said.count('\n') == 1
    assert not store.exists()
    with pytest.raises(InvalidValueError):
        greet(text, 1.0)


def test_place_where_nobody_listens_is_told_at_once(listener: socket.socket) -> None:
    free = address(listener)
    listener.close()
    with pytest.raises(ConnectionRefusedError):
        greet(free, 60.0)


def test_silent_listener_is_given_up(listener: socket.socket) -> None:
    with pytest.raises(OSError, match='silent for 0.1 s'):
        greet(address(listener), 0.1)


@pytest.mark.parametrize('answer', [b'', b'HTTP', b'HTTP/1.1 400 Bad Request\r\n\r\n'])
def test_other_programs_are_no_schedulers(listener: socket.socket, answer: bytes) -> None:
    def serve() -> None:
        connection, _ = listener.accept()
        with connection:
            connection.sendall(answer)

    thread = threading.Thread(target=serve)
    thread.start()
    with pytest.raises(OSError, match='is no scheduler'):
        greet(address(listener), 10.0)
    thread.join()


def test_scheduler_is_known_by_its_greeting(listener: socket.socket) -> None:
    def serve() -> None:
        connection, _ = listener.accept()
        with connection:
            connection.sendall((120).to_bytes(8, 'little'))

    thread = threading.Thread(target=serve)
    thread.start()
    greet(address(listener), 10.0)
    thread.join()
