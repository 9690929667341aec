"""Long answers, fetched in parts (parts.proto): answers to other requests of the connection pass between two."""

from __future__ import annotations

import math
import time
from typing import Any, Callable

from .errors import LimberError
from .messages import parts, service

# Whose answers are as large as a session's scene, basis or structure. Frames of a motion come in parts of their own,
# where they can be divided.
LONG = frozenset({"get_frames", "get_geometry", "get_material", "get_session", "save_session", "get_design",
                  "get_beam_solution", "explain", "get_sample"})

Ask = Callable[["parts.GetReplyPartRequest"], "parts.GetReplyPartResponse"]
Clock = Callable[[], float]


class PartSize:
    """Bytes to request at once. Answers to other requests of the connection pass between two parts. One part should therefore
    take some hundredths of a second more than the shortest did: the rest of its time is the round trip."""

    LEAST, MOST = 64 << 10, 4 << 20
    QUICK, SLOW = 0.01, 0.03  # [s]

    def __init__(self) -> None:
        self.bytes = self.LEAST
        self._shortest = math.inf

    def note(self, seconds: float) -> None:
        """How long a part of this size took from its request to its end."""
        self._shortest = min(self._shortest, seconds)
        more = seconds - self._shortest
        if more < self.QUICK:
            self.bytes = min(2 * self.bytes, self.MOST)
        elif more > self.SLOW:
            self.bytes = max(self.bytes // 2, self.LEAST)


def may_be_long(kind: str, message: Any) -> bool:
    """For a request: whether its answer is to come in parts if it is long."""
    return kind in LONG and not getattr(message, "most_bytes", 0)


def is_gone(error: LimberError) -> bool:
    """The server no longer keeps the answer whose parts were fetched: request it anew."""
    return error.code == "FAILED_PRECONDITION" and error.field == "reply"


def is_of_older_server(error: LimberError) -> bool:
    """It refuses a field of a request that it does not know: that its answer can come in parts."""
    field = service.Request.DESCRIPTOR.fields_by_name["most_reply_bytes"].number
    return error.code == "INVALID_ARGUMENT" and f"unknown field number {field} " in str(error)


def whole(first: "parts.GetReplyPartResponse", ask: Ask, clock: Clock = time.monotonic) -> bytes:
    """The bytes of a reply whose first part came in its place. Raises the error of is_gone() if its connection ended."""
    size = PartSize()
    data = bytearray(first.data)
    while len(data) < first.total_bytes:
        begin = clock()
        part = ask(parts.GetReplyPartRequest(reply=first.reply, offset=len(data), most_bytes=size.bytes))
        size.note(clock() - begin)
        if part.offset != len(data) or not part.data:
            raise LimberError("MALFORMED", "a part of a long answer is not the next one")
        data += part.data
    return bytes(data)
