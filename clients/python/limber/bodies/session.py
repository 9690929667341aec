"""Sessions of elastic bodies: their constraints, edits and results."""

from __future__ import annotations

import random
import time
from pathlib import PurePosixPath
from typing import Any, Iterable, Sequence

import numpy as np

from .. import checks, obj_files
from ..edits import EditLike, to_messages, vector
from ..errors import LimberError, invalid
from ..exports import fetch_first_part
from ..messages import scene as scenes, service
from ..moving import MovingPoints, MovingSurface, of_nodes
from ..obj_files import ObjSurface
from ..open_session import OpenSession, Receipt
from ..pictures import Coloured, of_vertices
from ..player import Played
from ..results import Result
from . import edits, picking, playing, strains, tet_materials
from .embedding import Embedding
from .geometry import CarriedSurface, Geometry
from .keyframes import Keyframe, keyframe
from .material import Material
from .modal import Modal, ModalMotion, motion_of
from .modal import of as of_session
from .picking import SurfacePoint, SurfacePointLike


class Constraint:
    """A constraint of a session, as this client last knew it."""

    def __init__(self, session: "Session", message: "scenes.Constraint", issues: Iterable[str] = ()):
        self.session = session
        self.message = message
        self.issues = tuple(issues)  # warnings of the edit that added or replaced it, e.g. that its nodes are fixed

    @property
    def id(self) -> int:
        return self.message.id

    @property
    def frame(self) -> int:
        return self.message.frame

    @property
    def nodes(self) -> tuple[int, ...]:
        """Nodes of a group; none for a point or a vertex of a surface."""
        return tuple(self.message.nodes)

    @property
    def surface_point(self) -> SurfacePoint | None:
        return picking.from_message(self.message.point) if self.message.HasField("point") else None

    @property
    def surface_vertex(self) -> int | None:
        return self.message.surface_vertex if self.message.HasField("surface_vertex") else None

    @property
    def kind(self) -> str:
        """Meaning of the target: "position", "displacement" or "velocity"."""
        return self.message.WhichOneof("target") or "displacement"

    @property
    def target(self) -> tuple[float, float, float]:
        value = getattr(self.message, self.kind)
        return (value.x, value.y, value.z)

    def move(self, target: Sequence[float] | None = None, *, position: Sequence[float] | None = None,
             displacement: Sequence[float] | None = None, velocity: Sequence[float] | None = None) -> Receipt:
        """Another target: of the kind the constraint has, or of the kind named."""
        kinds = {self.kind: target} if target is not None else {}
        kinds |= {kind: value for kind, value in (("position", position), ("displacement", displacement),
                                                  ("velocity", velocity)) if value is not None}
        count = sum(value is not None for value in (target, position, displacement, velocity))
        if count != 1:
            raise invalid("target", "give exactly one of target, position, displacement and velocity")
        [(named, values)] = kinds.items()
        point = vector(values, named)
        changed = scenes.Constraint()
        changed.CopyFrom(self.message)
        if named == self.kind:
            edits.move_path(changed, point)
        getattr(changed, named).CopyFrom(point)
        if named == self.kind:
            edit = service.Edit(move=service.MoveConstraint(id=self.id, target=point))
        else:
            edit = service.Edit(replace=service.ReplaceConstraint(constraint=changed))
        receipt = self.session.edit([edit])
        self.message = changed
        return receipt

    def replace(self, **what: Any) -> Receipt:
        """Everything anew (arguments as in Session.add), under the same id."""
        changed = edits.constraint(id=self.id, **what)
        receipt = self.session.edit([service.Edit(replace=service.ReplaceConstraint(constraint=changed))])
        self.message = changed
        self.issues = receipt.issues
        return receipt

    @property
    def path(self) -> tuple[tuple[int, tuple[float, float, float]], ...]:
        """Its keys (frame, target), the first one among them."""
        return tuple((frame, (at.x, at.y, at.z)) for frame, at in edits.keys_of(self.message))

    def retime(self, *, shift: int = 0, first: int | None = None, last: int | None = None) -> Receipt:
        """Other frames, the same places: all keys `shift` frames later, or the path stretched so that it begins in frame `first`
        and ends in frame `last`. One that is not given stays."""
        changed = edits.retimed(self.message, shift, first, last)
        receipt = self.session.edit([service.Edit(replace=service.ReplaceConstraint(constraint=changed))])
        self.message = changed
        self.issues = receipt.issues
        return receipt

    def remove(self) -> Receipt:
        return self.session.edit([edits.remove(self)])

    def __repr__(self) -> str:
        held = f"nodes={self.nodes if len(self.nodes) <= 4 else f'{len(self.nodes)} nodes'}"
        if (point := self.surface_point) is not None:
            held = f"surface_point=({point.triangle}, {point.weights})"
        elif self.surface_vertex is not None:
            held = f"surface_vertex={self.surface_vertex}"
        return f"Constraint(id={self.id}, frame={self.frame}, {held}, {self.kind}={self.target})"


class Session(OpenSession):
    """A session of an elastic body. Made by Server.open() or Server.session(); several may name the same session."""

    FORMATS = {"pvd": service.EXPORT_FORMAT_PVD, "pc2": service.EXPORT_FORMAT_PC2,
               "blender": service.EXPORT_FORMAT_BLENDER, "surface": service.EXPORT_FORMAT_SURFACE, "scene": service.EXPORT_FORMAT_SCENE}
    DEFAULT_FORMATS = ("pvd", "blender")

    def scene(self) -> "scenes.Scene":
        """The scene as edited, with its base motion and poses, without the mesh's bytes."""
        request = service.GetSessionRequest(session=self.reference, with_base_motion=True)
        return self.connection.call("get_session", request, timeout=max(60.0, self.connection.timeout)).scene

    def constraints(self) -> list[Constraint]:
        """Those of every client, as of now."""
        request = service.GetSessionRequest(session=self.reference, with_scene=True)
        scene = self.connection.call("get_session", request).scene
        return [Constraint(self, message) for message in scene.constraints]

    def keyframes(self) -> list[Keyframe]:
        """Those of every client, as of now, without their poses."""
        request = service.GetSessionRequest(session=self.reference, with_scene=True)
        scene = self.connection.call("get_session", request).scene
        return [Keyframe(self, message) for message in scene.keyframes]

    def wait(self, revision: int | None = None, until: str = "final", timeout: float = 60.0) -> Result:
        """As OpenSession.wait; the first time it warns of a model that misses its tolerance."""
        result = super().wait(revision, until, timeout)
        if not self._is_accuracy_reported:  # opened without waiting
            self.warn_of_accuracy(self.status(), stacklevel=2)
        return result

    _carried_surface: CarriedSurface | None = None

    # ---- edits ----

    def edit(self, changes: Iterable[EditLike], expected_revision: int | None = None) -> Receipt:
        """All or nothing, in order, as one revision.

        expected_revision: refuse (FAILED_PRECONDITION) unless this is the newest one.
        """
        if expected_revision is not None:
            checks.whole(expected_revision, "expected_revision", most=2 ** 64 - 1)
        changes = list(checks.several(changes, "edits"))
        if not any(isinstance(change, edits.DynamicsChange) for change in changes):
            return self._send(to_messages(changes), expected_revision)
        # Existing values are read first; edits that others make in between are not undone by this one.
        deadline = time.monotonic() + self.connection.timeout
        while True:
            known = self.connection.call("get_session", service.GetSessionRequest(session=self.reference, with_scene=True))
            messages = to_messages(changes, known.scene)
            try:
                return self._send(messages, known.status.revision if expected_revision is None else expected_revision)
            except LimberError as error:
                is_late = error.field == "expected_revision" and expected_revision is None
                if not is_late or time.monotonic() > deadline:
                    raise
            time.sleep(random.uniform(0, 0.01))  # two that do the same must not meet again and again

    def add(self, *, frame: int, node: int | None = None, nodes: Iterable[int] | None = None,
            surface_point: SurfacePointLike | None = None, surface_vertex: int | None = None,
            position: Sequence[float] | None = None, displacement: Sequence[float] | None = None,
            velocity: Sequence[float] | None = None, axes: edits.Axes = None, weight: float | None = None,
            exact: bool = False, until: int | None = None, path: edits.PathLike | None = None, ease_in: float | None = None,
            ease_out: float | None = None, reach: float | None = None) -> Constraint:
        """"In this frame, the (mean) position of the node(s) is there", or their (mean) velocity is that. For a point as it is
        shown: surface_point=(triangle, (w0, w1, w2)) of the surface that the scene names, else of that of the mesh (see
        nearest_surface_point()). `surface_vertex`: a vertex of the surface that the scene names.

        position: a point of the mesh's space, or displacement: from rest [length unit], or velocity: of the shown frames,
        (x[frame + 1] - x[frame - 1]) / 2 * frames per second [length unit / s]; axes: which count, e.g. "xz";
        weight: gamma > 0 of a soft constraint (default 100), or exact=True.
        until: a hold, in every frame from `frame` to this one; path: [(frame, target), ...] further keys, held in every frame
        of the path; ease_in, ease_out in [0, 1] (default 1): how far it begins and ends at rest. reach [s]: how far in time it
        acts; frames farther away keep the motion that is there without it.
        """
        message = edits.constraint(frame=frame, node=node, nodes=nodes, surface_point=surface_point,
                                   surface_vertex=surface_vertex, position=position, displacement=displacement,
                                   velocity=velocity, axes=axes, weight=weight, exact=exact, until=until, path=path,
                                   ease_in=ease_in, ease_out=ease_out, reach=reach)
        receipt = self.edit([service.Edit(add=service.AddConstraint(constraint=message))])
        message.id = receipt.constraint_ids[0]
        return Constraint(self, message, receipt.issues)

    def move(self, constraint: "Constraint | int", target: Sequence[float]) -> Receipt:
        return self.edit([edits.move(constraint, target)])

    def remove(self, constraint: "Constraint | int") -> Receipt:
        return self.edit([edits.remove(constraint)])

    def ends(self, first: str, last: str | None = None) -> Receipt:
        """"free", "position" or "position_velocity" at the first and the last frame; ends("cyclic"): a loop."""
        return self.edit([edits.ends(first, last)])

    def dynamics(self, *, frames_per_second: float | None = None, period_frames: float | None = None,
                 damping_ratio: float | None = None, discretisation: str | None = None,
                 force_smoothing: float | None = None, inertia: float | None = None) -> Receipt:
        """Frequency and damping of the body's motion; options that are not given stay unchanged: limber.edits.dynamics()."""
        return self.edit([edits.dynamics(frames_per_second=frames_per_second, period_frames=period_frames,
                                         damping_ratio=damping_ratio, discretisation=discretisation,
                                         force_smoothing=force_smoothing, inertia=inertia)])

    def move_pins(self, positions: Any) -> Receipt:
        """Other paths of the fixed nodes, frames x fixed nodes x 3 [length unit]: limber.edits.move_pins(). None: the scene's base
        motion again. The modes stay, and so do the constraints."""
        return self.edit([edits.move_pins(positions)])

    def add_keyframe(self, *, frame: int, positions: Any, weight: float | None = None, exact: bool = False) -> Keyframe:
        """"In this frame, the body has this pose", as far as its modes can.

        positions: of all nodes, n x 3 [length unit], or the path of a mesh file whose nodes are the scene's, moved. `weight`:
        gamma > 0 of the distance in modal coordinates (default 100), or exact=True.
        """
        message = keyframe(frame=frame, positions=positions, weight=weight, exact=exact)
        receipt = self.edit([service.Edit(add_keyframe=service.AddKeyframe(keyframe=message))])
        message.ClearField("pose")
        message.id = receipt.keyframe_ids[0]
        return Keyframe(self, message, receipt.issues)

    def optimise(self, variables: str) -> Receipt:
        """Variables that are optimised from now on: "motion" (control forces), "dynamics" (and frequencies and damping) or "all"
        (and the modes). Fitted values stay: "motion" freezes them."""
        return self.edit([edits.optimise(variables)])

    def freeze_material(self) -> Receipt:
        """Keeps the material as fitted so far and optimises control forces only."""
        return self.optimise("motion")

    def reset_material(self) -> Receipt:
        """Discards fitted values: the scene's own material, from which optimisation starts anew."""
        return self.edit([edits.reset_material()])

    # ---- results ----

    def material(self) -> Material:
        """The material of the newest result: frequencies and damping of its modes in SI units, and their mixtures."""
        return Material.from_message(self.connection.call("get_material", service.GetMaterialRequest(session=self.reference)))

    def geometry(self, basis_hash: str = "") -> Geometry:
        """Rest shape, surface and basis: of the newest result, or that of frames with this hash. New columns of the basis are
        fetched once: it grows while a motion is edited."""
        cache = self.server.geometry_cache
        known = next((geometry for owner, geometry in reversed(cache.values()) if owner == self.id), None)
        request = service.GetGeometryRequest(session=self.reference, known_basis_hash=known.basis_hash if known else "",
                                              basis_hash=basis_hash)
        message = self.connection.call("get_geometry", request, timeout=max(60.0, self.connection.timeout))
        geometry = Geometry.from_message(message, known)
        # Bodies of one shape have one basis, wherever they are: the rest shape is the session's own.
        cache[self.id, geometry.basis_hash] = (self.id, geometry)
        return geometry

    def geometry_for(self, frames: "service.Frames") -> Geometry | None:
        """Geometry that decode() needs for these frames."""
        if frames.encoding != service.ENCODING_COORDINATES:
            return None
        cached = self.server.geometry_cache.get((self.id, frames.basis_hash))
        return cached[1] if cached else self.geometry(frames.basis_hash)

    def carried_surface(self) -> CarriedSurface:
        """The surface that the scene names, and how its vertices hang on the nodes. raises LimberError: there is none."""
        surface = self._find_carried_surface()
        if surface is None:
            raise LimberError("FAILED_PRECONDITION", "the session's scene names no surface", "surface")
        return surface

    def _find_carried_surface(self) -> CarriedSurface | None:
        """Fetched once: no edit changes it."""
        if self._carried_surface is None:
            basis_hash = self.geometry().basis_hash
            request = service.GetGeometryRequest(session=self.reference, known_basis_hash=basis_hash, with_surface=True)
            message = self.connection.call("get_geometry", request, timeout=max(60.0, self.connection.timeout))
            if message.HasField("carried_surface"):
                self._carried_surface = CarriedSurface.from_message(message.carried_surface)
        return self._carried_surface

    # ---- picking: at rest, or in a frame of the newest result ----

    def nearest_node(self, position: Sequence[float], frame: int | None = None) -> int:
        """The node of the tets nearest to a position [length unit]."""
        used, nodes = self._pickable(frame)
        return int(used[np.linalg.norm(nodes - picking.point_of(position, "position"), axis=1).argmin()])

    def nodes_in_box(self, low: Sequence[float], high: Sequence[float], frame: int | None = None) -> list[int]:
        """Ids of the nodes of tets that are in a box along the axes, its faces included [length unit]."""
        used, nodes = self._pickable(frame)
        return used[picking.nodes_in_box(nodes, low, high)].tolist()

    def nearest_surface_point(self, position: Sequence[float], frame: int | None = None, surface: str = "shown") -> SurfacePoint:
        """The point of a surface that is nearest to a position [length unit]. The surface is the one that the scene names, else
        the mesh's ("mesh", "carried": that one in any case)."""
        vertices, triangles, surface = self._drawn(frame, surface)
        at = picking.point_of(position, "position")
        triangle, weights, point = picking.nearest_point(at, vertices, triangles)
        return SurfacePoint(triangle, tuple(weights.tolist()), surface, tuple(point.tolist()), float(np.linalg.norm(point - at)))

    def nearest_surface_vertex(self, position: Sequence[float], frame: int | None = None) -> int:
        """The vertex nearest to a position [length unit], of the surface that the scene names."""
        vertices, _, _ = self._drawn(frame, "carried")
        return int(np.linalg.norm(vertices - picking.point_of(position, "position"), axis=1).argmin())

    def _pickable(self, frame: int | None) -> "tuple[np.ndarray, np.ndarray]":
        geometry = self.geometry()
        used = np.unique(geometry.tets)
        return used, (geometry.rest if frame is None else self._frame(frame))[used]

    def _drawn(self, frame: int | None, surface: str) -> "tuple[np.ndarray, np.ndarray, str]":
        if surface not in picking.SURFACES:
            raise invalid("surface", f"a surface is one of {', '.join(picking.SURFACES)}, not {surface!r}")
        carried = None if surface == "mesh" else self._find_carried_surface()
        if surface == "carried":
            carried = self.carried_surface()
        if carried is not None:
            vertices = carried.vertices if frame is None else carried.positions(self._frame(frame)[None])[0]
            return vertices, carried.triangles, "carried"
        geometry = self.geometry()
        return geometry.rest if frame is None else self._frame(frame), geometry.surface, "mesh"

    def carried_obj(self) -> ObjSurface | None:
        """The surface that the scene names, as its .obj says; of another file, one of its triangles. None: there is none."""
        surface = self._find_carried_surface()
        if surface is None:
            return None
        libraries = {PurePosixPath(path).name: content for path, content in fetch_first_part(self, "surface").items()}
        libraries.pop("motion_detail.pc2", None)
        content = libraries.pop("motion_detail.obj")
        return obj_files.parse(content, libraries, surface.name, "surface")

    def moving_surface(self, drawn: "tuple[np.ndarray, np.ndarray] | None" = None) -> MovingSurface:
        """The boundary of its tets, whose vertices are its nodes in their order; or vertices and triangles that follow the tets."""
        status, geometry = self.status(), self.geometry()
        if drawn is None:
            faces, positions = of_nodes(geometry.surface, self.frames())
        else:
            faces, positions = drawn[1], self._positions_of(drawn[0], geometry)
        scene = self.settings()
        return MovingSurface(status.name or self.id, faces, positions, scene.dynamics.frames_per_second,
                             scene.length_unit_in_metres, scene.first_end == scenes.END_CONDITION_CYCLIC)

    def played(self, tolerance: float, drawn: "tuple[np.ndarray, np.ndarray] | None" = None) -> Played:
        """The surface, as a sum of few deformations."""
        return playing.played(self, tolerance, drawn)

    def _positions_of(self, vertices: np.ndarray, geometry: Geometry) -> np.ndarray:
        """frames x vertices x 3: with the server's weights where these are the vertices of the carried surface."""
        carried, frames = self._find_carried_surface(), self.frames()
        if carried is not None and carried.has_vertices(vertices):
            return carried.positions(frames)
        return Embedding.of(vertices, geometry.rest, geometry.tets).positions(frames)

    UP = "y"
    COLOURS = ("none", "displacement", "strain", "stress")

    def coloured(self, colour: str, frame: int, yield_stress: float | None = None) -> Coloured:
        """Triangles have the number of their tet, or of displacements the mean of their nodes."""
        frames, geometry = self._frame(frame), self.geometry()
        faces, label = geometry.surface, ""
        values = np.zeros(0)
        if colour == "displacement":
            values, label = of_vertices(faces, np.linalg.norm(frames - geometry.rest, axis=1)), "displacement [length unit]"
        elif colour != "none":
            shown = strains.tets_of(faces, geometry.tets)
            gradient = strains.gradients(geometry.rest, geometry.tets[shown], frames)
            if colour == "strain":
                values, label = strains.largest_strain(gradient), "largest strain"
            else:
                materials = tet_materials.of_scene(self.settings(), len(geometry.tets))[shown]
                values, label = strains.von_mises(gradient, materials), "von Mises stress [Pa]"
        return Coloured(faces, frames, values, label)

    def _frame(self, frame: int) -> np.ndarray:
        """One of the newest result, nodes x 3; negative ones count from the end."""
        count = self.status().frames
        if not -count <= checks.real(frame, "frame") < count:
            raise LimberError("OUT_OF_RANGE", f"frame {frame}: there are {count}, from 0", "frame")
        return self.frames(checks.whole(frame % count, "frame"), 1)[0]

    def moving_points(self) -> MovingPoints:
        """All nodes of the mesh."""
        frames = self.frames()
        return MovingPoints("node", range(frames.shape[1]), frames, self.settings().dynamics.frames_per_second)

    def settings(self) -> "scenes.Scene":
        """The scene without its base motion."""
        return self.connection.call("get_session", service.GetSessionRequest(session=self.reference, with_scene=True)).scene

    def modal(self, modes: int | None = None) -> Modal:
        """Masses and stiffness of the body at rest as scipy's sparse matrices, its modes and their frequencies, and the newest
        motion in modal coordinates (modal_motion()). There are as many modes as the session has or as requested. All but the
        motion is computed here from the mesh and the materials of its tets, independent of the session's reports."""
        return of_session(self, modes)

    def modal_motion(self) -> ModalMotion:
        """The newest motion in modal coordinates z, the control forces of each frame, the candidate modes and their mixtures (S).
        These are the values of the session's own computation; those of modal() are not."""
        return motion_of(self)

    # ---- control ----

    def solve_cold(self) -> int:
        """Solves the current problem again from the base motion, the better of the two motions stays;
        the job's number."""
        return self.connection.call("solve_cold", service.SolveColdRequest(session=self.reference)).job

    def look_at(self, first: int, count: int = 0) -> None:
        """Frames of a long motion that come first after every edit, in follow(); count 0: to the last one, at most 4096. If there
        are several such requests, by any clients, the newest 8 count."""
        request = service.LookAtRequest(session=self.reference, first_frame=checks.whole(first, "first_frame"),
                                        frame_count=checks.whole(count, "frame_count"))
        self.connection.call("look_at", request)
