"""Bytes on a socket, for what no client library sends."""

import socket
import ssl
import struct

_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
_HEADERS, _SETTINGS, _GOAWAY = 1, 4, 7
_WHOLE, _ACKNOWLEDGED = 5, 1


def connected(address, *, trusting=None, timeout=20):
    """A connection to ``host:port``, encrypted where there is a file of certificates to trust."""
    host, _, port = address.rpartition(":")
    plain = socket.create_connection((host, int(port)), timeout=timeout)
    if trusting is None:
        return plain
    return ssl.create_default_context(cafile=str(trusting)).wrap_socket(plain, server_hostname="localhost")


def _frame(kind, flags, stream, data=b""):
    return struct.pack(">I", len(data))[1:] + bytes((kind, flags)) + struct.pack(">I", stream) + data


def _literal(name, value):
    """A header as it is: neither indexed nor compressed."""
    return b"\x00" + bytes((len(name),)) + name + bytes((len(value),)) + value


def grpc_status(address, method, *headers):
    """Begin a call with headers that no client library sends, and wait for the answer to them: the kind of its frame."""
    head = ((b":method", b"POST"), (b":scheme", b"http"), (b":path", method.encode()), (b":authority", b"localhost"))
    more = ((b"content-type", b"application/grpc"), (b"te", b"trailers"), *headers)
    block = b"".join(_literal(*each) for each in (*head, *more))
    with connected(address) as connection, connection.makefile("rb") as answers:
        connection.sendall(_PREFACE + _frame(_SETTINGS, 0, 0) + _frame(_HEADERS, _WHOLE, 1, block))
        while (start := answers.read(9)) and len(start) == 9:
            answers.read(int.from_bytes(start[:3], "big"))
            if start[3] == _SETTINGS and not start[4] & _ACKNOWLEDGED:
                connection.sendall(_frame(_SETTINGS, _ACKNOWLEDGED, 0))
            if int.from_bytes(start[5:], "big") == 1 or start[3] == _GOAWAY:
                return start[3]
    return None
