"""Files as uploads."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path
from typing import Iterable

from . import checks
from .errors import LimberError, of_file
from .messages import scene as messages

SURFACES = (".obj", ".ply", ".stl", ".off", ".glb")  # endings of files of triangle surfaces

# Files that are also read with a mesh file, by its ending.
_COMPANIONS = {".ele": (".node",), ".node": (".ele",)}


def mesh_file(path: "str | os.PathLike[str]", companions: Iterable["str | os.PathLike[str]"] = (), *,
              field: str = "mesh.path") -> "messages.MeshFile":
    """A mesh file's bytes for upload, with its companions: TetGen's other half, VegaFEM's includes, and materials in a file of
    the same stem ending in .elastic.

    companions: further files to send along, under their own names; field: name in errors.
    """
    path = checks.path(path, field)
    message = messages.MeshFile(name=path.name, content=read(path, field))
    beside = [path.with_suffix(suffix) for suffix in _COMPANIONS.get(path.suffix.lower(), ())]
    if path.suffix.lower() == ".veg":
        names = re.findall(rb"(?mi)^\*INCLUDE[ \t]+([^\r\n]+?)[ \t]*$", message.content)
        beside += [path.with_name(os.fsdecode(name)) for name in names]
    if path.with_suffix(".elastic") != path and path.with_suffix(".elastic").is_file():
        beside.append(path.with_suffix(".elastic"))
    for companion in [*beside, *map(Path, companions)]:
        message.companions[companion.name] = read(companion, "mesh.companions")
    return message


def surface_file(path: "str | os.PathLike[str]", *, field: str = "surface.path") -> "messages.MeshFile":
    """A surface file's bytes for upload (one of SURFACES), with the .mtl files that it names, as far as they are there."""
    path = checks.path(path, field)
    message = messages.MeshFile(name=path.name, content=read(path, field))
    if path.suffix.lower() == ".obj":
        message.companions.update(material_libraries(path, message.content, field))
    return message


def material_libraries(path: Path, content: bytes, field: str) -> "dict[str, bytes]":
    """The .mtl files in the folder of an .obj that it names, by name. Folders in these names are left out: companions of an .obj
    are never read from elsewhere."""
    libraries: "dict[str, bytes]" = {}
    for text in re.findall(rb"(?m)^[ \t]*mtllib[ \t]+([^\r\n]+?)[ \t]*\r?$", content):
        name = re.split(r"[/\\]", os.fsdecode(text))[-1]
        if name not in libraries and name and (path.parent / name).is_file():
            libraries[name] = read(path.parent / name, field)
    return libraries


def surface_beside(mesh: Path) -> Path | None:
    """The surface in the folder of a mesh: STEM.surface with an ending of SURFACES."""
    beside = (mesh.with_suffix(f".surface{ending}") for ending in SURFACES)
    return next((file for file in beside if file.is_file()), None)


def read(path: Path, field: str) -> bytes:
    """The bytes of a regular file; a pipe is not waited for."""
    try:
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise LimberError("IO", f"cannot read {path}: it is no regular file", field)
            return file.read()
    except LimberError:
        raise
    except OSError as error:
        raise of_file(error, f"cannot read {path}", field) from error


def has_only_lines(path: Path, field: str) -> bool:
    """Whether an .obj has lines and no faces."""
    first = {line.split(maxsplit=1)[0] for line in read(path, field).splitlines() if line.strip()}
    return b"l" in first and b"f" not in first
