"""Surfaces as .vtu, the XML of VTK, for ParaView."""

from __future__ import annotations

import base64
from typing import Mapping

import numpy as np

TRIANGLE = 5  # VTK's number of that cell
NAMES = {"<f4": "Float32", "<f8": "Float64", "<i4": "Int32", "|u1": "UInt8"}


def triangles(faces: np.ndarray, points: np.ndarray, fields: "Mapping[str, np.ndarray]") -> str:
    """An unstructured grid; fields: of the points, n or n x 3."""
    count = len(faces)
    data = "".join(_array(name, values, "<f4") for name, values in fields.items())
    return (f'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">\n'
            f'<UnstructuredGrid>\n<Piece NumberOfPoints="{len(points)}" NumberOfCells="{count}">\n'
            f'<PointData>\n{data}</PointData>\n<Points>\n{_array("Points", points, "<f8" if points.dtype == np.float64 else "<f4")}</Points>\n<Cells>\n'
            + _array("connectivity", faces.ravel(), "<i4") + _array("offsets", 3 * np.arange(1, count + 1), "<i4")
            + _array("types", np.full(count, TRIANGLE), "|u1")
            + "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")


def _array(name: str, values: np.ndarray, kind: str) -> str:
    """In base64, behind the number of its bytes."""
    content = np.ascontiguousarray(values, dtype=kind).tobytes()
    text = base64.b64encode(np.array([len(content)], dtype="<u4").tobytes() + content).decode("ascii")
    width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim > 1 else ""
    return f'<DataArray type="{NAMES[kind]}" Name="{name}"{width} format="binary">{text}</DataArray>\n'
