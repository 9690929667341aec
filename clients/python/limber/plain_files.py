"""Files that are opened without a scene: meshes of tets, surfaces, lines."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import motions, scenes
from .errors import LimberError, invalid
from .linkages import linkage_scene
from .messages import scene as messages
from .progress import ProgressOption

if TYPE_CHECKING:
    from .server import Server

TETS = {".msh", ".mesh", ".vtk", ".vtu", ".ele", ".node", ".veg", ".abq", ".inp"}
TRIANGLES = {".ply", ".stl"}
JOB = "SimulationJob.json"  # beside a .ply of lines, which is no surface
WIDTH, HEIGHT = 0.1, 0.05  # of a lath, as shares of the median line


def kind(path: Path) -> str:
    """"tets", "triangles", "lines", or "" of what is no such file: by its ending, and of an .obj by what is in it."""
    ending = path.suffix.lower()
    if not path.is_file():
        return ""
    if ending in TETS:
        return "tets"
    if ending in TRIANGLES:
        return "triangles"
    if ending != ".obj":
        return ""
    first = {line.split(maxsplit=1)[0] for line in motions.read(path, "scene").splitlines() if line.strip()}
    return "lines" if b"l" in first and b"f" not in first else "triangles"


def scene_of(server: "Server", path: Path, progress: ProgressOption, timeout: float, **filling: Any) -> "messages.Scene":
    """A scene of such a file, with the server's defaults; a surface is filled with tets (`filling` as tetrahedralize()
    takes it), rods are laths a tenth of the median line wide and a twentieth high."""
    what = kind(path)
    if what == "tets":
        return scenes.scene_from_mesh(path)
    if what == "lines":
        line = _median_line(path)
        return linkage_scene(path, section={"rectangle": (WIDTH * line, HEIGHT * line)})
    try:
        filled = server.tetrahedralize(path, progress=progress, timeout=timeout, **filling)
    except LimberError as error:
        if not (path.parent / JOB).is_file():
            raise
        raise LimberError(error.code, f"{error.message}; {path.parent} is a job of the public relaxation code: open the "
                          "folder", error.field, error.details) from error
    return scenes.scene_from_arrays(filled.nodes, filled.tets, name=path.stem)


def _median_line(path: Path) -> float:
    words = [line.split() for line in motions.read(path, "scene").decode("utf-8", "replace").splitlines()]
    try:
        points = np.array([word[1:4] for word in words if word[:1] == ["v"]], dtype=float).reshape(-1, 3)
        chains = [[int(vertex) for vertex in word[1:]] for word in words if word[:1] == ["l"]]
    except ValueError as error:
        raise invalid("scene", f"{path}: {error}") from error
    pairs = [pair for chain in chains for pair in zip(chain, chain[1:])]
    known = [(a - (a > 0), b - (b > 0)) for a, b in pairs if 0 < max(abs(a), abs(b)) <= len(points)]
    lengths = [float(np.linalg.norm(points[a] - points[b])) for a, b in known]
    if not lengths or not 0 < np.median(lengths) < np.inf:
        raise invalid("scene", f"{path} has no lines (`l`) of some length")
    return float(np.median(lengths))


def assumed(scene: "messages.Scene") -> str:
    """What a scene of such a file, as the server has it, has that its file does not say."""
    part = scene.linkage.material if scene.HasField("linkage") else scene.material
    words = (f"Young's modulus {part.youngs_modulus:.3g} Pa, Poisson's ratio {part.poissons_ratio:.3g}, "
             f"{part.density:.4g} kg/m3, 1 unit = {scene.length_unit_in_metres:.4g} m")
    if scene.HasField("linkage"):
        lath = scene.linkage.section.rectangle
        return (f"a rod linkage of laths {lath.width:.3g} wide and {lath.height:.3g} high (a tenth and a twentieth of the "
                f"median line); {words}")
    return (f"an elastic body of which nothing is fixed, {scene.frames} frames at {scene.dynamics.frames_per_second:.4g} "
            f"a second; {words}")
