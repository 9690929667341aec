"""Scenes of structures of beams."""

from __future__ import annotations

import os
from pathlib import Path

from .. import checks
from ..errors import invalid
from ..files import mesh_file
from ..messages import scene as messages
from .structures import BeamsLike, structure_of


def beam_scene(structure: "BeamsLike | None" = None, *, lines: "str | os.PathLike[str] | None" = None,
               name: str = "", elements_per_member: int | None = None,
               tolerance: float | None = None) -> "messages.Scene":
    """A scene of a structure of beams, to open. `structure`: a mapping or file (JSON form of limber.v1.BeamStructure), a message,
    or a job of the public relaxation code (its folder, or SimulationJob.json).

    lines: a .ply (with normals) or .obj whose edges are the elements; the structure has the rest then: sections (every
    element gets the first), supports, motions, loads.

    elements_per_member: elements of each beam, 1 to 64 (default 1). `tolerance`, its alternative: share of the structure's size
    by which positions may be off, (0, 0.1]. The server cuts beams into as many elements as that takes. Nodes and elements stay
    those of the structure.
    """
    scene = messages.Scene(name=checks.text(name, "name"))
    if structure is None:
        raise invalid("structure", "a structure has at least sections and what holds it")
    if elements_per_member is not None:
        scene.beams.elements_per_member = checks.whole(elements_per_member, "elements_per_member")
    if tolerance is not None:
        scene.beams.tolerance = checks.real(tolerance, "tolerance")
    read = structure_of(structure)
    if isinstance(read, messages.MeshFile):
        if lines is not None:
            raise invalid("lines", "a job names its mesh itself")
        scene.beams.job.CopyFrom(read)
        return scene
    scene.beams.structure.CopyFrom(read)
    scene.name = scene.name or read.name
    if lines is not None:
        scene.beams.lines.file.CopyFrom(mesh_file(checks.path(lines, "lines"), field="beams.lines.path"))
    return scene


def upload_files(scene: "messages.Scene", folder: Path) -> None:
    """The bytes of the file of lines in place of its path."""
    lines = scene.beams.lines
    if lines.WhichOneof("source") == "path":
        lines.file.CopyFrom(mesh_file(folder / lines.path, field="beams.lines.path"))
