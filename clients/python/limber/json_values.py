"""Mappings that are messages: the JSON form of limber.v1, in which rows of numbers may stand where vectors and arrays do."""

from __future__ import annotations

import base64
import numbers
from typing import Any, Mapping, TypeVar

import numpy as np
from google.protobuf import json_format
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.message import Message

from . import arrays
from .messages import common

Made = TypeVar("Made", bound=Message)

_VECTOR, _ARRAY = common.Vector3.DESCRIPTOR.full_name, common.Array.DESCRIPTOR.full_name
_OF_WHOLE_NUMBERS = ("tets", "edges", "triangles")  # fields that are arrays of indices; others are of lengths, angles and shares


def parse(value: "Mapping[str, Any]", message: Made) -> Made:
    """Fills `message`. A position, force or another Vector3 is {"x": 1.0, ...} or three numbers. An Array of numbers is also
    anything that numpy makes an array of: lists, tuples, arrays and numbers of numpy, of any type.

    Raises json_format.ParseError, TypeError and AttributeError, as json_format does: see checks.json_fault().
    """
    return json_format.ParseDict(_of_message(value, message.DESCRIPTOR, ""), message)


def plain(value: Any) -> Any:
    """The JSON form of a value with numpy's arrays and numbers in it, for json_format."""
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple, range)):
        return [plain(inner) for inner in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist()) if value.dtype == object else value.tolist()
    return value


def _of_message(value: Any, kind: Descriptor, name: str) -> Any:
    if kind.full_name == _VECTOR and _is_row(value):
        return _vector(value, name)
    if kind.full_name == _ARRAY and _is_row(value):
        return _array(value, name)
    if not isinstance(value, Mapping):
        return plain(value)
    made = {}
    for key, inner in value.items():
        field = kind.fields_by_name.get(key) or kind.fields_by_camelcase_name.get(key) if isinstance(key, str) else None
        made[key] = _of_field(inner, field) if field is not None and field.message_type is not None else plain(inner)
    return made


def _of_field(value: Any, field: FieldDescriptor) -> Any:
    kind, name = field.message_type, field.name
    try:
        if kind.GetOptions().map_entry:
            inner = kind.fields_by_name["value"]
            if inner.message_type is None or not isinstance(value, Mapping):
                return plain(value)
            return {key: _of_message(one, inner.message_type, name) for key, one in value.items()}
        if field.label != FieldDescriptor.LABEL_REPEATED:
            return _of_message(value, kind, name)
    except json_format.ParseError as fault:
        raise json_format.ParseError(f"Failed to parse {name} field: {fault}") from None
    if not _is_row(value):
        return plain(value)
    made = []
    for i, one in enumerate(value):
        try:
            made.append(_of_message(one, kind, name))
        except json_format.ParseError as fault:
            raise json_format.ParseError(f"Failed to parse {name}[{i}] field: {fault}") from None
    return made


def _is_row(value: Any) -> bool:
    return isinstance(value, (list, tuple, range)) or isinstance(value, np.ndarray) and value.ndim > 0


def _is_number(value: Any) -> bool:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    return isinstance(value, numbers.Real) and not isinstance(value, (bool, np.bool_))


def _vector(value: Any, name: str) -> "dict[str, float]":
    if len(value) != 3 or not all(_is_number(number) for number in value):
        raise json_format.ParseError(f"{name or 'a vector'} takes three numbers, not {value!r}")
    return {axis: float(number) for axis, number in zip("xyz", value)}


def _array(value: Any, name: str) -> "dict[str, Any]":
    try:
        given = np.asarray(value)
    except ValueError as error:
        raise json_format.ParseError(f"{name} takes rows of numbers: {error}") from None
    if given.size == 0:
        given = given.astype(np.float64)
    if given.dtype.kind not in "iuf":
        raise json_format.ParseError(f"{name} takes rows of numbers, not of {given.dtype}")
    wanted = np.int32 if name in _OF_WHOLE_NUMBERS else np.float64
    with np.errstate(invalid="ignore"):
        fits = wanted is np.float64 or bool(np.all(given == given.astype(wanted)))
    if not fits:
        raise json_format.ParseError(f"{name} takes whole numbers of 32 bits")
    made = arrays.to_message(given, wanted)
    return {"type": common.DataType.Name(made.type), "shape": list(made.shape),
            "data": base64.b64encode(made.data).decode("ascii")}
