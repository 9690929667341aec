"""Sends the requests of a recording again, and tells how the replies differ from the recorded ones."""

from __future__ import annotations

import re
import secrets
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Iterator

import zmq

from .connection import configure
from .errors import ServerUnreachable
from .messages import common, service
from .recording import REQUEST, Reader

TOLERANCE = 1e-3   # of energies, as a share


@dataclass
class Replay:
    """Result of a replay."""

    requests: int = 0
    replies: int = 0
    kinds: "dict[str, int]" = field(default_factory=dict)  # of replies, how often
    differences: "list[str]" = field(default_factory=list)  # in words, a line each


def replay(path: "str | Path", endpoint: str, tolerance: float = TOLERANCE, timeout: float = 60.0) -> Replay:
    """Sends each request when all replies that had come before it are there again, and compares these. Compared are their kinds,
    codes and fields of errors, kinds of sessions, revisions and ids of edits. For final results also whether they converged, and
    their energies.

    Sessions get names of this replay's own: those of others are left alone. timeout [s] of a reply. Raises LimberError if the
    file is not a recording, ServerUnreachable if the server does not answer at all.
    """
    reader = Reader(path)
    player = _Player(endpoint, tolerance, timeout)
    try:
        for message in reader:
            if message.direction == REQUEST:
                player.send(message.connection, message.data)
            else:
                player.expect(message.connection, message.data)
    finally:
        player.close()
    return player.outcome


def _values(message: Any) -> "Iterator[tuple[Any, Any, Any]]":
    """(message, field, value) of all single values that a message has, of all levels."""
    for descriptor, value in message.ListFields():
        if descriptor.label == descriptor.LABEL_REPEATED:
            continue
        if descriptor.message_type is None:
            yield message, descriptor, value
        else:
            yield from _values(value)


_NAME = re.compile("[A-Za-z0-9._-]{1,64}")


class _Player:
    def __init__(self, endpoint: str, tolerance: float, timeout: float):
        self.outcome = Replay()
        self._endpoint, self._tolerance, self._timeout = endpoint, tolerance, timeout
        self._context = zmq.Context()
        self._sockets: "dict[int, zmq.Socket]" = {}
        self._early: "dict[tuple[int, int], service.Reply]" = {}
        self._requests: "dict[tuple[int, int], service.Request]" = {}
        self._suffix = secrets.token_hex(4)
        # From names of the recorded run to those of this one.
        self._sessions: "dict[str, str]" = {}
        self._uids: "dict[str, str]" = {}
        self._jobs: "dict[int, int]" = {}
        self._instances: "dict[str, str]" = {}

    def close(self) -> None:
        self._context.destroy(linger=0)

    def send(self, connection: int, data: bytes) -> None:
        self.outcome.requests += 1
        if connection not in self._sockets:
            socket = self._context.socket(zmq.DEALER)
            configure(socket, None)
            socket.connect(self._endpoint)
            self._sockets[connection] = socket
        try:
            request = service.Request.FromString(data)
        except ValueError:  # a test of a client: as it was
            self._sockets[connection].send(data)
            return
        self._requests[connection, request.id] = request
        self._sockets[connection].send(self._renamed(request).SerializeToString())

    def expect(self, connection: int, data: bytes) -> None:
        recorded = service.Reply.FromString(data)
        replayed = self._reply(connection, recorded.id)
        if replayed is None:
            self._differ(recorded, f"no reply within {self._timeout:g} s")
            return
        self.outcome.replies += 1
        kind = replayed.WhichOneof("body")
        self.outcome.kinds[kind] = self.outcome.kinds.get(kind, 0) + 1
        self._learn(recorded, replayed)
        for difference in self._compare(recorded, replayed, self._requests.pop((connection, recorded.id), service.Request())):
            self._differ(recorded, difference)

    def _differ(self, recorded: Any, text: str) -> None:
        self.outcome.differences.append(f"request {recorded.id}, {recorded.WhichOneof('body')}: {text}")

    def _reply(self, connection: int, identifier: int) -> "Any | None":
        deadline = time.monotonic() + self._timeout
        while (connection, identifier) not in self._early:
            if not self._sockets[connection].poll(max(0, int(1000 * (deadline - time.monotonic())))):
                if not self.outcome.replies:
                    raise ServerUnreachable(f"nothing answers at {self._endpoint}")
                return None
            reply = service.Reply.FromString(self._sockets[connection].recv_multipart()[-1])
            self._early[connection, reply.id] = reply
        return self._early.pop((connection, identifier))

    def _renamed(self, request: Any) -> Any:
        changed = service.Request()
        changed.CopyFrom(request)
        if changed.client:
            changed.client = changed.client[:48] + self._suffix
        # With another run's id it would be refused; for an unknown run the recorded refusal comes again.
        changed.instance = self._instances.get(request.instance, request.instance)
        for message, descriptor, value in _values(changed):
            if descriptor.name == "session" and isinstance(value, str):
                name, at, uid = value.partition("@")
                setattr(message, descriptor.name, self._name(name) + at + self._uids.get(uid, uid))
            elif descriptor.name == "job" and isinstance(value, int):
                setattr(message, descriptor.name, self._jobs.get(value, value))
        return changed

    def _name(self, recorded: str) -> str:
        """Name of a session: one of this replay's own, so that sessions of others are left alone. Names that are refused stay."""
        if not _NAME.fullmatch(recorded) or recorded in (".", ".."):
            return recorded
        return self._sessions.get(recorded, f"{recorded[:55]}-{self._suffix}")

    def _learn(self, recorded: Any, replayed: Any) -> None:
        if recorded.instance:
            self._instances[recorded.instance] = replayed.instance
        body = recorded.WhichOneof("body")
        if body is None or body != replayed.WhichOneof("body"):
            return
        old, new = getattr(recorded, body), getattr(replayed, body)
        if getattr(old, "job", 0):
            self._jobs[old.job] = new.job
        if isinstance(getattr(old, "session", None), str) and old.session:
            self._sessions[old.session] = new.session
        if getattr(old, "uid", 0):
            self._uids[str(old.uid)] = str(new.uid)

    def _compare(self, recorded: Any, replayed: Any, request: Any) -> "Iterator[str]":
        was, now = recorded.WhichOneof("body"), replayed.WhichOneof("body")
        if was != now:
            yield f"now {now}" + (f": {replayed.error.message}" if now == "error" else "")
            return
        if was is None:
            return
        old, new = getattr(recorded, was), getattr(replayed, was)
        if was == "error":
            yield from _unequal(old, new, "code", "field")
        elif was == "open_session":
            yield from _unequal(old, new, "kind")
            yield from _unequal_issues(old, new)
        elif was == "edit":
            yield from _unequal(old, new, "revision", "constraint_ids", "keyframe_ids", "target_ids")
            yield from _unequal_issues(old, new)
        elif was == "validate_scene":
            yield from _unequal_issues(old, new)
        elif was == "get_session":
            yield from _unequal(old.status, new.status, "kind", "revision")
        elif was == "wait" and request.wait.until in (service.WaitRequest.UNTIL_FINAL, service.WaitRequest.UNTIL_CHECKED):
            yield from self._unequal_results(old.result, new.result)
        elif was == "get_frames":
            yield from _unequal(old.frames, new.frames, "encoding", "first_frame", "frame_count")

    def _unequal_results(self, old: Any, new: Any) -> "Iterator[str]":
        yield from _unequal(old, new, "revision", "converged", "exact", "rank_deficient", "solve_failed")
        found = {_path(message, descriptor): value for message, descriptor, value in _values(new)}
        for message, descriptor, value in _values(old):
            path = _path(message, descriptor)
            if not isinstance(value, float) or "energy" not in path:
                continue
            other = found.get(path, 0.0)
            if abs(value - other) > self._tolerance * max(abs(value), abs(other), abs(old.total_energy), 1e-9):
                yield f"{path} {other:.9g}, was {value:.9g}"


def _path(message: Any, descriptor: Any) -> str:
    return f"{message.DESCRIPTOR.name}.{descriptor.name}"


def _unequal(old: Any, new: Any, *names: str) -> "Iterator[str]":
    for name in names:
        was, now = getattr(old, name), getattr(new, name)
        if was != now:
            if name == "code":
                was, now = (common.ErrorCode.Name(value) for value in (was, now))
            yield f"{name} {now}, was {was}"


def _unequal_issues(old: Any, new: Any) -> "Iterator[str]":
    was, now = (sorted((issue.severity, issue.field) for issue in one.issues) for one in (old, new))
    if was != now:
        yield f"issues of {[place for _, place in now]}, was {[place for _, place in was]}"
