"""Errors that a client raises."""

from __future__ import annotations

import errno
import functools
from typing import Any, Mapping

from .messages import common

# Base classes of errors with a code, in addition to LimberError.
_ALSO: "dict[str, type[Exception]]" = {"TIMEOUT": TimeoutError, "INVALID_ARGUMENT": ValueError, "OUT_OF_RANGE": ValueError, "IO": OSError}
_NUMBERS = {TimeoutError: errno.ETIMEDOUT, FileNotFoundError: errno.ENOENT}


class LimberError(Exception):
    """A refused request.

    `code` is the short name of limber.v1.ErrorCode ("OUT_OF_RANGE", "NOT_FOUND", ...), `field` the path of the
    offending field in the request ("edits[0].add.constraint.frame"; empty if none applies), `details` further facts.

    By its code it is also an error of Python: TimeoutError (code TIMEOUT), ValueError (INVALID_ARGUMENT, OUT_OF_RANGE), OSError
    (IO), FileNotFoundError for a file that does not exist.
    """

    _made_of: "tuple[type[LimberError], type[Exception]] | None" = None  # classes made by _both()

    def __new__(cls, code: str, *given: Any, **named: Any) -> "LimberError":
        also = _ALSO.get(code)
        if also is not None and not issubclass(cls, also):
            cls = _both(cls, also)
        return super().__new__(cls)

    def __init__(self, code: str, message: str, field: str = "", details: Mapping[str, str] | None = None):
        super().__init__(code, message, field)
        self.args = (code, message, field)  # OSError takes them for others
        self.code = code
        self.message = message
        self.field = field
        self.details = dict(details or {})
        if isinstance(self, OSError):
            self.errno = next((number for kind, number in _NUMBERS.items() if isinstance(self, kind)), None)
            self.strerror = message

    def __str__(self) -> str:
        where = f" (field {self.field})" if self.field else ""
        return f"{self.message}{where} [{self.code}]"

    def __reduce__(self) -> "tuple[Any, ...]":
        return _again, (self._made_of or type(self), self.code, self.args, getattr(self, "errno", None)), self.__dict__


@functools.lru_cache(maxsize=None)
def _both(kind: "type[LimberError]", also: "type[Exception]") -> "type[LimberError]":
    """A class that is both, under the name of the first."""
    return type(kind.__name__, (kind, also), {"__module__": kind.__module__, "__doc__": kind.__doc__, "_made_of": (kind, also)})


def _again(kind: Any, code: str, arguments: "tuple[str, ...]", number: "int | None") -> LimberError:
    """An error as it was pickled or copied; its members follow."""
    made = LimberError.__new__(_both(*kind) if isinstance(kind, tuple) else kind, code)
    LimberError.__init__(made, *arguments)
    if isinstance(made, OSError):
        made.errno = number
    return made


class ServerUnreachable(LimberError):
    """Nothing answers at the endpoint, or an answer did not come in time. Code "TIMEOUT"."""

    def __new__(cls, message: str, code: str = "TIMEOUT", *given: Any, **named: Any) -> LimberError:
        return super().__new__(cls, code)

    def __init__(self, message: str, code: str = "TIMEOUT", field: str = "", details: Mapping[str, str] | None = None):
        LimberError.__init__(self, code, message, field, details)


class ServerStopped(ServerUnreachable):
    """limberd was stopped in order, and said so. Code "SHUTTING_DOWN"."""

    def __new__(cls, message: str, *given: Any, **named: Any) -> LimberError:
        return LimberError.__new__(cls, "SHUTTING_DOWN")

    def __init__(self, message: str, field: str = "", details: Mapping[str, str] | None = None):
        super().__init__(message, "SHUTTING_DOWN", field, details)


class ServerRestarted(LimberError):
    """limberd was restarted: the requested session or job does not exist any more, even if another has its name now. Code
    "RESTARTED"."""

    def __new__(cls, message: str, *given: Any, **named: Any) -> LimberError:
        return super().__new__(cls, "RESTARTED")

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
    if error.code == common.ERROR_CODE_NOT_FOUND and error.field.rpartition(".")[2] == "path":
        return not_there(error.message, error.field, error.details)
    return LimberError(code_name(error.code), error.message, error.field, error.details)


def not_there(message: str, field: str, details: Mapping[str, str] | None = None) -> LimberError:
    """For a file, folder or program that does not exist."""
    return _both(LimberError, FileNotFoundError)("NOT_FOUND", message, field, details)


def of_file(fault: OSError, what: str, field: str) -> LimberError:
    """For a file that cannot be read or written. what: the sentence without its reason, "cannot read a.json"."""
    also = FileNotFoundError if isinstance(fault, FileNotFoundError) else OSError
    made = _both(LimberError, also)("IO", f"{what}: {fault.strerror}", field)
    made.errno = fault.errno
    return made


def invalid(field: str, message: str) -> LimberError:
    """For arguments that are refused before anything is sent."""
    return LimberError("INVALID_ARGUMENT", message, field)
