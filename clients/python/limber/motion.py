"""A motion that is kept up to date by its changes: for long ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Iterator

import numpy as np

from . import arrays
from .errors import LimberError
from .messages import service
from .newest import Changes
from .results import Result
from .stream import SessionStream

if TYPE_CHECKING:
    from .open_session import OpenSession


@dataclass(frozen=True)
class MotionUpdate:
    """Some frames of a motion that have changed. The motion itself is MotionStream.coordinates."""

    result: Result       # an early update is of none: its sequence is 0
    first_frame: int     # first_frame .. first_frame + frame_count - 1 are new
    frame_count: int
    whole: bool          # the motion is that of `result` now; else some frames are still those of the one before
    early: bool          # before their result is whole: frames in view, and frames near an edit
    missed: int          # messages lost just before; the motion was fetched anew where it needed that


class MotionStream(SessionStream):
    """Iterates over changes of a session's motion, and keeps the motion; made by Session.follow().

    A frame is not sent again if it differs from the one sent before by less than single precision shows. If messages were lost,
    the motion is fetched. Ends and raises as Session.stream().
    """

    def __init__(self, session: "OpenSession", timeout: float | None = None):
        """timeout: longest silence in seconds before LimberError TIMEOUT; None: wait as long as the server lives."""
        super().__init__(session, "changes", Changes(), timeout)
        self._motion: np.ndarray | None = None
        self._sequence = 0           # of the result whose frames these are; 0: of none
        self._begun = 0              # of the result that some frames are of already; 0: none
        self._parts = 0              # of its messages that have come
        self._hash = ""

    @property
    def sequence(self) -> int:
        """Number of the result that the motion is of; 0: of none."""
        return self._sequence

    @property
    def coordinates(self) -> np.ndarray:
        """frames x h float32 (float64 of rods and beams far from the origin), read-only: the motion as known now. It changes with
        the next update."""
        if self._motion is None:
            raise LimberError("FAILED_PRECONDITION", "there is no motion before the first update")
        view = self._motion.view()
        view.flags.writeable = False
        return view

    def positions(self, first: int = 0, count: int = 0) -> np.ndarray:
        """frames x nodes x 3 [length unit], float32 or, far from the origin, float64, of `count` frames (0: to the last)."""
        wanted = service.Frames(encoding=service.ENCODING_COORDINATES, basis_hash=self._hash)
        frames = self.coordinates
        return self._session.geometry_for(wanted).positions(frames[first:first + count if count else len(frames)])

    def __iter__(self) -> Iterator[MotionUpdate]:
        return self

    def __next__(self) -> MotionUpdate:
        return self.next(self._timeout)

    def next(self, timeout: float | None = None) -> MotionUpdate:
        """The next update, waiting at most timeout seconds; StopIteration once the session is closed."""
        missed = 0
        while True:
            taken = self._take(timeout)
            missed += taken.missed
            update = self._put(taken.frames, missed)
            if update is not None:
                return update

    def _put(self, frames: "service.Frames", missed: int) -> MotionUpdate | None:
        changes, sequence = frames.changes, frames.result.sequence
        if changes.early:
            if self._motion is None or changes.base_sequence != self._sequence or self._begun:
                return None
            self._write(frames)
            return self._update(frames, whole=False, missed=missed)
        if sequence <= self._sequence:
            return None
        if changes.part != (self._parts if sequence == self._begun else 0):
            return self._fetch(missed)
        if changes.part == 0 and (changes.base_sequence != self._sequence or self._sequence == 0):
            if changes.base_sequence != 0:
                return self._fetch(missed)
            self._begin(frames)
        self._write(frames)
        self._begun, self._parts = (sequence, changes.part + 1) if changes.more else (0, 0)
        if not changes.more:
            self._sequence = sequence
        return self._update(frames, whole=not changes.more, missed=missed)

    def _begin(self, frames: "service.Frames") -> None:
        data = arrays.to_numpy(frames.data, "frames")
        self._motion = np.zeros((frames.changes.motion_frames, *data.shape[1:]), data.dtype)
        self._hash = frames.basis_hash
        self._sequence = 0

    def _fetch(self, missed: int) -> MotionUpdate:
        frames = self._session.raw_frames()
        self._motion = np.array(arrays.to_numpy(frames.data, "frames"))
        self._hash = frames.basis_hash
        self._sequence, self._begun, self._parts = frames.result.sequence, 0, 0
        return self._update(frames, whole=True, missed=missed)

    def _write(self, frames: "service.Frames") -> None:
        if not frames.frame_count:
            return
        data = arrays.to_numpy(frames.data, "frames")
        end = frames.first_frame + frames.frame_count
        if len(data) != frames.frame_count or end > len(self._motion) or data.shape[1:] != self._motion.shape[1:]:
            raise LimberError("MALFORMED", "frames that do not fit the motion", "frames")
        self._motion[frames.first_frame:end] = data

    def _update(self, frames: "service.Frames", whole: bool, missed: int) -> MotionUpdate:
        return MotionUpdate(self._session.result_of(frames.result), frames.first_frame, frames.frame_count, whole,
                            frames.changes.early, missed)
