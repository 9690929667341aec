"""Frames of a long motion, fetched in parts of one result."""

from __future__ import annotations

from typing import Callable

from .errors import LimberError
from .messages import service

# About so many bytes of frames come in one answer: those to other requests of the connection pass between two.
PART_BYTES = 2 << 20
# How often newer results may displace the one whose parts are fetched.
_TRIES = 3

Call = Callable[["service.GetFramesRequest"], "service.GetFramesResponse"]


def fetch(call: Call, request: "service.GetFramesRequest", part_bytes: int = PART_BYTES) -> "list[service.Frames]":
    """The frames of a request in their order, all of one result, though edits go on; of a server that knows no parts, one."""
    for _ in range(_TRIES):
        try:
            return _parts_of_one_result(call, request, part_bytes)
        except LimberError as error:
            if error.field != "result_sequence":
                raise
    return [call(request).frames]


def _parts_of_one_result(call: Call, request: "service.GetFramesRequest", part_bytes: int) -> "list[service.Frames]":
    wanted = service.GetFramesRequest()
    wanted.CopyFrom(request)
    wanted.most_bytes = part_bytes
    answer = call(wanted)
    parts = [answer.frames]
    while answer.frames_left:
        wanted.result_sequence = parts[0].result.sequence
        wanted.first_frame = parts[-1].first_frame + parts[-1].frame_count
        wanted.frame_count = answer.frames_left
        answer = call(wanted)
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
