"""Frames as they are published: an iterator over the messages of a stream."""

from __future__ import annotations

import time
import weakref
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Iterator

import numpy as np
import zmq
import zmq.utils.monitor

from . import checks
from .connection import NEXT_RUN, SILENCE, configure
from .errors import LimberError, ServerStopped, ServerUnreachable
from .following import Following
from .messages import service
from .newest import Newest, Waiting
from .reception import Reception
from .results import ENCODINGS, Result, decode

if TYPE_CHECKING:
    from .open_session import OpenSession


@dataclass(frozen=True)
class StreamedFrames:
    """A published result with its frames (all, or a range)."""

    result: Result
    first_frame: int
    missed: int                 # messages of this topic lost just before this one; 0: none
    received: float             # time.monotonic() at reception [s]
    raw: "service.Frames" = field(repr=False)
    _session: "OpenSession" = field(repr=False)

    @property
    def positions(self) -> np.ndarray:
        """frames x nodes x 3 [length unit], float32 or, far from the origin, float64, decoded on request."""
        return decode(self.raw, self._session.geometry_for(self.raw))


class SessionStream:
    """Messages published for a session under one topic, oldest first: the part that streams of all sorts share.

    Ends when the session is closed; raises ServerUnreachable when the server has ended (ServerStopped, one of those, after an
    orderly stop) and ServerRestarted when it was restarted. If the server stores the session, the stream continues after an
    orderly restart (SIGTERM) of up to a minute, and another one of a few seconds. Not for several threads at once.
    """

    def __init__(self, session: "OpenSession", topic: str, newest: Newest, timeout: float | None):
        if timeout is not None:
            checks.seconds(timeout, "timeout")
        self._session = session
        self._timeout = timeout
        self._checked = 0.0
        self._awaited_until = 0.0  # another run of limberd
        connection = session.connection
        frames_topic = f"session/{session.id}/body/0/{topic}".encode()
        status_topic = f"session/{session.id}/status".encode()
        if session.server.follow_endpoint:
            self._reception = Following(session, session.server.follow_endpoint, frames_topic, status_topic, newest)
        else:
            self._reception = self._subscribe(frames_topic, status_topic, newest)
        # A stream that is dropped without being closed ends too, and so does one whose connection is closed.
        self._end = weakref.finalize(self, self._reception.close)
        connection.before_closing(self._reception)

    @property
    def missed(self) -> int:
        """Messages lost so far, up to the frames that were handed out last."""
        return self._reception.newest.missed

    @property
    def cut_offs(self) -> list[str]:
        """Why the server has ended this stream, each time, in words, the newest 16: it had not been read for long, or its
        connection had ended. It continued by itself, with the newest frames; `missed` counts messages that passed meanwhile."""
        return list(self._reception.cut_offs)

    def __enter__(self):
        return self

    def __exit__(self, *exc) -> None:
        self.close()

    def close(self) -> None:
        """Unsubscribes."""
        self._end()

    def _take(self, timeout: float | None) -> Waiting:
        """The next frames that wait; StopIteration once the session is closed."""
        deadline = None if timeout is None else time.monotonic() + checks.seconds(timeout, "timeout")
        newest = self._reception.newest
        while True:
            now = time.monotonic()
            suspicious = max(newest.heard, self._checked) + SILENCE
            taken = newest.take(max(0.0, min(suspicious, suspicious if deadline is None else deadline) - now))
            if newest.closed and taken is None:
                if newest.reason is not None:
                    raise newest.reason
                raise StopIteration
            if isinstance(taken, service.SessionStatus):
                self._obey(taken)
            elif taken is not None:
                return taken
            elif deadline is not None and time.monotonic() >= deadline:
                raise self._session.late(f"no frames within {timeout:g} s")
            elif time.monotonic() >= max(newest.heard, self._checked) + SILENCE:
                self._check_session()
                self._checked = time.monotonic()

    def _subscribe(self, frames_topic: bytes, status_topic: bytes, newest: Newest) -> Reception:
        """For a server that has only the stream socket."""
        connection = self._session.connection
        socket = connection.context.socket(zmq.SUB)
        try:
            configure(socket, connection.keys)
            socket.subscribe(frames_topic)
            socket.subscribe(status_topic)
            self._connect(socket, self._session.server.stream_endpoint)
            return Reception(connection.context, socket, self._session, frames_topic, status_topic, newest)
        except BaseException:
            socket.close()
            raise

    def _connect(self, socket: zmq.Socket, endpoint: str) -> None:
        # A subscription counts once the peer has it; it is sent right after the handshake.
        monitor = socket.get_monitor_socket(zmq.EVENT_HANDSHAKE_SUCCEEDED)
        try:
            socket.connect(endpoint)
            if not monitor.poll(int(1000 * self._session.connection.timeout)):
                raise ServerUnreachable(f"no stream at {endpoint}")
            zmq.utils.monitor.recv_monitor_message(monitor)
        finally:
            socket.disable_monitor()
            monitor.close()

    def _obey(self, status: "service.SessionStatus") -> None:
        if status.state == service.SESSION_STATE_CLOSED:
            said = status.HasField("next_run_follows")
            if status.next_run_follows or not said and status.server_stopped and status.is_stored:
                self._awaited_until = time.monotonic() + NEXT_RUN
                return  # where none comes, silence tells
            self.close()
            if status.server_stopped:
                raise ServerStopped(f"limberd was stopped, and session {self._session.id} with it")
            raise StopIteration
        if status.state == service.SESSION_STATE_FAILED:
            raise LimberError("FAILED_PRECONDITION", f"session {self._session.id} failed: {status.message}")

    def _check_session(self) -> None:
        connection = self._session.connection
        try:
            # Answered at once however busy limberd is, which status() need not be.
            connection.ask_whether_there()
            status = self._session.status()
        except ServerUnreachable:
            if time.monotonic() < self._awaited_until:
                return
            raise
        except LimberError as error:
            if error.code == "NOT_FOUND":
                self.close()
                raise StopIteration from error
            raise
        self._obey(status)


class FrameStream(SessionStream):
    """Iterates over the results of a session, oldest first; made by Session.stream().

    Subscribes first, then asks for the newest frames (the Clone pattern), so nothing falls between the two. At most 8
    messages wait for a reader that pauses: the newest, and `missed` counts the others.
    """

    def __init__(self, session: "OpenSession", encoding: str = "coordinates", timeout: float | None = None,
                 snapshot: bool = True):
        """timeout: longest silence in seconds before LimberError TIMEOUT; None: wait as long as the server lives."""
        checks.one_of(encoding, ENCODINGS, "encoding")
        checks.flag(snapshot, "snapshot")
        super().__init__(session, encoding, Newest(), timeout)
        try:
            if snapshot:
                self._take_snapshot(encoding)
        except BaseException:
            self.close()
            raise

    def __iter__(self) -> Iterator[StreamedFrames]:
        return self

    def __next__(self) -> StreamedFrames:
        return self.next(self._timeout)

    def next(self, timeout: float | None = None) -> StreamedFrames:
        """The next frames, waiting at most timeout seconds; StopIteration once the session is closed."""
        taken = self._take(timeout)
        return StreamedFrames(self._session.result_of(taken.frames.result), taken.frames.first_frame, taken.missed,
                              taken.received, taken.frames, self._session)

    def _take_snapshot(self, encoding: str) -> None:
        try:
            frames = self._session.raw_frames(encoding=encoding)
        except LimberError as error:
            if error.code not in ("FAILED_PRECONDITION", "NOT_FOUND"):
                raise
            return  # nothing solved so far
        self._reception.newest.begin_with(frames)
