"""Entry of structures of beams for the modules that all kinds share."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Mapping

from ..kind import Kind
from ..messages import scene as messages
from . import scenes, structures
from .session import BeamSession


class Beams(Kind):
    """Read in place of a scene: jobs of the public relaxation code, and a structure alone."""

    session_class = BeamSession

    def accepts(self, scene: "messages.Scene") -> bool:
        return scene.HasField("beams")

    def read_job(self, path: Path) -> "messages.Scene | None":
        if not structures.is_job(path):
            return None
        scene = messages.Scene()
        scene.beams.job.CopyFrom(structures.load_structure(path))
        return scene

    def as_scene(self, value: "Mapping[str, Any]") -> "Mapping[str, Any]":
        is_structure = "beams" not in value and ("nodes" in value or "elements" in value)  # scenes have none
        return {"beams": {"structure": value}} if is_structure else value

    def upload_files(self, scene: "messages.Scene", folder: Path) -> None:
        scenes.upload_files(scene, folder)

    def advice(self, path: Path) -> str:
        """A .ply of lines in the folder of a job is no surface."""
        is_beside_job = (path.parent / structures.JOB).is_file()
        return f"{path.parent} is a job of the public relaxation code: open the folder" if is_beside_job else ""
