"""Files that the client makes of a motion, for other programs to play."""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Iterable
from xml.sax.saxutils import quoteattr

import numpy as np

from . import checks, gltf, morphs, normals, obj_files, precision, vtu
from .errors import LimberError, invalid, of_file
from .moving import MovingPoints, MovingSurface
from .obj_files import ObjSurface

if TYPE_CHECKING:
    from .open_session import OpenSession

NODES = "nodes"      # as `surface`: the boundary of a body's tets
MARK = "# limber: the first frame of a motion\n"  # first line of an .obj that may be replaced
TOLERANCE = 1e-4     # of morph targets, as a share of the size
MOST_TARGETS = 256


@dataclass(frozen=True)
class Saved:
    """The written files."""

    files: tuple[Path, ...]
    frames: int
    vertices: int           # or points; of .glb, of the surface: the file repeats those at sharp edges and seams
    targets: int = 0        # of .glb
    error: float = 0.0      # the largest distance of a vertex from the motion, in any frame [length unit]

    def __iter__(self):
        return iter(self.files)


def save(session: "OpenSession", path: "str | os.PathLike[str]", *, tolerance: float, up: str,
         frames_per_second: float | None = None, nodes: "Iterable[int] | None" = None,
         surface: "str | os.PathLike[str] | None" = None) -> Saved:
    """See OpenSession.save()."""
    target = checks.path(path, "path")
    ending = checks.one_of(target.suffix.lower(), (".glb", ".mdd", ".pc2", ".pvd", ".csv"), "path")
    checks.one_of(up, gltf.TURNS, "up")
    if not 0 < checks.real(tolerance, "tolerance") <= 1:
        raise invalid("tolerance", f"tolerance must be in (0, 1], is {tolerance}")
    rate = None if frames_per_second is None else checks.real(frames_per_second, "frames_per_second")
    if rate is not None and not 0 < rate < float("inf"):
        raise invalid("frames_per_second", f"frames_per_second must be > 0, is {frames_per_second}")
    try:
        if ending == ".csv":
            if surface not in (None, NODES):
                raise invalid("surface", "a .csv has nodes and no surface")
            return _csv(target, session.moving_points(), rate, nodes)
        if nodes is not None:
            raise invalid("nodes", "nodes are of .csv: other files have the whole surface")
        drawn = _drawn(session, surface)
        moving = session.moving_surface(None if drawn is None else (drawn.vertices, drawn.corners))
        moving = moving if rate is None else replace(moving, frames_per_second=rate)
        if ending == ".glb":
            return _glb(target, moving, drawn, tolerance, up, session.id)
        return _series(target, moving) if ending == ".pvd" else _cache(target, moving, drawn)
    except LimberError:
        raise
    except OSError as error:
        raise of_file(error, f"{target} cannot be written", "path") from error


def _drawn(session: "OpenSession", surface: "str | os.PathLike[str] | None") -> "ObjSurface | None":
    """The surface that is saved in place of the session's own."""
    if surface is None:
        return session.carried_obj()
    return None if surface == NODES else obj_files.load(checks.path(surface, "surface"), "surface")


def _glb(target: Path, surface: MovingSurface, drawn: "ObjSurface | None", tolerance: float, up: str, session: str) -> Saved:
    origin = precision.origin_for(surface.positions)
    positions = precision.relative(surface.positions, origin)
    frames = len(positions)
    if surface.is_loop:  # players go from the last time to the first at once: the loop is closed
        positions = np.concatenate([positions, positions[:1]])
    base, targets, weights, error = morphs.sliders(positions, tolerance * surface.size, MOST_TARGETS)
    # A vertex of glTF has one normal and one texture coordinate: those at sharp edges and seams are there more than once.
    faces, source = normals.split_creases(surface.faces, base)
    rest, added = normals.fitted(faces, base[source], (shape[source] for shape in positions), weights)
    texcoords = None
    if drawn is not None and len(drawn.texcoords) and drawn.textures.min() >= 0 \
            and drawn.textures.max() < len(drawn.texcoords):
        pairs, corners = np.unique(np.stack([faces.ravel(), drawn.textures.ravel()]), axis=1, return_inverse=True)
        texcoords = drawn.texcoords[pairs[1]] * (1, -1) + (0, 1)
        faces, source, rest, added = corners.reshape(-1, 3), source[pairs[0]], rest[pairs[0]], added[:, pairs[0]]
    target.write_bytes(gltf.glb(replace(surface, faces=faces), base[source], targets[:, source], weights, up, (rest, added),
                                texcoords, _materials(drawn), origin, session))
    return Saved((target,), frames, len(base), len(targets), error)


def _materials(drawn: "ObjSurface | None") -> "list[gltf.Material]":
    """Those that a drawn surface uses."""
    if drawn is None:
        return []
    colours = obj_files.colours(drawn)
    made = []
    for number in np.unique(drawn.materials).tolist():
        name = drawn.names[number] if number >= 0 else ""
        made.append(gltf.Material(name, colours.get(name, gltf.COLOUR), np.flatnonzero(drawn.materials == number)))
    return made


def _cache(target: Path, surface: MovingSurface, drawn: "ObjSurface | None") -> Saved:
    """A cache of points, and the surface as .obj in the same folder: in the first frame, or as it was drawn, with its materials.
    Far from the origin both are relative to the middle of the motion, which a comment in the .obj names."""
    frames, vertices = surface.positions.shape[:2]
    origin = precision.origin_for(surface.positions)
    surface = replace(surface, positions=precision.relative(surface.positions, origin))
    if drawn is None:
        beside = {f"{target.stem}_surface.obj": _obj(surface, origin)}
    else:
        beside = {f"{target.stem}_detail.obj": obj_files.moved(drawn.content, origin), **drawn.libraries}
    files = {target.with_name(name): content for name, content in beside.items()}
    for file, content in files.items():
        _check_replaceable(file, content)
    if target.suffix.lower() == ".mdd":
        times = np.arange(frames) / surface.frames_per_second
        cache = (struct.pack(">ii", frames, vertices) + times.astype(">f4").tobytes()
                 + surface.positions.astype(">f4").tobytes())
    else:
        cache = (struct.pack("<12siiffi", b"POINTCACHE2\0", 1, vertices, 0.0, 1.0, frames)
                 + surface.positions.astype("<f4").tobytes())
    target.write_bytes(cache)
    for file, content in files.items():
        if not file.exists() or file.read_bytes() != content:
            file.write_bytes(content)
    return Saved((target, *files), frames, vertices)


def _obj(surface: MovingSurface, origin: np.ndarray) -> bytes:
    lines = [obj_files.origin_line(origin)] if origin.any() else []
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in surface.positions[0].tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (surface.faces + 1).tolist()]
    return (MARK + "\n".join(lines) + "\n").encode("ascii")


def _check_replaceable(file: Path, content: bytes) -> None:
    """Refuses to write over a file that is not the same and that save() did not make."""
    if not os.path.lexists(file):
        return
    old = file.read_bytes()
    if old != content and not old.startswith(MARK.encode("ascii")):
        raise LimberError("FAILED_PRECONDITION", f"{file} exists, and save() did not write it: save under another name or in "
                                                 "another folder", "path")


def _series(target: Path, surface: MovingSurface) -> Saved:
    """A .vtu of triangles for each frame, and the .pvd that lists them, with the displacement from the first frame."""
    frames, vertices = surface.positions.shape[:2]
    files, sets = [target], []
    for frame, shape in enumerate(surface.positions):
        name = f"{target.stem}_{frame:05}.vtu"
        files.append(target.with_name(name))
        files[-1].write_text(vtu.triangles(surface.faces, shape, {"displacement": shape - surface.positions[0]}), encoding="ascii")
        sets.append(f'<DataSet timestep="{frame / surface.frames_per_second:.9g}" file={quoteattr(name)}/>')
    target.write_text('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
                      + "\n".join(sets) + "\n</Collection>\n</VTKFile>\n", encoding="utf-8")
    return Saved(tuple(files), frames, vertices)


def _csv(target: Path, points: MovingPoints, rate: float | None, nodes: "Iterable[int] | None") -> Saved:
    """A row for each point and frame."""
    numbers = list(points.numbers)
    places = range(len(numbers))
    if nodes is not None:
        requested = checks.wholes(nodes, "nodes")
        missing = sorted(set(requested) - set(numbers))
        if missing:
            raise LimberError("OUT_OF_RANGE", f"there is no {points.name} {missing[0]}", "nodes")
        where = {number: i for i, number in enumerate(numbers)}
        places = [where[number] for number in requested]
    rate = points.frames_per_second if rate is None else rate
    digits = 16 if precision.is_far(points.positions) else 9
    with open(target, "w", encoding="utf-8") as out:
        out.write(f"frame,time_s,{points.name},x,y,z\n")
        for frame, shape in enumerate(points.positions):
            for i in places:
                x, y, z = shape[i].tolist()
                out.write(f"{frame},{frame / rate:.9g},{numbers[i]},{x:.{digits}g},{y:.{digits}g},{z:.{digits}g}\n")
    return Saved((target,), len(points.positions), len(places))
