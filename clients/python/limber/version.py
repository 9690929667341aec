"""Versions of this package and of the protocol, and the message if those of client and server differ."""

from __future__ import annotations

from typing import Iterable

from .errors import LimberError

PACKAGE = "0.1.0"
PROTOCOL = 1


def other_protocol(server_version: str, spoken: Iterable[int]) -> LimberError:
    """If no version of the protocol is common to both: the error that says which side is older."""
    versions = list(spoken)
    older = "client" if any(version > PROTOCOL for version in versions) else "server"
    return LimberError("UNSUPPORTED", f"limberd {server_version} speaks protocol {', '.join(map(str, versions))}, this client "
                                      f"({PACKAGE}) protocol {PROTOCOL}: update the {older}", "version")


def knows_no_client_version(error: LimberError) -> bool:
    """Does the server refuse the field `client_version`, as those do that are older than it?"""
    return error.code == "INVALID_ARGUMENT" and "GetServerInfoRequest" in error.message
