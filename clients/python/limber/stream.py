"""Frames as they are published: an iterator over the stream socket."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Iterator

import numpy as np
import zmq
import zmq.utils.monitor
from google.protobuf.message import DecodeError

from . import checks
from .connection import configure
from .errors import LimberError, ServerUnreachable
from .messages import service, stream
from .results import ENCODINGS, Result, decode

if TYPE_CHECKING:
    from .session import Session

# Messages that wait in this process for a reader that is slow. A motion may have megabytes: what does not fit is left
# out by the server, which tells so by the sequence numbers.
QUEUE = 8


@dataclass(frozen=True)
class StreamedFrames:
    """A published result with its frames (all, or a range)."""

    result: Result
    first_frame: int
    missed: int                 # messages of this topic lost just before this one; 0: none
    received: float             # time.monotonic() at reception [s]
    raw: "service.Frames" = field(repr=False)
    _session: "Session" = field(repr=False)

    @property
    def positions(self) -> np.ndarray:
        """frames x nodes x 3 float32 [length unit], decoded when asked for."""
        return decode(self.raw, self._session.geometry_for(self.raw))


class FrameStream:
    """Iterates over the results of a session, oldest first; made by Session.stream().

    Subscribes first, then asks for the newest frames (the Clone pattern), so nothing falls between the two. Ends when
    the session is closed. Not for several threads at once.
    """

    def __init__(self, session: "Session", encoding: str = "coordinates", timeout: float | None = None,
                 snapshot: bool = True):
        """timeout: longest silence in seconds before LimberError TIMEOUT; None: wait as long as the server lives."""
        checks.one_of(encoding, ENCODINGS, "encoding")
        if timeout is not None:
            checks.real(timeout, "timeout")
        self.missed = 0
        self._session = session
        self._timeout = timeout
        self._sequence: dict[bytes, int] = {}
        self._newest = (0, -1)  # (result sequence, first frame) handed out last: the server may send frames again
        self._queue: deque[StreamedFrames] = deque()
        connection = session.connection
        self._frames_topic = f"session/{session.id}/body/0/{encoding}".encode()
        self._status_topic = f"session/{session.id}/status".encode()
        self._socket = connection.context.socket(zmq.SUB)
        try:
            configure(self._socket, connection.keys)
            self._socket.rcvhwm = QUEUE
            self._socket.subscribe(self._frames_topic)
            self._socket.subscribe(self._status_topic)
            self._connect(session.server.stream_endpoint)
            if snapshot:
                self._take_snapshot(encoding)
        except BaseException:
            self._socket.close()
            raise

    def __iter__(self) -> Iterator[StreamedFrames]:
        return self

    def __enter__(self) -> "FrameStream":
        return self

    def __exit__(self, *exc) -> None:
        self.close()

    def __next__(self) -> StreamedFrames:
        if self._queue:
            return self._queue.popleft()
        return self.next(self._timeout)

    def next(self, timeout: float | None = None) -> StreamedFrames:
        """The next frames, waiting at most timeout seconds; StopIteration once the session is closed."""
        if self._queue:
            return self._queue.popleft()
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            if self._socket.closed:
                raise StopIteration
            left = 5.0 if deadline is None else min(5.0, deadline - time.monotonic())
            if left > 0 and self._socket.poll(int(left * 1000) + 1):
                frames = self._receive()
                if frames is not None:
                    return frames
            elif deadline is not None and time.monotonic() >= deadline:
                raise LimberError("TIMEOUT", f"no frames of session {self._session.id} within {timeout:g} s")
            else:
                self._check_session()

    def close(self) -> None:
        """Unsubscribes."""
        self._socket.close()

    def _connect(self, endpoint: str) -> None:
        # A subscription counts once the peer has it; it is sent right after the handshake.
        monitor = self._socket.get_monitor_socket(zmq.EVENT_HANDSHAKE_SUCCEEDED)
        try:
            self._socket.connect(endpoint)
            if not monitor.poll(int(1000 * self._session.connection.timeout)):
                raise ServerUnreachable(f"no stream at {endpoint}")
            zmq.utils.monitor.recv_monitor_message(monitor)
        finally:
            self._socket.disable_monitor()
            monitor.close()

    def _take_snapshot(self, encoding: str) -> None:
        try:
            frames = self._session.raw_frames(encoding=encoding)
        except LimberError as error:
            if error.code not in ("FAILED_PRECONDITION", "NOT_FOUND"):
                raise
            return  # nothing solved so far
        self._hand_out(frames, 0)

    def _hand_out(self, frames: "service.Frames", missed: int) -> None:
        self._newest = (frames.result.sequence, frames.first_frame)
        self._queue.append(StreamedFrames(Result.from_message(frames.result), frames.first_frame, missed,
                                          time.monotonic(), frames, self._session))

    def _receive(self) -> StreamedFrames | None:
        parts = self._socket.recv_multipart()
        try:
            message = stream.StreamMessage.FromString(parts[-1])
        except DecodeError:
            return None
        topic = parts[0]
        before = self._sequence.get(topic)
        self._sequence[topic] = message.sequence
        missed = 0 if before is None else max(0, message.sequence - before - 1)
        kind = message.WhichOneof("payload")
        if kind == "status" and topic == self._status_topic:
            if message.status.state == service.SESSION_STATE_CLOSED:
                self.close()
                raise StopIteration
            if message.status.state == service.SESSION_STATE_FAILED:
                raise LimberError("FAILED_PRECONDITION", f"session {message.session} failed: {message.status.message}")
        elif kind == "frames" and topic == self._frames_topic:
            self.missed += missed
            if (message.frames.result.sequence, message.frames.first_frame) > self._newest:
                self._hand_out(message.frames, missed)
                return self._queue.popleft()
        return None

    def _check_session(self) -> None:
        try:
            status = self._session.status()
        except ServerUnreachable:
            raise
        except LimberError as error:
            if error.code == "NOT_FOUND":
                self.close()
                raise StopIteration from error
            raise
        if status.state == service.SESSION_STATE_CLOSED:
            self.close()
            raise StopIteration
