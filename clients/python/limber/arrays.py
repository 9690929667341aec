"""limber.v1.Array to numpy and back."""

from __future__ import annotations

import numpy as np

from .errors import LimberError
from .messages import common

_DTYPES = {
    common.DATA_TYPE_FLOAT32: np.dtype("<f4"),
    common.DATA_TYPE_FLOAT64: np.dtype("<f8"),
    common.DATA_TYPE_INT32: np.dtype("<i4"),
    common.DATA_TYPE_UINT16: np.dtype("<u2"),
}
_TYPES = {dtype: number for number, dtype in _DTYPES.items()}


def to_numpy(array: "common.Array", what: str = "array") -> np.ndarray:
    """A read-only view of the bytes; refuses lengths that do not fit the shape."""
    dtype = _DTYPES.get(array.type)
    if dtype is None:
        raise LimberError("MALFORMED", f"{what} has the unknown data type {array.type}")
    shape = tuple(array.shape)
    count = 1
    for extent in shape:
        count *= extent
    if count * dtype.itemsize != len(array.data):
        raise LimberError("MALFORMED", f"{what} of shape {shape} has {len(array.data)} bytes")
    return np.frombuffer(array.data, dtype=dtype).reshape(shape)


def to_message(values, dtype) -> "common.Array":
    """A message with a copy of the values; dtype is one of float32, float64, int32, uint16."""
    values = np.asarray(values)
    if np.dtype(dtype).kind in "iu" and values.dtype.kind == "f" and not np.array_equal(values, np.trunc(values)):
        raise LimberError("INVALID_ARGUMENT", "whole numbers are expected")
    values = np.ascontiguousarray(values, dtype=np.dtype(dtype).newbyteorder("<"))
    return common.Array(type=_TYPES[values.dtype], shape=values.shape, data=values.tobytes())
