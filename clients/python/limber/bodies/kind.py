"""Entry of elastic bodies for the modules that all kinds share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import kind
from ..errors import LimberError
from ..files import SURFACES, has_only_lines
from ..messages import scene as messages
from ..progress import ProgressOption
from ..scenes import describe_material
from . import edits, scenes
from .session import Session

if TYPE_CHECKING:
    from ..server import Server

TETS = {".msh", ".mesh", ".vtk", ".vtu", ".ele", ".node", ".veg", ".abq", ".inp"}


class Bodies(kind.Kind):
    """Files without a scene: meshes of tets, and closed surfaces, which are filled with tets. Scenes are of bodies where
    they are of no other kind."""

    session_class = Session

    def upload_files(self, scene: "messages.Scene", folder: Path) -> None:
        scenes.upload_files(scene, folder)

    def set_variables(self, scene: "messages.Scene", variables: str) -> None:
        scene.material_optimisation.variables = edits.optimise(variables).set_material.variables

    def paint(self, scene: "messages.Scene", stiffness: Any) -> None:
        scenes.paint(scene, stiffness)

    def opens(self, path: Path) -> bool:
        return path.suffix.lower() in TETS or self.fills(path)

    def fills(self, path: Path) -> bool:
        ending = path.suffix.lower()
        return ending in SURFACES and not (ending == ".obj" and has_only_lines(path, "scene"))

    def scene_of_file(self, server: "Server", path: Path, progress: ProgressOption, timeout: float,
                      **filling: Any) -> "messages.Scene":
        if path.suffix.lower() in TETS:
            return scenes.scene_from_mesh(path)
        try:
            filled = server.tetrahedralize(path, progress=progress, timeout=timeout, **filling)
        except LimberError as error:
            advice = kind.advice(path)
            if not advice:
                raise
            raise LimberError(error.code, f"{error.message}; {advice}", error.field, error.details) from error
        return scenes.scene_from_arrays(filled.nodes, filled.tets, name=path.stem, surface=path)

    def describe_defaults(self, scene: "messages.Scene") -> str:
        return (f"an elastic body of which nothing is fixed, {scene.frames} frames at "
                f"{scene.dynamics.frames_per_second:.4g} a second; {describe_material(scene, scene.material)}")
