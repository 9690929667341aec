"""Binary glTF 2.0 (.glb) of a surface that moves by morph targets."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np

from .moving import MovingSurface

COLOUR = (0.75, 0.55, 0.3, 1.0)  # where no material says one
FLOAT, UINT = 5126, 5125
VERTICES, INDICES = 34962, 34963  # targets of buffer views
TURNS = {"y": [0.0, 0.0, 0.0, 1.0], "z": [-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]}  # quaternions x, y, z, w to glTF's y


@dataclass(frozen=True)
class Material:
    name: str
    colour: "tuple[float, float, float, float]"  # red, green, blue, opacity, in [0, 1], linear
    triangles: np.ndarray                        # numbers


def _material(material: Material) -> "dict[str, Any]":
    made = {"doubleSided": True, "pbrMetallicRoughness": {
        "baseColorFactor": [min(max(part, 0.0), 1.0) for part in material.colour], "metallicFactor": 0.0, "roughnessFactor": 0.7}}
    if material.colour[3] < 1:
        made["alphaMode"] = "BLEND"
    return {"name": material.name, **made} if material.name else made


def glb(surface: MovingSurface, base: np.ndarray, targets: np.ndarray, weights: np.ndarray, up: str,
        normals: "tuple[np.ndarray, np.ndarray]", texcoords: "np.ndarray | None" = None, materials: "Sequence[Material]" = (),
        origin: "np.ndarray | None" = None, session: str = "") -> bytes:
    """The file: vertices in the surface's own unit and axes below a node that scales them to metres and turns `up` to y. Node,
    mesh and animation have the surface's name, the scene has that of `session`. `normals`: unit normals of `base` and the
    increments of each target; texcoords: vertices x 2, from the upper left corner. `materials`: of all triangles, each of which
    is in one. `origin`: the reference of vertices [length unit]; the node is there."""
    materials = materials or [Material("", COLOUR, np.arange(len(surface.faces)))]
    chunks, views, accessors = bytearray(), [], []

    def add(values: np.ndarray, kind: str, component: int, target: "int | None", bounds: bool) -> int:
        view = {"buffer": 0, "byteOffset": len(chunks), "byteLength": values.nbytes}
        views.append(view if target is None else {**view, "target": target})
        chunks.extend(values.tobytes())
        made = {"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind}
        if bounds:
            made["min"], made["max"] = (np.atleast_1d(edge(values, axis=0)).astype(float).tolist() for edge in (np.min, np.max))
        accessors.append(made)
        return len(accessors) - 1

    def vectors(values: np.ndarray) -> int:
        return add(np.ascontiguousarray(values, dtype="<f4"), "VEC3", FLOAT, VERTICES, True)

    attributes = {"POSITION": vectors(base), "NORMAL": vectors(normals[0])}
    if texcoords is not None:
        attributes["TEXCOORD_0"] = add(np.ascontiguousarray(texcoords, dtype="<f4"), "VEC2", FLOAT, VERTICES, False)
    moved = {"targets": [{"POSITION": vectors(target), "NORMAL": vectors(added)} for target, added in zip(targets, normals[1])]} if len(targets) else {}
    primitives = [{"attributes": attributes, "material": number, "mode": 4, **moved, "indices": add(
        np.ascontiguousarray(surface.faces[material.triangles].ravel(), dtype="<u4"), "SCALAR", UINT, INDICES, False)}
        for number, material in enumerate(materials)]
    name = surface.name or "motion"
    mesh = {"name": name, "primitives": primitives}
    placed: "dict[str, Any]" = {}
    if origin is not None and np.any(origin):
        x, y, z = (float(part) * surface.metres for part in origin)
        placed["translation"] = [x, y, z] if up == "y" else [x, z, -y]
    document = {
        "asset": {"version": "2.0", "generator": "limber"}, "scene": 0, "scenes": [{"nodes": [0], **({"name": session} if session else {})}],
        "nodes": [{"name": name, "mesh": 0, "rotation": [float(part) for part in TURNS[up]],
                   "scale": [surface.metres] * 3, **placed}],
        "materials": [_material(material) for material in materials],
        "meshes": [mesh]}
    if len(targets):
        mesh["weights"] = [float(weight) for weight in weights[0]]
        mesh["extras"] = {"targetNames": [f"motion {k + 1}" for k in range(len(targets))]}
        times = (np.arange(len(weights)) / surface.frames_per_second).astype("<f4")
        sampler = {"input": add(times, "SCALAR", FLOAT, None, True), "interpolation": "LINEAR",
                   "output": add(np.ascontiguousarray(weights.ravel(), dtype="<f4"), "SCALAR", FLOAT, None, False)}
        document["animations"] = [{"name": name, "samplers": [sampler],
                                   "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}]
    document |= {"accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(chunks)}]}
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks.extend(b"\0" * (-len(chunks) % 4))
    header = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(chunks))
    return header + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(chunks), b"BIN\0") + bytes(chunks)
