"""The clients in a session, and the author of each revision."""

from __future__ import annotations

import getpass
import os
import socket
from dataclasses import dataclass

from . import checks
from .errors import invalid
from .messages import presence

MAX_NAME_BYTES = 64


@dataclass(frozen=True)
class SessionClient:
    """A client that is in a session."""

    client: int         # never given again by this run of limberd
    name: str
    present_s: float    # since it joined [s]
    last_revision: int  # the newest that it made; 0: none
    is_self: bool       # this very connection

    @staticmethod
    def from_message(message: "presence.SessionClient", own: int) -> "SessionClient":
        return SessionClient(message.client, message.name, message.present_s, message.last_revision, message.client == own)


@dataclass(frozen=True)
class RevisionMade:
    """A revision, or several of one client and kind in a row."""

    revision: int           # the newest of them; 0: the session was opened
    first: int              # the oldest
    client: int             # their author; this client may have left
    name: str
    edits: tuple[str, ...]  # kinds of edits: "add", "move", "undo", "open_session", ..
    age_s: float            # since the newest of them [s]

    @staticmethod
    def from_message(message: "presence.SessionRevision") -> "RevisionMade":
        return RevisionMade(message.revision, message.first, message.client, message.name, tuple(message.edits), message.age_s)


def client_name(given: "str | None") -> str:
    """As given, else $LIMBER_NAME, else python-USER@HOST."""
    name = checks.text(given, "name") if given is not None else os.environ.get("LIMBER_NAME") or _default_name()
    if len(name.encode("utf-8", "replace")) > MAX_NAME_BYTES:
        raise invalid("name", f"name must have at most {MAX_NAME_BYTES} bytes, is {name!r}")
    if any(ord(letter) < 0x20 or ord(letter) == 0x7f for letter in name):
        raise invalid("name", f"name must have no control characters, is {name!r}")
    return name


def _default_name() -> str:
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a user id without a name
        user = str(os.geteuid())
    return f"python-{user}@{socket.gethostname()}".encode()[:MAX_NAME_BYTES].decode("utf-8", "ignore")
