"""Entry of rod linkages for the modules that all kinds share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import invalid
from ..files import has_only_lines, read
from ..kind import Kind
from ..messages import scene as messages
from ..progress import ProgressOption
from ..scenes import describe_material
from . import scenes
from .session import LinkageSession

if TYPE_CHECKING:
    from ..server import Server

WIDTH, HEIGHT = 0.1, 0.05  # of a lath, as shares of the median line


class Linkages(Kind):
    """Files without a scene: an .obj of lines, whose rods are laths a tenth of the median line wide and a twentieth high."""

    session_class = LinkageSession

    def accepts(self, scene: "messages.Scene") -> bool:
        return scene.HasField("linkage")

    def upload_files(self, scene: "messages.Scene", folder: Path) -> None:
        scenes.upload_files(scene, folder)

    def opens(self, path: Path) -> bool:
        return path.suffix.lower() == ".obj" and has_only_lines(path, "scene")

    def scene_of_file(self, server: "Server", path: Path, progress: ProgressOption, timeout: float,
                      **filling: Any) -> "messages.Scene":
        line = _median_line(path)
        return scenes.linkage_scene(path, section={"rectangle": (WIDTH * line, HEIGHT * line)})

    def describe_defaults(self, scene: "messages.Scene") -> str:
        lath = scene.linkage.section.rectangle
        return (f"a rod linkage of laths {lath.width:.3g} wide and {lath.height:.3g} high (a tenth and a twentieth of the "
                f"median line); {describe_material(scene, scene.linkage.material)}")


def _median_line(path: Path) -> float:
    words = [line.split() for line in read(path, "scene").decode("utf-8", "replace").splitlines()]
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
