"""Addresses of Dask schedulers, checked before anything that takes long."""

from __future__ import annotations

import socket
import struct
from urllib.parse import urlsplit

from flex_planner.base.errors import InvalidValueError
from flex_planner.base.text import printable

_SCHEMES = ('tcp', 'tls', 'ws', 'wss')
_MOST = 2**20  # bytes of a greeting


def check_address(address: str) -> tuple[str, int]:
    """
    Return host and port of a scheduler.

    Raises
    ------
    InvalidValueError
        If it is no address.

    """
    scheme, slashes, place = address.rpartition('://')
    try:
        parts = urlsplit(f'//{place}')
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if ((slashes and scheme not in _SCHEMES) or not host or not port or parts.netloc != place
            or printable(place) != place or ' ' in place):
        raise InvalidValueError('--scheduler', address, 'an address such as tcp://host:8786')
    return host, port


def greet(address: str, timeout: float) -> None:
    """
    Raise OSError unless a scheduler answers in time [s].

    Dask itself tries for long where nobody listens, and without end where somebody is silent.

    """
    with socket.create_connection(check_address(address), timeout) as connection:
        if address.startswith(_SCHEMES) and not address.startswith('tcp'):
            return  # who encrypts is not the first to speak
        connection.settimeout(timeout)
        try:
            said = connection.recv(8, socket.MSG_WAITALL)
        except TimeoutError:
            raise OSError(f'what listens there is silent for {timeout:g} s') from None
        # the size of its greeting
        if len(said) < 8 or struct.unpack('<Q', said)[0] > _MOST:
            raise OSError('what listens there is no scheduler')
