"""A stream against credit: unread messages wait at the server, bounded in bytes and counted (follow.proto).

The thread of a Reception reads all messages, and reports its position. If the connection ends, libzmq makes another one, and the
stream continues: the server sends a snapshot if anything was published meanwhile.
"""

from __future__ import annotations

import secrets
import threading
from collections import deque
from typing import TYPE_CHECKING

import zmq
import zmq.utils.monitor
from google.protobuf.message import DecodeError

from .connection import configure
from .errors import LimberError, ServerUnreachable, from_message
from .messages import common, follow, service, stream
from .newest import Newest
from .reception import Reception
from .version import PROTOCOL

if TYPE_CHECKING:
    from .open_session import OpenSession

# Credit is given again when this part of the window is read.
_SHARE = 4
# Once a stream has begun, a server that ends or has no room for a reply does not end it: the next handshake asks again.
_OF_NOW = (common.ERROR_CODE_SHUTTING_DOWN, common.ERROR_CODE_LIMIT_EXCEEDED)
# The newest reasons for which the server ended the stream are kept.
_MOST_REASONS = 16


class Following(Reception):
    """As a Reception of a SUB socket, by a DEALER connected to the request socket."""

    def __init__(self, session: "OpenSession", endpoint: str, frames_topic: bytes, status_topic: bytes, newest: Newest):
        connection = session.connection
        self.cut_offs: "deque[str]" = deque(maxlen=_MOST_REASONS)
        self._name = secrets.token_hex(16)
        self._client_name = connection.client_name
        self._after: "dict[bytes, int]" = dict.fromkeys((frames_topic, status_topic), 0)
        self._instance = ""
        self._read_bytes = self._granted = 0
        self._window = 4 << 20
        self._answered = threading.Event()
        self._refusal: "LimberError | None" = None
        socket = connection.context.socket(zmq.DEALER)
        try:
            configure(socket, connection.keys)
            self._handshakes = socket.get_monitor_socket(zmq.EVENT_HANDSHAKE_SUCCEEDED)
            socket.connect(endpoint)
        except BaseException:
            socket.close()
            raise
        super().__init__(connection.context, socket, session, frames_topic, status_topic, newest)
        if not self._answered.wait(connection.timeout):
            self.close()
            raise ServerUnreachable(f"no stream at {endpoint}")
        if self._refusal is not None:
            self.close()
            raise self._refusal

    def _watched(self) -> "list[zmq.Socket]":
        return [self._handshakes]

    def _look_at(self, watched: zmq.Socket, socket: zmq.Socket) -> None:
        """A connection was made, the first one or another."""
        zmq.utils.monitor.recv_monitor_message(watched)
        try:
            while True:  # messages of the previous one were read
                self._take(socket, socket.recv_multipart(zmq.NOBLOCK))
        except zmq.Again:
            pass
        self._ask(socket)

    def _end(self, socket: zmq.Socket) -> None:
        socket.disable_monitor()
        self._handshakes.close()

    def _ask(self, socket: zmq.Socket) -> None:
        self._granted = self._read_bytes
        topics = [follow.FollowedTopic(prefix=topic, after=after) for topic, after in self._after.items()]
        request = service.Request(version=PROTOCOL, client_name=self._client_name, follow=follow.FollowRequest(
            stream=self._name, topics=topics, read_bytes=self._read_bytes, instance=self._instance))
        try:
            socket.send(request.SerializeToString(), zmq.NOBLOCK)
        except zmq.Again:
            pass  # not connected: the next handshake asks

    def _take(self, socket: zmq.Socket, parts: "list[bytes]") -> None:
        if len(parts) == 1:
            self._note_reply(parts[0])
        elif len(parts) == 3:
            self._put(parts[:2])
            try:
                self._read_bytes = follow.StreamPosition.FromString(parts[2]).sent_bytes
            except DecodeError:
                return
            if not self._granted <= self._read_bytes < self._granted + self._window // _SHARE:
                self._ask(socket)

    def _note(self, topic: bytes, message: "stream.StreamMessage") -> None:
        self._instance = message.instance
        self._after[topic] = message.sequence

    def _note_reply(self, data: bytes) -> None:
        try:
            reply = service.Reply.FromString(data)
        except DecodeError:
            return
        if reply.WhichOneof("body") == "follow":
            self._window = reply.follow.window_bytes or self._window
            if reply.follow.cut_off:
                self.cut_offs.append(reply.follow.cut_off)
        elif reply.WhichOneof("body") == "error":
            if self._answered.is_set() and reply.error.code in _OF_NOW:
                return
            self._refusal = from_message(reply.error)
            self.newest.close(self._refusal)
        self._answered.set()
