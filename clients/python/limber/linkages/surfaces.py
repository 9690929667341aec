"""Triangle surfaces read from files for drawing. The server reads the surfaces of designs itself."""

from __future__ import annotations

import os
import struct
from typing import Any

import numpy as np

from .. import checks, files
from ..errors import invalid
from . import glb_surfaces

# Types of numbers, by both names that .ply has for them: the letter that struct has.
_NUMBERS = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f",
            "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
            "float32": "f", "float64": "d"}


def read(path: "str | os.PathLike[str]", field: str) -> "tuple[np.ndarray, np.ndarray]":
    """Vertices n x 3 and triangles t x 3 of an .obj, .ply, .stl, .off or .glb; polygons are fanned."""
    path = checks.path(path, field)
    readers = {".obj": _obj, ".ply": _ply, ".stl": _stl, ".off": _off, ".glb": _glb}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise invalid(field, f"{path.name} is no surface that can be read: {', '.join(files.SURFACES)}")
    content = files.read(path, field).removeprefix(b"\xef\xbb\xbf")  # a byte order mark
    try:
        vertices, polygons = reader(content)
        triangles = [(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)]
        return np.array(vertices, dtype=float).reshape(-1, 3), np.array(triangles, dtype=np.int64).reshape(-1, 3)
    except (ValueError, IndexError, KeyError, TypeError, OverflowError, struct.error) as error:
        raise invalid(field, f"{path.name} cannot be read as {path.suffix.lower()}: {error}") from error


def _obj(content: bytes) -> "tuple[Any, list[Any]]":
    vertices: "list[list[float]]" = []
    polygons: "list[list[int]]" = []
    for line in content.decode("utf-8", "replace").splitlines():
        words = line.split("#")[0].split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            if 0 in numbers:
                raise ValueError("vertex index 0: OBJ files count vertices from 1; if this file counts from 0, add 1")
            polygons.append([n - 1 if n > 0 else len(vertices) + n for n in numbers])
    return vertices, polygons


def _stl(content: bytes) -> "tuple[Any, Any]":
    count = struct.unpack_from("<I", content, 80)[0] if len(content) >= 84 else -1
    if len(content) == 84 + 50 * count:
        facets = np.frombuffer(content, dtype=[("normal", "<f4", 3), ("corners", "<f4", 9), ("rest", "<u2")], offset=84)
        corners = facets["corners"].reshape(-1, 3)
    else:
        words = [line.split() for line in content.decode("utf-8", "replace").splitlines()]
        corners = np.array([line[1:4] for line in words if line[:1] == ["vertex"]], dtype=float).reshape(-1, 3)
    return corners, np.arange(len(corners)).reshape(-1, 3)


def _glb(content: bytes) -> "tuple[Any, Any]":
    corners = glb_surfaces.corners(content)
    return corners, np.arange(len(corners)).reshape(-1, 3)


def _off(content: bytes) -> "tuple[Any, list[Any]]":
    lines = [line.split("#")[0].split() for line in content.decode("utf-8", "replace").splitlines()]
    lines = [words for words in lines if words]
    if lines[0][0].endswith("OFF"):
        lines[0] = lines[0][1:]
        lines = lines if lines[0] else lines[1:]
    vertices, faces = int(lines[0][0]), int(lines[0][1])
    if vertices < 0 or not 0 <= faces <= len(lines) - 1 - vertices:
        raise ValueError("it ends too early")
    polygons = [[int(word) for word in words[1:1 + int(words[0])]] for words in lines[1 + vertices:1 + vertices + faces]]
    return [[float(word) for word in words[:3]] for words in lines[1:1 + vertices]], polygons


def _ply(content: bytes) -> "tuple[Any, list[Any]]":
    head, mark, body = content.partition(b"end_header")
    if not mark or not head.startswith(b"ply"):
        raise ValueError("it does not begin with a header of ply")
    lines = [line.split() for line in head.decode("ascii", "replace").splitlines()]
    order = next((line[1] for line in lines if line[:1] == ["format"]), "")
    if order not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise ValueError(f"unknown format '{order}'")
    elements: "list[tuple[str, int, list[list[str]]]]" = []
    for line in lines:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"]:
            elements[-1][2].append(line[1:])
    mark = ">" if order == "binary_big_endian" else "<"
    take = _words(body) if order == "ascii" else _binary(body[body.index(b"\n") + 1:], mark)
    vertices: "list[list[float]]" = []
    polygons: "list[list[int]]" = []
    for name, count, properties in elements:
        for _ in range(count):
            row: "dict[str, Any]" = {}
            for kind in properties:
                if kind[0] == "list":
                    row[kind[3]] = [take(kind[2]) for _ in range(int(take(kind[1])))]
                else:
                    row[kind[1]] = take(kind[0])
            if name == "vertex":
                vertices.append([float(row[axis]) for axis in "xyz"])
            elif name == "face":
                polygons.append([int(n) for n in row["vertex_indices" if "vertex_indices" in row else "vertex_index"]])
    return vertices, polygons


def _words(body: bytes) -> Any:
    words = iter(body.split())

    def take(_: str) -> float:
        word = next(words, None)
        if word is None:
            raise ValueError("it ends too early")
        return float(word)
    return take


def _binary(body: bytes, order: str) -> Any:
    at = 0
    formats = {name: struct.Struct(order + letter) for name, letter in _NUMBERS.items()}

    def take(kind: str) -> float:
        nonlocal at
        value = formats[kind].unpack_from(body, at)[0]
        at += formats[kind].size
        return value
    return take
