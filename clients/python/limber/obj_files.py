"""Surfaces as artists drew them: vertices in their order, texture coordinates, materials."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import LimberError
from .files import material_libraries, read


@dataclass(frozen=True)
class ObjSurface:
    """Contents of an .obj and its materials, and their bytes."""

    vertices: np.ndarray   # n x 3, in the order of the file
    texcoords: np.ndarray  # m x 2; none: 0 x 2
    corners: np.ndarray    # triangles x 3: vertices, polygons cut into fans
    textures: np.ndarray   # triangles x 3: texture coordinates, -1: none
    materials: np.ndarray  # triangles: numbers of names; -1: none
    names: tuple[str, ...]  # of materials, in the order of their first use
    content: bytes
    libraries: "dict[str, bytes]"  # of materials, by the names of their files


def load(path: Path, field: str) -> ObjSurface:
    """A file with the materials in the same folder."""
    content = read(path, field)
    return parse(content, material_libraries(path, content, field), str(path), field)


def parse(content: bytes, libraries: "dict[str, bytes]", name: str, field: str) -> ObjSurface:
    """name: name of the file in errors."""
    vertices, texcoords, corners, textures = [], [], [], []
    materials: "list[int]" = []
    names: "dict[str, int]" = {}
    material = -1
    try:
        for line in content.decode("utf-8", "replace").splitlines():
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append([float(word) for word in words[1:4]])
            elif words[0] == "vt":
                texcoords.append([float(word) for word in (words[1:3] + ["0"])[:2]])
            elif words[0] == "f":
                face = [_corner(word, len(vertices), len(texcoords)) for word in words[1:]]
                for i in range(1, len(face) - 1):
                    fan = (face[0], face[i], face[i + 1])
                    corners.append([corner[0] for corner in fan])
                    textures.append([corner[1] for corner in fan])
                    materials.append(material)
            elif words[0] == "usemtl":
                material = names.setdefault(" ".join(words[1:]), len(names))
    except (ValueError, IndexError) as error:
        raise LimberError("MALFORMED", f"{name} is no .obj of a surface: {error}", field) from error
    made = ObjSurface(np.array(vertices, dtype=float).reshape(-1, 3), np.array(texcoords, dtype=float).reshape(-1, 2),
                      np.array(corners, dtype=np.int64).reshape(-1, 3), np.array(textures, dtype=np.int64).reshape(-1, 3),
                      np.array(materials, dtype=np.int64), tuple(names), content, libraries)
    if not len(made.corners) or made.corners.min() < 0 or made.corners.max() >= len(vertices):
        raise LimberError("MALFORMED", f"{name} has no faces, or faces of vertices that are not there", field)
    return made


def _corner(word: str, vertices: int, texcoords: int) -> "tuple[int, int]":
    """`v`, `v/vt`, `v//vn` or `v/vt/vn`, from 1, or negative from the end."""
    parts = word.split("/")
    vertex = int(parts[0])
    texture = int(parts[1]) if len(parts) > 1 and parts[1] else 0
    return (vertex - 1 if vertex > 0 else vertices + vertex,
            -1 if texture == 0 else texture - 1 if texture > 0 else texcoords + texture)


def origin_line(origin: np.ndarray) -> str:
    """A comment: vertices are relative to this point."""
    return "# relative to {:.17g} {:.17g} {:.17g}".format(*origin.tolist())


def moved(content: bytes, origin: np.ndarray) -> bytes:
    """The file with vertices relative to a point; unchanged if that is zero."""
    if not origin.any():
        return content
    lines = [origin_line(origin)]
    for line in content.decode("utf-8", "replace").splitlines():
        words = line.split()
        if words[:1] == ["v"] and len(words) >= 4:
            at = np.array([float(word) for word in words[1:4]]) - origin
            line = " ".join(["v", *(f"{part:.9g}" for part in at.tolist()), *words[4:]])
        lines.append(line)
    return ("\n".join(lines) + "\n").encode("utf-8")


def colours(surface: ObjSurface) -> "dict[str, tuple[float, float, float, float]]":
    """Colours of materials, as their libraries have them: diffuse colour and opacity. Textures are left out."""
    found: "dict[str, tuple[float, float, float, float]]" = {}
    for library in surface.libraries.values():
        name = ""
        for line in library.decode("utf-8", "replace").splitlines():
            words = line.split()
            try:
                if words[:1] == ["newmtl"]:
                    name = " ".join(words[1:])
                    found[name] = (0.8, 0.8, 0.8, 1.0)
                elif words[:1] == ["Kd"] and name:
                    found[name] = (*(float(word) for word in (words[1:] * 3)[:3]), found[name][3])
                elif words[:1] == ["d"] and name:
                    found[name] = (*found[name][:3], float(words[-1]))
            except (ValueError, IndexError):
                continue  # a line that says no colour
    return found
