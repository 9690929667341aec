"""Unread arrivals of a stream: the newest frames, and the newest status."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass

from .messages import service

# Messages with frames that wait in this process for a reader that is slow. A motion may have megabytes.
MOST = 8


@dataclass
class Waiting:
    """Frames that wait, and how many messages were lost just before them."""

    frames: "service.Frames"
    missed: int
    received: float  # time.monotonic() [s]


class Newest:
    """Bounded: of frames the newest MOST are kept, of the status the newest. Filled by one thread, read by another.

    A late reader finds the newest motion; results discarded for it are counted as missed, like those that never arrived.
    """

    def __init__(self, most: int = MOST):
        self.missed = 0                  # messages lost so far, of those that were taken and those in between
        self.heard = time.monotonic()    # when anything arrived last
        self._most = most
        self._changed = threading.Condition()
        self._frames: deque[Waiting] = deque()
        self._status: "service.SessionStatus | None" = None
        self._newest = (0, -1)           # (result sequence, first frame): the server may send frames again
        self._sequence: int | None = None
        self._lost = 0                   # before the next frames that are new
        self._closed = False
        self.reason: Exception | None = None  # why it was closed, where that is no ordinary end

    def begin_with(self, frames: "service.Frames") -> None:
        """Requested frames come before all newer ones, and replace the older ones."""
        with self._changed:
            at = (frames.result.sequence, frames.first_frame)
            newer = [one for one in self._frames if (one.frames.result.sequence, one.frames.first_frame) > at]
            self._frames = deque([Waiting(frames, 0, time.monotonic()), *newer])
            self._newest = max(self._newest, at)
            self._drop_oldest()
            self._changed.notify_all()

    def begin_anew(self) -> None:
        """From now on arrivals are of another run of the server, which may number results and messages from 1."""
        with self._changed:
            self._newest, self._sequence = (0, -1), None

    def put_frames(self, sequence: int, frames: "service.Frames") -> None:
        """sequence: of the message, in its topic."""
        with self._changed:
            self._note_sequence(sequence)
            at = (frames.result.sequence, frames.first_frame)
            if at > self._newest:
                self._newest = at
                self._append(frames)

    def put_status(self, status: "service.SessionStatus") -> None:
        with self._changed:
            self.heard = time.monotonic()
            self._status = status
            self._changed.notify_all()

    def close(self, reason: Exception | None = None) -> None:
        """Wakes waiting readers: nothing will come any more. reason: the error that a reader gets after the waiting frames."""
        with self._changed:
            if not self._closed:
                self.reason = reason
            self._closed = True
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        return self._closed

    def take(self, timeout: float) -> "Waiting | service.SessionStatus | None":
        """The oldest frames, else the newest status; None after `timeout` seconds without either, or once closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._frames or self._status is not None or self._closed, timeout)
            if self._closed and self.reason is None:
                return None
            if self._frames:
                taken = self._frames.popleft()
                self.missed += taken.missed
                return taken
            status, self._status = self._status, None
            return status

    def _note_sequence(self, sequence: int) -> None:
        self.heard = time.monotonic()
        if self._sequence is not None:
            self._lost += max(0, sequence - self._sequence - 1)
        self._sequence = sequence

    def _append(self, frames: "service.Frames") -> None:
        self._frames.append(Waiting(frames, self._lost, self.heard))
        self._lost = 0
        self._drop_oldest()
        self._changed.notify_all()

    def _drop_oldest(self) -> None:
        while len(self._frames) > self._most:
            gone = self._frames.popleft()
            self._frames[0].missed += gone.missed + 1


# Limits of changes that wait for a slow reader: messages, and bytes of frames.
MOST_CHANGES = 64
MOST_BYTES = 256 << 20


class Changes(Newest):
    """The same of messages that continue each other: all of them in order, also several of one result and those of none."""

    def __init__(self):
        super().__init__(MOST_CHANGES)

    def put_frames(self, sequence: int, frames: "service.Frames") -> None:
        with self._changed:
            self._note_sequence(sequence)
            self._append(frames)

    def _drop_oldest(self) -> None:
        super()._drop_oldest()
        waiting = sum(len(one.frames.data.data) for one in self._frames)
        while waiting > MOST_BYTES and len(self._frames) > 1:
            gone = self._frames.popleft()
            waiting -= len(gone.frames.data.data)
            self._frames[0].missed += gone.missed + 1
