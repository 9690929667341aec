"""Structures of beams that bend far, live: scenes of them, and sessions that keep them in equilibrium."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import arrays, beam_edits, beams, checks, edits, exports
from .edits import Vector
from .errors import LimberError, invalid
from .mesh_files import mesh_file
from .messages import scene as messages
from .messages import service
from .open_session import OpenSession, Receipt
from .results import Result


def beam_scene(structure: "beams.BeamsLike | None" = None, *, lines: "str | os.PathLike[str] | None" = None,
               name: str = "") -> "messages.Scene":
    """A scene of a structure of beams, to open: a mapping or file (JSON form of limber.v1.BeamStructure), a message, or
    a job of the public relaxation code (its folder, or SimulationJob.json).

    lines: a .ply (with normals) or .obj whose edges are the elements; the structure has the rest then: sections (every
    element gets the first), supports, motions, loads.
    """
    scene = messages.Scene(name=checks.text(name, "name"))
    if structure is None:
        raise invalid("structure", "a structure has at least sections and what holds it")
    read = beams.structure_of(structure)
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


@dataclass(frozen=True)
class BeamResult(Result):
    """One published shape of a structure of beams. Of a result that is not final, nothing more is known than that.
    status: "CONVERGED", "STALLED", "SADDLE" (balanced, but unstable), "UNBALANCED" (a mechanism), "ITERATION_LIMIT",
    "CANCELLED"; energy: elastic [J]."""

    method: str = ""            # of the answer: "newton" follows the branch, "relaxation_then_newton" does not
    load_steps: int = 0
    relaxation_steps: int = 0
    load_factor: float = 0.0    # share of the way that was gone
    node: int | None = None     # that moves most freely or is worst balanced
    utilisation: float = 0.0    # the largest
    largest_bend: float = 0.0   # between an end and its chord [radian]; above 0.5 the elements are too long
    steps: int = 0              # frames of a final result: shapes on the way, the shape itself last
    snaps: tuple[beams.BeamSnap, ...] = ()
    negative_eigenvalues: int | None = None  # of the stiffness: 0 at a minimum; None where nothing balances

    @staticmethod
    def from_message(info: "service.ResultInfo") -> "BeamResult":
        more = info.beams
        method = {number: name for name, number in beams.METHODS.items()}.get(more.method, "")
        return BeamResult(**vars(Result.from_message(info)), method="" if method == "choose" else method,
                          load_steps=more.load_steps, relaxation_steps=more.relaxation_steps,
                          load_factor=more.load_factor, node=more.node if more.HasField("node") else None,
                          utilisation=more.largest_utilisation, largest_bend=more.largest_bend, steps=more.steps,
                          snaps=beams.snaps_of(more.snaps),
                          negative_eigenvalues=beams.negative_eigenvalues_of(more))


@dataclass(frozen=True)
class BeamGeometry:
    """What stays the same for all shapes of a structure of beams."""

    rest: np.ndarray      # nodes x 3, float32, as drawn [m]
    elements: np.ndarray  # elements x 2, int32: their nodes
    basis_hash: str = field(default="")  # frames of beams have no basis

    @staticmethod
    def from_message(message: "service.GetGeometryResponse") -> "BeamGeometry":
        return BeamGeometry(arrays.to_numpy(message.rest, "rest"), arrays.to_numpy(message.beams.elements, "elements"))

    def _shapes(self, coordinates: np.ndarray) -> np.ndarray:
        if coordinates.ndim != 2 or coordinates.shape[1] != 7 * len(self.rest):
            raise LimberError("MALFORMED", f"coordinates {coordinates.shape} do not fit {len(self.rest)} nodes")
        return coordinates.reshape(len(coordinates), -1, 7)

    def positions(self, coordinates: np.ndarray) -> np.ndarray:
        """frames x nodes x 3 float32 [m]"""
        return np.array(self._shapes(coordinates)[:, :, :3], dtype=np.float32)

    def rotations(self, coordinates: np.ndarray) -> np.ndarray:
        """frames x nodes x 4 float32: quaternions w, x, y, z from rest"""
        return np.array(self._shapes(coordinates)[:, :, 3:], dtype=np.float32)


class BeamSession(OpenSession):
    """A session of a structure of beams. Made by Server.open() or Server.session(). Nodes and elements count from 0, SI
    units. An edit goes on from the equilibrium there is: what changes is brought on step by step."""

    FORMATS = exports.BEAMS
    DEFAULT_FORMATS = ("vtu", "csv")
    _geometry: BeamGeometry | None = None

    def result_of(self, info: "service.ResultInfo") -> BeamResult:
        return BeamResult.from_message(info)

    def scene(self) -> "messages.Scene":
        """The scene as edited."""
        request = service.GetSessionRequest(session=self.reference, with_scene=True)
        return self.connection.call("get_session", request, timeout=max(60.0, self.connection.timeout)).scene

    def structure(self) -> "messages.BeamScene":
        """Nodes, elements, and what every client's edits made of supports, motions and loads."""
        return self.scene().beams.structure

    # ---- edits ----

    def support(self, node: int, translations: str = "xyz", rotations: str = "xyz", axes: Any = None) -> Receipt:
        """Holds a node where it is drawn: see beam_edits.support()."""
        return self.edit([beam_edits.support(node, translations, rotations, axes)])

    def move_support(self, node: int, *, x: float | None = None, y: float | None = None, z: float | None = None,
                     position: "Vector | None" = None, rotation: "Vector | None" = None,
                     rotation_x: float | None = None, rotation_y: float | None = None,
                     rotation_z: float | None = None, axes: Any = None) -> Receipt:
        """Brings a node somewhere, a support or not, and holds it there: see beam_edits.move()."""
        return self.edit([beam_edits.move(node, x=x, y=y, z=z, position=position, rotation=rotation,
                                          rotation_x=rotation_x, rotation_y=rotation_y, rotation_z=rotation_z,
                                          axes=axes)])

    def release(self, node: int) -> Receipt:
        """Takes the node's support and motion away."""
        return self.edit([beam_edits.release(node)])

    def hold(self, node: int, translations: str = "xyz", rotations: bool = True) -> Receipt:
        """Holds a node where it is; wait() first."""
        return self.edit([beam_edits.hold(node, translations, rotations)])

    def load(self, node: int, force: Vector = (0, 0, 0), moment: Vector = (0, 0, 0), follows: bool = False) -> Receipt:
        """Replaces what loads a node: force [N], moment [N m]; follows: they turn with it. Nothing: no load."""
        return self.edit([beam_edits.load(node, force, moment, follows)])

    def element_load(self, element: int, force: Vector = (0, 0, 0), follows: bool = False) -> Receipt:
        """Replaces what is distributed over an element [N/m]."""
        return self.edit([beam_edits.element_load(element, force, follows)])

    def gravity(self, gravity: Vector) -> Receipt:
        """[m/s^2]"""
        return self.edit([beam_edits.gravity(gravity)])

    # ---- shapes and what they carry ----

    def geometry(self) -> BeamGeometry:
        """What stays the same for all shapes; fetched once."""
        if self._geometry is None:
            message = self.connection.call("get_geometry", service.GetGeometryRequest(session=self.reference),
                                           timeout=max(60.0, self.connection.timeout))
            self._geometry = BeamGeometry.from_message(message)
        return self._geometry

    def geometry_for(self, frames: "service.Frames") -> BeamGeometry | None:
        return self.geometry() if frames.encoding == service.ENCODING_COORDINATES else None

    def rotations(self, first: int = 0, count: int = 0, final: bool = False) -> np.ndarray:
        """Of the frames: frames x nodes x 4 float32, quaternions w, x, y, z from rest."""
        return self.geometry().rotations(arrays.to_numpy(self.raw_frames(first, count, final=final).data, "frames"))

    def solution(self) -> beams.BeamSolution:
        """Positions, reactions, forces, stresses and energies of the newest equilibrium, in full precision."""
        request = service.GetBeamSolutionRequest(session=self.reference)
        response = self.connection.call("get_beam_solution", request, timeout=max(60.0, self.connection.timeout))
        return beams.from_message(response.solution)
