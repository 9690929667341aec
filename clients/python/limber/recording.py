"""Recordings of traffic: the requests and replies of a server's clients with their times, as docs/protocol.md describes."""

from __future__ import annotations

import json
import struct
import time
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Iterator

from .errors import LimberError, of_file

MAGIC = b"limbrec\0"
VERSION = 1
REQUEST, REPLY = 0, 1
# Direction, connection, time [us], length of the message that follows.
_RECORD = struct.Struct("<BIQI")
_FLUSH_SECONDS = 1.0
_MOST_BYTES = 1 << 30  # of one message


@dataclass(frozen=True)
class Message:
    """A request or a reply, as bytes."""

    direction: int     # REQUEST or REPLY
    connection: int    # of which client, from 0 in the order of their first request
    seconds: float     # since the beginning of the recording
    data: bytes


class Writer:
    """Writes a recording message by message. Messages older than a second can be read even if the writer is killed."""

    def __init__(self, path: "str | Path", **about: Any):
        """about: further values of the header, such as server_version."""
        self._packer = zlib.compressobj(9)
        self._began = self._flushed = time.monotonic()
        try:
            self._file: BinaryIO = open(path, "xb")  # one that is there stays
        except OSError as error:
            raise of_file(error, f"cannot write {path}", "path") from error
        self._file.write(MAGIC + struct.pack("<I", VERSION))
        header = json.dumps({"protocol": 1, **about}, sort_keys=True).encode()
        self._put(struct.pack("<I", len(header)) + header)

    def add(self, direction: int, connection: int, data: bytes) -> None:
        now = time.monotonic()
        self._put(_RECORD.pack(direction, connection, int(1e6 * (now - self._began)), len(data)) + data)
        if now > self._flushed + _FLUSH_SECONDS:
            self._file.write(self._packer.flush(zlib.Z_SYNC_FLUSH))
            self._file.flush()
            self._flushed = now

    def close(self) -> None:
        if not self._file.closed:
            self._file.write(self._packer.flush())
            self._file.close()

    def __enter__(self) -> "Writer":
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _put(self, data: bytes) -> None:
        self._file.write(self._packer.compress(data))


class Reader:
    """A recording as it was written: an iterator over its messages. `header` is its JSON object; `is_cut` says afterwards
    whether its end is missing, of a writer that was killed."""

    def __init__(self, path: "str | Path"):
        self._path = path
        try:
            self._file: BinaryIO = open(path, "rb")
        except OSError as error:
            raise of_file(error, f"cannot read {path}", "path") from error
        self._unpacker = zlib.decompressobj()
        self._buffer = b""
        self.is_cut = False
        try:
            if self._file.read(len(MAGIC)) != MAGIC:
                raise self._fault("it is no recording of limber")
            (version,) = struct.unpack("<I", self._file.read(4).ljust(4, b"\0"))
            if version != VERSION:
                raise LimberError("UNSUPPORTED", f"{path} is of form {version}; this client reads form {VERSION}", "path")
            (size,) = struct.unpack("<I", self._exactly(4))
            self.header: "dict[str, Any]" = json.loads(self._exactly(min(size, _MOST_BYTES)))
        except LimberError:
            self._file.close()
            raise
        except (EOFError, ValueError):
            self._file.close()
            raise self._fault("its header cannot be read") from None

    def __iter__(self) -> Iterator[Message]:
        with self._file:
            while True:
                try:
                    direction, connection, microseconds, size = _RECORD.unpack(self._exactly(_RECORD.size))
                    if direction not in (REQUEST, REPLY) or size > _MOST_BYTES:
                        raise self._fault("it is damaged")
                    data = self._exactly(size)
                except EOFError:
                    self.is_cut = bool(self._buffer) or not self._unpacker.eof
                    return
                yield Message(direction, connection, 1e-6 * microseconds, data)

    def _exactly(self, size: int) -> bytes:
        while len(self._buffer) < size:
            packed = self._unpacker.unconsumed_tail or self._file.read(1 << 16)
            if not packed:
                raise EOFError
            try:
                self._buffer += self._unpacker.decompress(packed, 1 << 20)
            except zlib.error:
                raise self._fault("it is damaged") from None
        data, self._buffer = self._buffer[:size], self._buffer[size:]
        return data

    def _fault(self, what: str) -> LimberError:
        return LimberError("INVALID_ARGUMENT", f"{self._path}: {what}", "path")
