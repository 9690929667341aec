"""Records the messages between clients and a server, from between the two."""

from __future__ import annotations

import threading
from pathlib import Path

import zmq
from google.protobuf.message import DecodeError

from .errors import LimberError
from .messages import service
from .recording import REPLY, REQUEST, Writer


def _for_whole_reply(data: bytes) -> bytes:
    """A request whose reply comes in one: parts of another server's replies would have other numbers and ends."""
    try:
        request = service.Request.FromString(data)
    except DecodeError:
        return data  # recorded as it came
    if not request.most_reply_bytes:
        return data
    request.ClearField("most_reply_bytes")
    return request.SerializeToString()


class Recorder:
    """An endpoint for clients that passes their requests on to a server, and the replies back, and records both.

    Long replies come whole, also to clients that ask for them in parts. Published messages (frames, status) are not recorded:
    connections that follow streams are passed on, and subscribers read from the server itself. It takes no CURVE keys. To the
    server, a client stays connected until the recorder is closed.
    """

    def __init__(self, server_endpoint: str, path: "str | Path", bind: str = "tcp://127.0.0.1:*", **about: object):
        self._writer = Writer(path, **about)
        self._context = zmq.Context()
        self._clients = self._context.socket(zmq.ROUTER)
        self._clients.linger = 1000
        try:
            self._clients.bind(bind)
        except zmq.ZMQError as error:
            self._context.destroy(linger=0)
            self._writer.close()
            raise LimberError("INVALID_ARGUMENT", f"cannot bind {bind!r}: {error}", "bind") from error
        self.endpoint: str = self._clients.last_endpoint.decode().rstrip("\0")
        self.messages = 0
        self._server_endpoint = server_endpoint
        self._connections: "dict[bytes, tuple[int | None, zmq.Socket]]" = {}  # None: it follows streams
        self._recorded = 0  # of them
        self._is_ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="limber-recorder", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the recording; it is whole then."""
        self._is_ending.set()
        self._thread.join()
        self._writer.close()
        self._context.destroy()

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _run(self) -> None:
        poller = zmq.Poller()
        poller.register(self._clients, zmq.POLLIN)
        by_socket: "dict[zmq.Socket, bytes]" = {}
        while not self._is_ending.is_set():
            for socket, _ in poller.poll(100):
                if socket is self._clients:
                    client, *parts = socket.recv_multipart()
                    parts[-1] = _for_whole_reply(parts[-1])
                    if client not in self._connections:
                        server = self._connect()
                        poller.register(server, zmq.POLLIN)
                        by_socket[server] = client
                        self._connections[client] = (self._number(parts[-1]), server)
                    number, server = self._connections[client]
                    self._note(REQUEST, number, parts[-1])
                    server.send_multipart(parts)
                else:
                    parts, client = socket.recv_multipart(), by_socket[socket]
                    self._note(REPLY, self._connections[client][0], parts[-1])
                    self._clients.send_multipart([client, *parts])

    def _connect(self) -> zmq.Socket:
        server = self._context.socket(zmq.DEALER)
        server.linger = 1000
        server.connect(self._server_endpoint)
        return server

    def _number(self, first: bytes) -> "int | None":
        """Number of a connection, by its first request."""
        try:
            if service.Request.FromString(first).WhichOneof("body") == "follow":
                return None
        except DecodeError:
            pass  # recorded as it came
        self._recorded += 1
        return self._recorded - 1

    def _note(self, direction: int, connection: "int | None", data: bytes) -> None:
        if connection is None:
            return
        self.messages += 1
        self._writer.add(direction, connection, data)
