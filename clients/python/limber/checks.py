"""Arguments of the public functions: an argument of the wrong type is refused by its name, before anything is sent."""

from __future__ import annotations

import difflib
import numbers
import operator
import os
import re
from pathlib import Path
from typing import Any, Iterable

import numpy as np

from .errors import invalid

MOST_SECONDS = 1e6  # threads cannot wait much longer in one call


def whole(value: Any, field: str, most: int = 2 ** 32 - 1) -> int:
    """A whole number from 0 on, of Python or numpy. 1.5 is none, and neither is True."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        raise invalid(field, f"{field} must be a whole number >= 0, is {value!r}") from None
    if not 0 <= number <= most:
        raise invalid(field, f"{field} must be a whole number in [0, {most}], is {number}")
    return number


def wholes(values: Any, field: str) -> list[int]:
    """Whole numbers; the one that is none is named by its index."""
    return [whole(value, f"{field}[{i}]") for i, value in enumerate(several(values, field))]


def several(values: Any, field: str) -> Iterable[Any]:
    """An iterable that is not a text."""
    if isinstance(values, (str, bytes)):
        raise invalid(field, f"{field} takes a list, not {values!r}")
    try:
        return iter(values)
    except TypeError:
        raise invalid(field, f"{field} takes a list, not {values!r}") from None


def real(value: Any, field: str) -> float:
    """A number. Text that looks like a number is none; the server judges NaN and infinity."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, numbers.Real) or isinstance(value, (bool, np.bool_)):
        raise invalid(field, f"{field} must be a number, is {value!r}")
    return float(value)


def seconds(value: Any, field: str) -> float:
    """How long to wait: a number in [0, MOST_SECONDS]."""
    if not 0 <= real(value, field) <= MOST_SECONDS:
        raise invalid(field, f"{field} must be in [0, {MOST_SECONDS:g}] s, is {value}")
    return float(value)


def duration(value: Any, field: str) -> float:
    """How long an answer may take: as seconds(), but not 0."""
    if seconds(value, field) == 0:
        raise invalid(field, f"{field} must be > 0 s")
    return float(value)


def flag(value: Any, field: str) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise invalid(field, f"{field} must be True or False, is {value!r}")
    return bool(value)


def text(value: Any, field: str) -> str:
    """A string."""
    if not isinstance(value, str):
        raise invalid(field, f"{field} must be text, is {value!r}")
    return value


def path(value: Any, field: str) -> Path:
    """A file or folder, as text or as an object that is a path."""
    if not isinstance(value, (str, os.PathLike)) or isinstance(os.fspath(value), bytes):
        raise invalid(field, f"{field} must be a path, is {value!r}")
    return Path(value)


def one_of(value: Any, names: Iterable[str], field: str) -> str:
    """One of a few words."""
    names = tuple(names)
    if not isinstance(value, str) or value not in names:
        raise invalid(field, f"{field} must be one of {', '.join(names)}, is {value!r}")
    return value


def json_fault(error: Exception) -> tuple[str, str]:
    """Path and reason of a refusal by json_format: "Failed to parse a field: Failed to parse b field: why" is (".a.b", "why")."""
    why, path = str(error), ""
    while found := re.match(r"Failed to parse (\w+(?:\[\d+\])?) field: ", why):
        path, why = f"{path}.{found[1]}", why[found.end():]
    if found := re.match(r"Couldn't parse (NaN|Infinity)\b.*? at \w+((?:\.\w+(?:\[\d+\])?)+)\.*$", why, re.DOTALL):
        path, why = found[2], f"a finite number is expected, not {found[1]}"
    if found := re.match(r"repeated field (\w+) must be in \[\] which is (.*?)( at \S+)?$", why, re.DOTALL):
        why = f"a list is expected, not {found[2]}"
    if found := re.search(r'has no field named "(.*?)"( at .*?)?\.\s*Available Fields\(except extensions\): "?\[(.*?)\]', why,
                          re.DOTALL):
        names = [re.sub(r"[A-Z]", lambda c: "_" + c[0].lower(), name) for name in re.findall(r"'(\w+)'", found[3])]
        near = difflib.get_close_matches(re.sub(r"[A-Z]", lambda c: "_" + c[0].lower(), found[1]), names, 1)
        why = f'there is no field "{found[1]}"' + (f': did you mean "{near[0]}"?' if near else f", only {', '.join(names)}")
    return path, f"{path[1:]}: {why}" if path else why


def numeric(values: Any, field: str) -> np.ndarray:
    """An array of numbers, of any shape."""
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as error:
        raise invalid(field, f"{field} must be an array of numbers: {error}") from error
    if not (np.issubdtype(array.dtype, np.integer) or np.issubdtype(array.dtype, np.floating)):
        raise invalid(field, f"{field} must be an array of numbers, not of {array.dtype}")
    return array
