"""Frames of a long motion, fetched in parts of one result."""

from __future__ import annotations

import time
from typing import Callable

from .errors import LimberError
from .messages import service
from .reply_parts import PartSize

# How often newer results may displace the one whose parts are fetched.
_TRIES = 3

Call = Callable[["service.GetFramesRequest"], "service.GetFramesResponse"]


def fetch(call: Call, request: "service.GetFramesRequest",
          clock: Callable[[], float] = time.monotonic) -> "list[service.Frames]":
    """The frames of a request in their order, all of one result, though edits go on; of a server that knows no parts, one."""
    size = PartSize()
    for _ in range(_TRIES):
        try:
            return _parts_of_one_result(call, request, size, clock)
        except LimberError as error:
            if _is_of_older_server(error):
                break
            if error.field != "result_sequence":
                raise
    return [call(request).frames]


def _is_of_older_server(error: LimberError) -> bool:
    """It refuses a field of the request that it does not know: that the answer can come in parts."""
    return error.code == "INVALID_ARGUMENT" and error.field == "get_frames"


def _parts_of_one_result(call: Call, request: "service.GetFramesRequest", size: PartSize,
                         clock: Callable[[], float]) -> "list[service.Frames]":
    wanted = service.GetFramesRequest()
    wanted.CopyFrom(request)

    def next_part() -> "service.GetFramesResponse":
        wanted.most_bytes = size.bytes
        begin = clock()
        answer = call(wanted)
        size.note(clock() - begin)
        return answer

    answer = next_part()
    parts = [answer.frames]
    while answer.frames_left:
        wanted.result_sequence = parts[0].result.sequence
        wanted.first_frame = parts[-1].first_frame + parts[-1].frame_count
        wanted.frame_count = answer.frames_left
        answer = next_part()
        if not answer.frames.frame_count:
            raise LimberError("MALFORMED", "a part of a motion has no frames", "frames")
        parts.append(answer.frames)
    return parts


def joined(parts: "list[service.Frames]") -> "service.Frames":
    """One message of them all; not of quantised positions, whose parts have boxes of their own."""
    if len(parts) == 1:
        return parts[0]
    whole = service.Frames()
    whole.CopyFrom(parts[0])
    whole.frame_count = whole.data.shape[0] = sum(part.frame_count for part in parts)
    whole.data.data = b"".join(part.data.data for part in parts)
    return whole
