"""Sessions of structures of beams, which keep them in equilibrium."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import arrays, checks
from ..edits import Vector
from ..errors import LimberError, invalid
from ..laths import EDGE_DISTANCE, Laths
from ..messages import beam_structure, service
from ..messages import scene as messages
from ..moving import PATH_RATE, MovingPoints, MovingSurface
from ..open_session import OpenSession, Receipt
from ..pictures import Coloured, of_vertices
from ..player import Played
from . import edits, laths, playing, solutions, surfaces
from .geometry import BeamGeometry
from .results import BeamResult
from .solutions import BeamSolution


class BeamSession(OpenSession):
    """A session of a structure of beams. Made by Server.open() or Server.session(). Nodes and elements count from 0, SI units. An
    edit continues from the current equilibrium: changes are applied step by step."""

    FORMATS = {"vtu": service.EXPORT_FORMAT_VTU, "csv": service.EXPORT_FORMAT_CSV, "json": service.EXPORT_FORMAT_JSON,
               "scene": service.EXPORT_FORMAT_SCENE}
    DEFAULT_FORMATS = ("vtu", "csv")
    _geometry: BeamGeometry | None = None

    def result_of(self, info: "service.ResultInfo") -> BeamResult:
        return BeamResult.from_message(info)

    def scene(self) -> "messages.Scene":
        """The scene as edited."""
        request = service.GetSessionRequest(session=self.reference, with_scene=True)
        return self.connection.call("get_session", request, timeout=max(60.0, self.connection.timeout)).scene

    def structure(self) -> "beam_structure.BeamStructure":
        """Nodes, elements, and supports, motions and loads after the edits of all clients."""
        return self.scene().beams.structure

    # ---- edits ----

    def support(self, node: int, translations: str = "xyz", rotations: str = "xyz", axes: Any = None) -> Receipt:
        """Holds a node where it is drawn: see beam_edits.support()."""
        return self.edit([edits.support(node, translations, rotations, axes)])

    def move_support(self, node: int, *, x: float | None = None, y: float | None = None, z: float | None = None,
                     position: "Vector | None" = None, rotation: "Vector | None" = None,
                     rotation_x: float | None = None, rotation_y: float | None = None,
                     rotation_z: float | None = None, axes: Any = None) -> Receipt:
        """Brings a node somewhere, a support or not, and holds it there: see beam_edits.move()."""
        return self.edit([edits.move(node, x=x, y=y, z=z, position=position, rotation=rotation,
                                          rotation_x=rotation_x, rotation_y=rotation_y, rotation_z=rotation_z,
                                          axes=axes)])

    def release(self, node: int) -> Receipt:
        """Takes the node's support and motion away."""
        return self.edit([edits.release(node)])

    def hold(self, node: int, translations: str = "xyz", rotations: bool = True) -> Receipt:
        """Holds a node where it is; wait() first."""
        return self.edit([edits.hold(node, translations, rotations)])

    def load(self, node: int, force: Vector = (0, 0, 0), moment: Vector = (0, 0, 0), follows: bool = False) -> Receipt:
        """Replaces the loads of a node: force [N], moment [N m]; follows: they turn with it. Nothing: no load."""
        return self.edit([edits.load(node, force, moment, follows)])

    def element_load(self, element: int, force: Vector = (0, 0, 0), follows: bool = False) -> Receipt:
        """Replaces the distributed load of an element [N/m]."""
        return self.edit([edits.element_load(element, force, follows)])

    def gravity(self, gravity: Vector) -> Receipt:
        """[m/s^2]"""
        return self.edit([edits.gravity(gravity)])

    # ---- shapes and their forces ----

    def geometry(self) -> BeamGeometry:
        """Data common to all shapes; fetched once."""
        if self._geometry is None:
            message = self.connection.call("get_geometry", service.GetGeometryRequest(session=self.reference),
                                           timeout=max(60.0, self.connection.timeout))
            self._geometry = BeamGeometry.from_message(message)
        return self._geometry

    def geometry_for(self, frames: "service.Frames") -> BeamGeometry | None:
        return self.geometry() if frames.encoding == service.ENCODING_COORDINATES else None

    def rotations(self, first: int = 0, count: int = 0, final: bool = False) -> np.ndarray:
        """Rotations in the frames: frames x nodes x 4 float32, quaternions w, x, y, z from rest."""
        return self.geometry().rotations(arrays.to_numpy(self.raw_frames(first, count, final=final).data, "frames"))

    def solution(self, stations: int = 11) -> BeamSolution:
        """Positions, reactions, forces, stresses and energies of the newest equilibrium, in full precision. stations: of
        solution.along() on each element, 2 to 201, 0: none. Warns (limber.StrengthWarning) where a stress is beyond the yield
        stress."""
        request = service.GetBeamSolutionRequest(session=self.reference, stations=checks.whole(stations, "stations"))
        response = self.connection.call("get_beam_solution", request, timeout=max(60.0, self.connection.timeout))
        solution = solutions.from_message(response.solution)
        solutions.warn_of_strength(solution.utilisation, f"the structure of session {self.id}", stacklevel=2)
        return solution

    def wait(self, revision: int | None = None, until: str = "final", timeout: float = 60.0) -> BeamResult:
        """As for every session. Warns (limber.StrengthWarning) if a stress of a final result is beyond the yield stress, and once
        if the structure snapped on the path to a result (limber.SnapWarning)."""
        result = super().wait(revision, until, timeout)
        self.warn_of_snaps(result, [str(snap) for snap in result.snaps], stacklevel=2)
        solutions.warn_of_strength(result.utilisation, f"the structure of session {self.id}", stacklevel=2)
        return result

    def moving_surface(self, drawn: "tuple[np.ndarray, np.ndarray] | None" = None) -> MovingSurface:
        """The elements with their sections, straight from node to node."""
        if drawn is not None:
            raise invalid("surface", "a surface follows bodies alone")
        scene, coordinates = self.scene(), self.frames(encoding="coordinates")
        faces, positions = surfaces.swept(scene.beams.structure, self.geometry().positions(coordinates),
                                          self.geometry().rotations(coordinates))
        return MovingSurface(scene.name or self.id, faces, positions, PATH_RATE, 1.0)

    def played(self, tolerance: float, drawn: "tuple[np.ndarray, np.ndarray] | None" = None) -> Played:
        """Positions and rotations of nodes, of which the player sweeps the elements."""
        return playing.played(self, drawn)

    COLOURS = ("none", "displacement", "stress", "utilisation")

    def coloured(self, colour: str, frame: int, yield_stress: float | None = None) -> Coloured:
        """Elements have their largest stress; that of the shape itself alone is known."""
        if frame != -1 and colour in ("stress", "utilisation"):
            raise invalid("frame", "stresses of beams are those of the last frame")
        surface = self.moving_surface()
        count = len(surface.positions)
        if not -count <= checks.real(frame, "frame") < count:
            raise LimberError("OUT_OF_RANGE", f"frame {frame}: there are {count}, from 0", "frame")
        faces, positions = surface.faces, surface.positions[frame]
        corners, triangles = surfaces.counts(self.structure())
        if colour == "none":
            return Coloured(faces, positions, np.zeros(0), "")
        if colour == "displacement":
            geometry = self.geometry()
            moved = np.linalg.norm(geometry.positions(self.frames(encoding="coordinates"))[frame] - geometry.rest, axis=1)
            ends = np.repeat(moved[geometry.elements].ravel(), np.repeat(corners, 2))
            return Coloured(faces, positions, of_vertices(faces, ends), "displacement [m]")
        solution = self.solution()
        values = solution.stresses if colour == "stress" else solution.utilisations
        if colour == "utilisation" and yield_stress is not None:
            values = solution.stresses / yield_stress
        label = "von Mises stress [Pa]" if colour == "stress" else "utilisation"
        return Coloured(faces, positions, np.repeat(values, triangles), label)

    def moving_points(self) -> MovingPoints:
        """All nodes."""
        frames = self.geometry().positions(self.frames(encoding="coordinates"))
        return MovingPoints("node", range(frames.shape[1]), frames, PATH_RATE)

    def laths(self, unit: str = "mm", overhang: float | None = None, straight: float = laths.STRAIGHT, *,
              hole: float | None = None, edge_distance: float = EDGE_DISTANCE) -> Laths:
        """The members to be cut, as drawn, with the largest stress of each in the newest equilibrium. A member is elements of one
        section that continue at a node with a turn of at most `straight` [degree]. `unit`: of all lengths, "mm", "cm", "m" or
        "in"; hole, overhang, edge_distance: for holes where members meet, as in LinkageSession.laths."""
        return laths.of(self, unit, overhang, straight, hole, edge_distance)
