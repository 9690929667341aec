"""Triangles of binary glTF 2.0 files, for drawing."""

from __future__ import annotations

import json
import struct
from typing import Any, Iterator

import numpy as np

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}


def corners(content: bytes) -> np.ndarray:
    """Corners of the triangles of the default scene, placed by its nodes: 3t x 3. ValueError, IndexError, KeyError, TypeError or
    struct.error if there are none: the server reports defects of a file."""
    magic, version, _, size, kind = struct.unpack_from("<4sIII4s", content)
    if (magic, version, kind) != (b"glTF", 2, b"JSON"):
        raise ValueError("it does not begin as a binary glTF file of version 2")
    document = json.loads(content[20:20 + size])
    required = [name for name in document.get("extensionsRequired", []) if name.endswith("_compression")]
    if required:
        raise ValueError(f"it requires the extension '{required[0]}', which is not read")
    reader = _Reader(document, content[28 + size:])
    found = list(reader.triangles(document["scenes"][document.get("scene", 0)]["nodes"], np.eye(4), 0))
    return np.concatenate(found) if found else np.zeros((0, 3))


class _Reader:
    def __init__(self, document: "dict[str, Any]", binary: bytes):
        self.document, self.binary = document, binary

    def triangles(self, nodes: "list[int]", parent: np.ndarray, depth: int) -> "Iterator[np.ndarray]":
        if depth > 100:
            raise ValueError("nodes are nested more than 100 deep")
        for number in nodes:
            node = self.document["nodes"][number]
            at = parent @ _placement(node)
            primitives = self.document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []
            for primitive in primitives:
                mode = primitive.get("mode", 4)
                if mode < 4:  # points, lines
                    continue
                points = self.accessor(primitive["attributes"]["POSITION"]) @ at[:3, :3].T + at[:3, 3]
                used = self.accessor(primitive["indices"])[:, 0].astype(np.int64) if "indices" in primitive else np.arange(len(points))
                yield points[_faces(used, mode)].reshape(-1, 3)
            yield from self.triangles(node.get("children", []), at, depth + 1)

    def accessor(self, number: int) -> np.ndarray:
        """count x width, float64"""
        given = self.document["accessors"][number]
        kind, width, count = np.dtype(_COMPONENTS[given["componentType"]]), _WIDTHS[given["type"]], given["count"]
        values = np.zeros((0 if "bufferView" in given else min(count, len(self.binary)), width), kind)
        if "bufferView" in given:
            values = self.rows(given, kind, width, count)
        if "sparse" in given:
            sparse = given["sparse"]
            places = self.rows(sparse["indices"], np.dtype(_COMPONENTS[sparse["indices"]["componentType"]]), 1, sparse["count"])
            values[places[:, 0].astype(np.int64)] = self.rows(sparse["values"], kind, width, sparse["count"])
        made = values.astype(float)
        return np.maximum(made / np.iinfo(kind).max, -1) if given.get("normalized") and kind.kind != "f" else made

    def rows(self, of: "dict[str, Any]", kind: np.dtype, width: int, count: int) -> np.ndarray:
        view = self.document["bufferViews"][of["bufferView"]]
        if view["buffer"] != 0 or "uri" in self.document["buffers"][0]:
            raise ValueError("a buffer is not in this file")
        begin = view.get("byteOffset", 0) + of.get("byteOffset", 0)
        stride = view.get("byteStride", kind.itemsize * width)
        shape, strides = (count, width), (stride, kind.itemsize)
        return np.ndarray(shape, kind, buffer=self.binary, offset=begin, strides=strides).copy()


def _placement(node: "dict[str, Any]") -> np.ndarray:
    made = np.eye(4)
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", [0, 0, 0, 1]), dtype=float) / np.linalg.norm(node.get("rotation", [0, 0, 0, 1]))
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    made[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), dtype=float)
    made[:3, 3] = node.get("translation", [0, 0, 0])
    return made


def _faces(used: np.ndarray, mode: int) -> np.ndarray:
    """t x 3 of corners in the order of a list, a strip or a fan of triangles; which side is which does not matter here."""
    if mode == 4:
        return used[:len(used) // 3 * 3].reshape(-1, 3)
    first = used[:-2] if mode == 5 else np.full(max(len(used) - 2, 0), used[0])
    return np.stack([first, used[1:-1], used[2:]], axis=1)
