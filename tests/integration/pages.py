"""What a browser does, by plain sockets: HTTP requests and WebSockets, with or without manners."""

import base64
import contextlib
import json
import os
import socket
import struct
import time

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


def ready_file(server):
    """What a launched server says of itself."""
    return json.loads((server.folder / "ready").read_text())


def connect(address, receive_buffer=None):
    """A connection to HOST:PORT, whose kernel holds so many received bytes."""
    host, port = address.rsplit(":", 1)
    connection = socket.socket(socket.AF_INET6 if host.startswith("[") else socket.AF_INET)
    if receive_buffer:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    connection.settimeout(20)
    connection.connect((host.strip("[]"), int(port)))
    return connection


def head(address, target="/", method="GET", **fields):
    """The lines of a request; a field that is None is left out, of a list there are several."""
    lines = [f"{method} {target} HTTP/1.1"]
    for name, values in ({"Host": address} | {name.replace("_", "-"): value for name, value in fields.items()}).items():
        lines += [f"{name}: {value}" for value in (values if isinstance(values, list) else [values]) if value is not None]
    return ("\r\n".join(lines) + "\r\n\r\n").encode()


UPGRADE = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec_WebSocket_Version": "13",
           "Sec_WebSocket_Key": base64.b64encode(bytes(16)).decode()}


def read_answer(connection):
    """Status, fields by name in lower case, and the body."""
    data = b""
    while b"\r\n\r\n" not in data:
        more = connection.recv(4096)
        assert more, f"the connection ended after {data!r}"
        data += more
    top, body = data.split(b"\r\n\r\n", 1)
    first, *lines = top.decode().split("\r\n")
    fields = {name.lower(): value.strip() for name, value in (line.split(":", 1) for line in lines)}
    while len(body) < int(fields.get("content-length", 0)):
        more = connection.recv(65536)
        assert more, "the connection ended within the body"
        body += more
    return int(first.split()[1]), fields, body


def ask(address, target="/", method="GET", **fields):
    """Answer to one request on a connection of its own."""
    with connect(address) as connection:
        connection.sendall(head(address, target, method, Connection=fields.pop("Connection", "close"), **fields))
        return read_answer(connection) if method != "HEAD" else read_head(connection)


def read_head(connection):
    data = b""
    while more := connection.recv(4096):
        data += more
    top, rest = data.split(b"\r\n\r\n", 1)
    assert rest == b""
    return int(top.split()[1]), top.decode()


class Closed(Exception):
    """The server has closed the WebSocket; `code` is None where it did so without a word."""

    def __init__(self, code, reason):
        super().__init__(f"{code} {reason}")
        self.code, self.reason = code, reason


class Socket:
    """A WebSocket of a page."""

    def __init__(self, address, target, receive_buffer=None, **fields):
        self.connection = connect(address, receive_buffer)
        self.connection.sendall(head(address, target, **(UPGRADE | {"Origin": f"http://{address}"} | fields)))
        self._data = b""
        answer = b""
        while b"\r\n\r\n" not in answer:
            more = self.connection.recv(1)
            assert more, "no answer"
            answer += more
        self.status = int(answer.split()[1])
        assert self.status == 101, answer

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.connection.close()

    def send(self, data, opcode=BINARY, last=True, mask=b"\x11\x22\x33\x44"):
        """One frame; mask: b"" for none, which no browser sends."""
        size = len(data)
        lengths = bytes([size]) if size < 126 else struct.pack(">BH", 126, size) if size < 65536 else \
            struct.pack(">BQ", 127, size)
        first = bytes([(0x80 if last else 0) | opcode, lengths[0] | (0x80 if mask else 0)])
        if mask:
            repeated = mask * (size // 4 + 1)
            data = (int.from_bytes(data, "big") ^ int.from_bytes(repeated[:size], "big")).to_bytes(size, "big")
        self.connection.sendall(first + lengths[1:] + mask + data)

    def _read(self, count):
        while len(self._data) < count:
            try:
                more = self.connection.recv(1 << 16)
            except ConnectionResetError:
                more = b""
            if not more:
                raise Closed(None, "")
            self._data += more
        taken, self._data = self._data[:count], self._data[count:]
        return taken

    def frame(self):
        """opcode, payload"""
        first, size = self._read(2)
        assert first & 0x80, "whole messages"
        assert not size & 0x80, "servers do not mask"
        if size == 126:
            size, = struct.unpack(">H", self._read(2))
        elif size == 127:
            size, = struct.unpack(">Q", self._read(8))
        return first & 0x0F, self._read(size)

    def receive(self, timeout=20):
        """The next binary message. Raises Closed at the end, TimeoutError if there is none."""
        self.connection.settimeout(timeout)
        while True:
            opcode, data = self.frame()
            if opcode == CLOSE:
                with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                    self.send(data, CLOSE)
                raise Closed(*struct.unpack(">H", data[:2]), data[2:].decode()) if data else Closed(1005, "")
            if opcode == PING:
                self.send(data, PONG)
            elif opcode == BINARY:
                return data
            else:
                assert opcode == PONG, f"a frame of kind {opcode}"


class Page:
    """Both WebSockets, with the messages of limber.v1. server: launched, with --web."""

    def __init__(self, server, **options):
        from limber.v1 import service_pb2, stream_pb2

        self._service, self._stream = service_pb2, stream_pb2
        ready = ready_file(server)
        self.address, self.token = ready["web"].removeprefix("http://"), ready["web_token"]
        self.options = options
        self._id = int.from_bytes(os.urandom(4), "big")
        self.requests = self.open("/v1/requests")
        self.stream = self.open("/v1/stream")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def open(self, path, **options):
        return Socket(self.address, f"{path}?token={self.token}", **(self.options | options))

    def close(self):
        self.requests.connection.close()
        self.stream.connection.close()

    def request(self, **body):
        """A Request with one body, given as a message or a dict of its fields."""
        (name, value), = body.items()
        self._id += 1
        request = self._service.Request(version=1, id=self._id, **{name: value})
        getattr(request, name).SetInParent()
        return request

    def send(self, **body):
        request = self.request(**body)
        self.requests.send(request.SerializeToString())
        return request.id

    def reply(self, timeout=20):
        return self._service.Reply.FromString(self.requests.receive(timeout))

    def ask(self, **body):
        sent = self.send(**body)
        reply = self.reply()
        assert reply.id == sent
        return reply

    def subscribe(self, prefix, socket=None):
        (socket or self.stream).send(b"\x01" + prefix.encode())

    def unsubscribe(self, prefix):
        self.stream.send(b"\x00" + prefix.encode())

    def message(self, timeout=20, socket=None):
        """topic, StreamMessage"""
        data = (socket or self.stream).receive(timeout)
        end = 1 + data[0]
        return data[1:end].decode(), self._stream.StreamMessage.FromString(data[end:])


def eventually(condition, patience=20.0):
    """Whether it comes true."""
    deadline = time.monotonic() + patience
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True
