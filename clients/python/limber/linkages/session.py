"""Sessions of rod linkages, which keep them in equilibrium."""

from __future__ import annotations

from typing import Any, Sequence

import numpy as np

from .. import arrays, checks
from ..edits import vector
from ..errors import LimberError, invalid
from ..laths import EDGE_DISTANCE, Laths
from ..messages import scene as messages
from ..messages import service
from ..moving import PATH_RATE, MovingPoints, MovingSurface
from ..open_session import OpenSession, Receipt
from ..pictures import Coloured, of_vertices
from ..player import Played
from . import goals, laths, playing, solutions
from .designs import Design
from .goals import Placement
from .results import LinkageResult
from .shapes import LinkageGeometry, Shape
from .solutions import LinkageSolution

HELD = {"motion": messages.HELD_MOTION, "angle": messages.HELD_ANGLE, "both": messages.HELD_MOTION_AND_ANGLE}
STIFFNESS = 1000.0  # of the springs to targets where none is given [N/m]


class Target:
    """A spring from a point of the linkage to a point in space, as this client last knew it."""

    def __init__(self, session: "LinkageSession", message: "messages.LinkageTarget"):
        self.session = session
        self.message = message

    @property
    def id(self) -> int:
        return self.message.id

    @property
    def position(self) -> tuple[float, float, float]:
        at = self.message.position
        return (at.x, at.y, at.z)

    def move(self, position: Sequence[float]) -> Receipt:
        receipt = self.session.move(self, position)
        self.message.position.CopyFrom(vector(position, "position"))
        return receipt

    def remove(self) -> Receipt:
        return self.session.remove(self)

    def __repr__(self) -> str:
        return f"Target(id={self.id}, position={self.position}, stiffness={self.message.stiffness})"


class LinkageSession(OpenSession):
    """A session of a rod linkage. Made by Server.open() or Server.session(). Joints and segments count from 0; angles
    are in degrees."""

    FORMATS = {"vtp": service.EXPORT_FORMAT_VTP, "obj": service.EXPORT_FORMAT_OBJ, "json": service.EXPORT_FORMAT_JSON,
               "scene": service.EXPORT_FORMAT_SCENE}
    DEFAULT_FORMATS = ("vtp", "json")
    _geometry: LinkageGeometry | None = None

    def result_of(self, info: "service.ResultInfo") -> LinkageResult:
        return LinkageResult.from_message(info)

    def wait(self, revision: int | None = None, until: str = "final", timeout: float = 60.0) -> LinkageResult:
        """As of every session; warns once of a result on the way to which the linkage snapped (limber.SnapWarning)."""
        result = super().wait(revision, until, timeout)
        self.warn_of_snaps(result, [str(snap) for snap in result.snaps], stacklevel=2)
        return result

    def scene(self) -> "messages.Scene":
        """The scene as edited, without lines that were sent."""
        return self.connection.call("get_session", service.GetSessionRequest(session=self.reference, with_scene=True)).scene

    def conditions(self) -> "messages.LinkageConditions":
        """Pins, angles, targets and loads of every client, as of now."""
        return self.scene().linkage.conditions

    def targets(self) -> list[Target]:
        """Those of every client, as of now."""
        return [Target(self, message) for message in self.conditions().targets]

    # ---- edits ----

    def deploy(self, angle: float | None) -> Receipt:
        """The mean opening angle of all joints [degree]: the linkage goes there step by step. None: it is free."""
        wanted = None if angle is None else checks.real(angle, "angle")
        return self.edit([service.Edit(set_mean_angle=service.SetMeanAngle(angle_degrees=wanted))])

    def set_angle(self, joint: int, angle: float | None) -> Receipt:
        """An angle that one joint is to have from now on [degree]; None: it is free."""
        wanted = None if angle is None else checks.real(angle, "angle")
        change = service.SetJointAngle(joint=checks.whole(joint, "joint"), angle_degrees=wanted)
        return self.edit([service.Edit(set_joint_angle=change)])

    def pin(self, joint: int, held: str = "both", position: Sequence[float] | None = None) -> Receipt:
        """Holds a joint: its "motion" (position and rotation), its "angle", or "both"; position: where to bring it."""
        pin = messages.JointPin(joint=checks.whole(joint, "joint"), held=HELD[checks.one_of(held, HELD, "held")])
        if position is not None:
            pin.position.CopyFrom(vector(position, "position"))
        return self.edit([service.Edit(pin_joint=service.PinJoint(pin=pin))])

    def release(self, joint: int) -> Receipt:
        """Takes the joint's pin away."""
        pin = messages.JointPin(joint=checks.whole(joint, "joint"), held=messages.HELD_NOTHING)
        return self.edit([service.Edit(pin_joint=service.PinJoint(pin=pin))])

    def attach(self, joint: int | None = None, *, segment: int | None = None, share: float = 0.5,
               position: Sequence[float], stiffness: float = STIFFNESS) -> Target:
        """A spring [N/m] from a joint, or from a point at a share of a segment's length, to a position."""
        if (joint is None) == (segment is None):
            raise invalid("joint", "give either a joint or a segment")
        target = messages.LinkageTarget(position=vector(position, "position"),
                                        stiffness=checks.real(stiffness, "stiffness"))
        if segment is None:
            target.joint = checks.whole(joint, "joint")
        else:
            target.segment.segment = checks.whole(segment, "segment")
            target.segment.share = checks.real(share, "share")
        receipt = self.edit([service.Edit(add_target=service.AddTarget(target=target))])
        target.id = receipt.target_ids[0]
        return Target(self, target)

    def move(self, target: "Target | int", position: Sequence[float]) -> Receipt:
        change = service.MoveTarget(id=_id(target), position=vector(position, "position"))
        return self.edit([service.Edit(move_target=change)])

    def remove(self, target: "Target | int") -> Receipt:
        return self.edit([service.Edit(remove_target=service.RemoveTarget(id=_id(target)))])

    def load(self, joint: int, *, force: Sequence[float] = (0, 0, 0), moment: Sequence[float] = (0, 0, 0),
             torque: float = 0.0) -> Receipt:
        """Replaces the loads of a joint: a force [N], a moment [N m], a torque that opens it [N m]; nothing: no load."""
        load = messages.JointLoad(joint=checks.whole(joint, "joint"), force=vector(force, "force"),
                                  moment=vector(moment, "moment"), torque=checks.real(torque, "torque"))
        return self.edit([service.Edit(set_joint_load=service.SetJointLoad(load=load))])

    def gravity(self, gravity: Sequence[float]) -> Receipt:
        """[m/s^2]"""
        return self.edit([service.Edit(set_gravity=service.SetGravity(gravity=vector(gravity, "gravity")))])

    def set_lengths(self, lengths: Any) -> Receipt:
        """Rest lengths of all segments [length unit]; none ([]): those of the scene."""
        change = service.SetSegmentLengths(lengths=checks.numeric(lengths, "lengths").ravel())
        return self.edit([service.Edit(set_segment_lengths=change)])

    def lengths(self) -> np.ndarray:
        """Rest lengths of segments as they were set or designed [length unit]; empty: those of the scene."""
        return np.array(self.conditions().segment_lengths)

    def set_edge_lengths(self, lengths: Any) -> Receipt:
        """Rest lengths of all edges [length unit], in place of those of segments: first the edges within each segment,
        then those across joints, rod A's and rod B's. None ([]): those of the scene."""
        change = service.SetEdgeLengths(lengths=checks.numeric(lengths, "lengths").ravel())
        return self.edit([service.Edit(set_edge_lengths=change)])

    def edge_lengths(self) -> np.ndarray:
        """As they were set or designed [length unit]; empty: those of segments say them."""
        return np.array(self.conditions().edge_lengths)

    def set_section_scales(self, scales: Any) -> Receipt:
        """Scale of each segment's section in both directions. None ([]): 1."""
        change = service.SetSectionScales(scales=checks.numeric(scales, "scales").ravel())
        return self.edit([service.Edit(set_section_scales=change)])

    def section_scales(self) -> np.ndarray:
        """As they were set or designed; empty: all 1."""
        return np.array(self.conditions().section_scales)

    # ---- designs ----

    def design(self, surface: Any = None, targets: Any = None, *, flat_share: float | None = None,
               distance_weight: float | None = None, surface_weight: float | None = None,
               translation: Sequence[float] | None = None, rotation: Sequence[float] | None = None,
               scale: float | None = None, shortest: float | None = None, longest: float | None = None,
               flat_height: float | None = None, smallest_angle: float | None = None,
               max_iterations: int | None = None, shortest_lengths: Any = None, longest_lengths: Any = None,
               joint_weights: Any = None, lengths: str | None = None, sections: str | None = None,
               thinnest: float | None = None, thickest: float | None = None, thinnest_sections: Any = None,
               thickest_sections: Any = None, guard: str | None = None, fitted_points: Any = None,
               flat_angle: float | None = None, placement: "Placement | None" = None,
               least_cover: float | None = None) -> Design:
        """Begins a search for rest lengths with which the shape without angles, or that at a mean angle, lies flat. The shape
        that pins and angles give now should be near to a surface or targets, at little stress. limber.v1.DesignGoal has the
        objective.

        surface: an .obj, .ply, .stl, .off or .glb file, (vertices, triangles), points in rows (m x n x 3) or in no order (n x 3;
        a height field is laid through them). It is placed by scale, rotation (axis times angle [degree]) and translation.
        `targets`: {joint: position} or {joint: (position, weight)}, or positions of all joints. `shortest`, `longest`: bounds of
        rest lengths, as shares of those of the start. `flat_height`: allowed root mean square height of the flat shape, as a
        share of its extent. `smallest_angle`: bound on its opening angles [degree], a tenth of the start's if that lies open.
        `shortest_lengths`, `longest_lengths`: bounds of each segment in place of the shares [length unit]. `joint_weights`: of
        each joint's distance to the surface. `lengths`: the variables, lengths of "segments" (default) or "edges", or "kept".
        `sections`: "segments" varies the scale of each segment's section (default "kept"), between thinnest and thickest, or
        thinnest_sections and thickest_sections one by one. `guard`: against buckling of the flat shape, "when_needed" (default),
        "from_start" or "never". `fitted_points`: of the surface, one for each joint: it is put where these are nearest to the
        joints. `flat_angle`: mean opening angle at which the flat shape is held [degree]; by default it is not held. `placement`:
        in place of scale, rotation and translation, as info.placement of an earlier design. `least_cover`: share of the area of
        the start's cells (at most the surface's) that the design keeps (0.9). Options that are not given have the server's
        default.

        A design that ends by itself with flat_height, smallest_angle and least_cover kept is taken: a revision that undo() takes
        back. Until it has ended, edits are refused.
        """
        request = goals.request(self.id, self.joint_count, surface=surface, targets=targets, flat_share=flat_share,
                                  distance_weight=distance_weight, surface_weight=surface_weight,
                                  translation=translation, rotation=rotation, scale=scale, shortest=shortest, longest=longest,
                                  flat_height=flat_height, smallest_angle=smallest_angle, max_iterations=max_iterations,
                                  shortest_lengths=shortest_lengths, longest_lengths=longest_lengths,
                                  joint_weights=joint_weights, lengths=lengths, sections=sections,
                                  thinnest=thinnest, thickest=thickest, thinnest_sections=thinnest_sections,
                                  thickest_sections=thickest_sections, guard=guard, fitted_points=fitted_points,
                                  flat_angle=flat_angle, placement=placement, least_cover=least_cover)
        response = self.connection.call("start_design", request, timeout=max(60.0, self.connection.timeout))
        return Design(self, response.job)

    def current_design(self) -> Design:
        """The newest one, begun by any client."""
        design = Design(self)
        design.job = design.info().job
        return design

    # ---- shapes ----

    def joint_count(self) -> int:
        """Joints have the numbers from 0 to one less."""
        return len(self.geometry().vertex_of_joint)

    def geometry(self) -> LinkageGeometry:
        """Geometry of the newest shape; fetched again if the linkage was cut into more edges."""
        known = self._geometry.basis_hash if self._geometry is not None else ""
        return self._fetch_geometry(service.GetGeometryRequest(session=self.reference, known_basis_hash=known))

    def geometry_for(self, frames: "service.Frames") -> LinkageGeometry | None:
        if frames.encoding != service.ENCODING_COORDINATES:
            return None
        if self._geometry is not None and self._geometry.basis_hash == frames.basis_hash:
            return self._geometry
        return self._fetch_geometry(service.GetGeometryRequest(session=self.reference, basis_hash=frames.basis_hash))

    def _fetch_geometry(self, request: "service.GetGeometryRequest") -> LinkageGeometry:
        message = self.connection.call("get_geometry", request, timeout=max(60.0, self.connection.timeout))
        if self._geometry is None or self._geometry.basis_hash != message.basis_hash:
            self._geometry = LinkageGeometry.from_message(message)
        return self._geometry

    def shapes(self, first: int = 0, count: int = 0, final: bool = False) -> list[Shape]:
        """Centrelines, directors and angles of the newest result: the equilibria along the path, the shape itself last."""
        frames = self.raw_frames(first, count, final=final)
        return self.geometry_for(frames).shapes(arrays.to_numpy(frames.data, "frames"))

    def shape(self, final: bool = False) -> Shape:
        """The shape of the newest result."""
        return self.shapes(final=final)[-1]

    def moving_surface(self, drawn: "tuple[np.ndarray, np.ndarray] | None" = None) -> MovingSurface:
        """The swept surface of its rods."""
        if drawn is not None:
            raise invalid("surface", "a surface follows bodies alone")
        scene = self.scene()
        return MovingSurface(scene.name or self.id, self.geometry().surface, self.frames(), PATH_RATE,
                             scene.length_unit_in_metres)

    def played(self, tolerance: float, drawn: "tuple[np.ndarray, np.ndarray] | None" = None) -> Played:
        """Centrelines and directors, of which the player sweeps the rods."""
        return playing.played(self, drawn)

    COLOURS = ("none", "stress", "utilisation")

    def coloured(self, colour: str, frame: int, yield_stress: float | None = None) -> Coloured:
        """The shape itself: the forces of the equilibria before it are not known here."""
        if frame != -1 and colour != "none":
            raise invalid("frame", "of a linkage the last frame alone is coloured")
        frames, faces = self.frames(), self.geometry().surface
        if not -len(frames) <= checks.real(frame, "frame") < len(frames):
            raise LimberError("OUT_OF_RANGE", f"frame {frame}: there are {len(frames)}, from 0", "frame")
        if colour == "none":
            return Coloured(faces, frames[frame], np.zeros(0), "")
        if colour == "utilisation" and yield_stress is None:
            raise invalid("yield_stress", "the utilisation of a linkage is that of a yield_stress [Pa], which scenes do not have")
        solution = self.solution()
        bound = np.where(np.isfinite(solution.von_mises_stresses), solution.von_mises_stresses,
                         np.abs(solution.normal_stresses).max(axis=1))
        values = of_vertices(faces, np.repeat(bound, len(self.geometry().outline)))
        if colour == "stress":
            return Coloured(faces, frames[frame], values, "von Mises stress [Pa]")
        return Coloured(faces, frames[frame], values / yield_stress, "utilisation")

    def moving_points(self) -> MovingPoints:
        """All joints."""
        joints = np.stack([shape.joints for shape in self.shapes()])
        return MovingPoints("joint", range(joints.shape[1]), joints, PATH_RATE)

    def solution(self, yield_stress: float | None = None) -> LinkageSolution:
        """Reactions, forces, moments and stresses of the newest equilibrium. yield_stress: [Pa], for utilisations."""
        return solutions.of(self, yield_stress)

    def laths(self, unit: str = "mm", overhang: float | None = None, *, hole: float | None = None,
              edge_distance: float = EDGE_DISTANCE) -> Laths:
        """Cutting plan: the rods with their holes, and their curvatures in the newest equilibrium.

        unit: of all lengths, "mm", "cm", "m" or "in". `hole`: diameter of all holes [unit], a fifth of the narrowest lath's width
        by default, at most half of it. `overhang`: of a lath beyond the middles of its first and last hole [unit], edge_distance
        diameters by default; ends that are drawn longer stay so.
        """
        return laths.of(self, unit, overhang, hole, edge_distance)


def _id(target: Any) -> int:
    if isinstance(target, Target):
        return target.id
    return checks.whole(target, "id", most=2 ** 64 - 1)
