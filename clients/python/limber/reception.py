"""A thread that empties a stream socket, whether anybody reads or not.

libzmq 4.3.4 aborts the process (`_input_stopped`, `!_io_error`) when a socket with a full queue meets a missing heartbeat or the
end of the server. With a full queue it has stopped to read from the network. The queue of the socket therefore has no end, and is
always empty; the queue behind it is bounded.
"""

from __future__ import annotations

import contextlib
import itertools
import threading
from typing import TYPE_CHECKING, Collection

import zmq
from google.protobuf.message import DecodeError

from .errors import ServerRestarted
from .messages import stream
from .newest import Newest

if TYPE_CHECKING:
    from .open_session import OpenSession

_numbers = itertools.count(1)


class Reception:
    """Puts the messages of a connected SUB socket into a Newest. Owns the socket from now on."""

    cut_offs: "Collection[str]" = ()  # why the server has ended the stream, each time

    def __init__(self, context: zmq.Context, socket: zmq.Socket, session: "OpenSession", frames_topic: bytes,
                 status_topic: bytes, newest: Newest):
        self.newest = newest
        self._session = (session.id, session.uid, session.instance)
        self._topics = (frames_topic, status_topic)
        self._run_of_messages = session.instance
        self._lock = threading.RLock()  # the garbage collector may close it during a close
        address = f"inproc://limber-reception-{next(_numbers)}"
        self._control = context.socket(zmq.PAIR)
        self._control.linger = 0
        self._control.bind(address)
        stopped = context.socket(zmq.PAIR)
        stopped.linger = 0
        stopped.connect(address)
        self._thread = threading.Thread(target=self._run, args=(socket, stopped), name="limber-stream", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the thread and the socket; callers that wait for frames are woken. May be called again, and by any thread."""
        self.newest.close()
        with self._lock:
            if self._control.closed:
                return
            self._control.send(b"")
            if threading.current_thread() is not self._thread:
                self._thread.join()
            self._control.close()

    def _run(self, socket: zmq.Socket, stopped: zmq.Socket) -> None:
        with socket, stopped:
            poller = zmq.Poller()
            poller.register(socket, zmq.POLLIN)
            poller.register(stopped, zmq.POLLIN)
            watched = self._watched()
            for one in watched:
                poller.register(one, zmq.POLLIN)
            try:
                while True:
                    ready = dict(poller.poll())
                    if stopped in ready:
                        return
                    for one in watched:
                        if one in ready:
                            self._look_at(one, socket)
                    if socket in ready:
                        with contextlib.suppress(zmq.Again):  # it may have been read meanwhile
                            self._take(socket, socket.recv_multipart(zmq.NOBLOCK))
            finally:
                self._end(socket)

    def _watched(self) -> "list[zmq.Socket]":
        """Sockets besides the one that brings messages."""
        return []

    def _look_at(self, watched: zmq.Socket, socket: zmq.Socket) -> None:
        """One of these can be read."""

    def _end(self, socket: zmq.Socket) -> None:
        """Before the socket is closed, on the thread."""

    def _take(self, socket: zmq.Socket, parts: list[bytes]) -> None:
        self._put(parts)

    def _note(self, topic: bytes, message: "stream.StreamMessage") -> None:
        """A message of a topic of ours has come."""

    def _put(self, parts: list[bytes]) -> None:
        frames_topic, status_topic = self._topics
        if parts[0] not in self._topics:
            return  # subscriptions are prefixes
        try:
            message = stream.StreamMessage.FromString(parts[-1])
        except DecodeError:
            return
        self._note(parts[0], message)
        name, uid, instance = self._session
        if uid and message.session_uid not in (0, uid):  # not ours: it was closed, or went with its server
            restarted = ServerRestarted(f"limberd was restarted: session {name} is gone, another one has its name",
                                        "session")
            self.newest.close(restarted if message.instance != instance else None)
            return
        if message.instance != self._run_of_messages:
            self._run_of_messages = message.instance
            self.newest.begin_anew()
        kind = message.WhichOneof("payload")
        if kind == "frames" and parts[0] == frames_topic:
            self.newest.put_frames(message.sequence, message.frames)
        elif kind == "status" and parts[0] == status_topic:
            self.newest.put_status(message.status)
