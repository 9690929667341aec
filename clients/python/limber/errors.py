"""What a client raises."""

from __future__ import annotations

from typing import Mapping

from .messages import common


class LimberError(Exception):
    """A refused request.

    `code` is the short name of limber.v1.ErrorCode ("OUT_OF_RANGE", "NOT_FOUND", ...), `field` the path of the
    offending field in the request ("edits[0].add.constraint.frame"; empty if none applies), `details` further facts.
    """

    def __init__(self, code: str, message: str, field: str = "", details: Mapping[str, str] | None = None):
        super().__init__(code, message, field)
        self.code = code
        self.message = message
        self.field = field
        self.details = dict(details or {})

    def __str__(self) -> str:
        where = f" (field {self.field})" if self.field else ""
        return f"{self.message}{where} [{self.code}]"


class ServerUnreachable(LimberError):
    """Nothing answers at the endpoint, or an answer did not come in time. Code "TIMEOUT"."""

    def __init__(self, message: str, code: str = "TIMEOUT", field: str = "", details: Mapping[str, str] | None = None):
        super().__init__(code, message, field, details)


class ServerStopped(ServerUnreachable):
    """limberd was stopped in order, and said so. Code "SHUTTING_DOWN"."""

    def __init__(self, message: str, field: str = "", details: Mapping[str, str] | None = None):
        super().__init__(message, "SHUTTING_DOWN", field, details)


class ServerRestarted(LimberError):
    """limberd was restarted: the requested session or job is gone, even if another has its name now. Code "RESTARTED"."""

    def __init__(self, message: str, field: str = "", details: Mapping[str, str] | None = None):
        super().__init__("RESTARTED", message, field, details)


def code_name(code: int) -> str:
    """"OUT_OF_RANGE"; the number of a code that this client does not know."""
    try:
        return common.ErrorCode.Name(code).removeprefix("ERROR_CODE_")
    except ValueError:
        return str(code)


def from_message(error: "common.Error") -> LimberError:
    """The exception for a limber.v1.Error."""
    if error.code == common.ERROR_CODE_RESTARTED:
        return ServerRestarted(error.message, error.field, error.details)
    if error.code == common.ERROR_CODE_SHUTTING_DOWN:
        return ServerStopped(error.message, error.field, error.details)
    return LimberError(code_name(error.code), error.message, error.field, error.details)


def invalid(field: str, message: str) -> LimberError:
    """For arguments that are refused before anything is sent."""
    return LimberError("INVALID_ARGUMENT", message, field)
