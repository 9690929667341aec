"""Designs of rod linkages: rest lengths that deploy towards a surface or targets, searched live."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Any, Callable, Iterator, Mapping, Sequence

import numpy as np

from . import arrays, checks, edits
from .errors import LimberError, from_message, invalid
from .mesh_files import mesh_file
from .messages import design as messages
from .messages import scene as scene_messages
from .progress import ProgressOption

if TYPE_CHECKING:
    from .linkages import LinkageSession

STATES = {messages.DESIGN_STATE_STARTING: "starting", messages.DESIGN_STATE_RUNNING: "running",
          messages.DESIGN_STATE_PAUSED: "paused", messages.DESIGN_STATE_ENDED: "ended"}
ENDS = {messages.DESIGN_END_UNSPECIFIED: "", messages.DESIGN_END_CONVERGED: "converged",
        messages.DESIGN_END_SETTLED: "settled", messages.DESIGN_END_INFEASIBLE: "infeasible",
        messages.DESIGN_END_STUCK: "stuck", messages.DESIGN_END_ITERATION_LIMIT: "iteration_limit",
        messages.DESIGN_END_STOPPED: "stopped", messages.DESIGN_END_FAILED: "failed"}


LENGTHS = {messages.DESIGN_LENGTHS_SEGMENTS: "segments", messages.DESIGN_LENGTHS_EDGES: "edges",
           messages.DESIGN_LENGTHS_KEPT: "kept"}
SECTIONS = {messages.DESIGN_SECTIONS_KEPT: "kept", messages.DESIGN_SECTIONS_SEGMENTS: "segments"}
GUARDS = {messages.DESIGN_GUARD_WHEN_NEEDED: "when_needed", messages.DESIGN_GUARD_FROM_START: "from_start",
          messages.DESIGN_GUARD_NEVER: "never"}


@dataclass(frozen=True)
class DesignTerms:
    """What a pair of shapes, the flat one and the deployed one, is worth."""

    objective: float        # unitless
    flat_energy: float      # [J]
    deployed_energy: float  # [J]
    target_rms: float       # of joints that have targets, to these [length unit]
    surface_rms: float      # of all joints, to the surface [length unit]
    flat_height: float      # of the flat shape's joints over their plane, as a share of the linkage's extent
    smallest_angle: float   # at most the smallest opening angle of the flat shape [degree]
    holds: bool             # all constraints are kept
    covered_area: float     # of the deployed shape's cells, at most the surface's [length unit^2]; 0 without a surface
    cover: float            # the same as a share of the start's

    @staticmethod
    def from_message(terms: "messages.DesignTerms") -> "DesignTerms":
        return DesignTerms(terms.objective, terms.flat_energy, terms.deployed_energy, terms.target_rms,
                           terms.surface_rms, terms.flat_height, terms.smallest_angle_degrees, terms.holds,
                           terms.covered_area, terms.cover)


@dataclass(frozen=True)
class Placement:
    """Where a design's surface is: turned, then scaled, then moved."""

    rotation: tuple[float, float, float]     # axis times angle [degree]
    scale: float
    translation: tuple[float, float, float]  # [length unit]

    def apply(self, points: Any) -> np.ndarray:
        """Points of the surface as it was given, ... x 3, to where it is."""
        points = checks.numeric(points, "points")
        turn = np.radians(self.rotation)
        angle = float(np.linalg.norm(turn))
        if angle > 0:
            axis = turn / angle
            points = (np.cos(angle) * points + np.sin(angle) * np.cross(axis, points)
                      + (1 - np.cos(angle)) * (points @ axis)[..., None] * axis)
        return self.scale * points + np.array(self.translation)

    @staticmethod
    def from_message(placed: "messages.SurfacePlacement") -> "Placement":
        vector = lambda v: (v.x, v.y, v.z)  # noqa: E731
        return Placement(vector(placed.rotation_degrees), placed.scale if placed.HasField("scale") else 1.0,
                         vector(placed.translation))


@dataclass(frozen=True)
class OtherOptimum:
    """An earlier design of the session for the same goal that ended elsewhere."""

    job: int
    terms: DesignTerms        # by the scales of the newer design: objectives can be compared
    size_difference: float    # largest, of a rest length or a section's scale, as a share
    flat_distance: float      # of joints between both flat shapes, root mean square [length unit]
    deployed_distance: float  # the same of the deployed ones

    @staticmethod
    def from_message(other: "messages.OtherOptimum") -> "OtherOptimum":
        return OtherOptimum(other.job, DesignTerms.from_message(other.terms), other.size_difference,
                            other.flat_distance, other.deployed_distance)


@dataclass(frozen=True)
class Erection:
    """How a linkage is opened from flat to the shape it was designed for: pushed out of its plane along the way."""

    mean_angle: float        # that it leads to [degree]
    push: dict[int, tuple[float, float, float]]  # forces at joints [N], removed at the end; {}: it opens by itself
    path: tuple[float, ...]  # mean angles from flat [degree]
    distance: float          # of the shape it leads to from the designed one, root mean square of joints [length unit]

    @staticmethod
    def from_message(erection: "scene_messages.LinkageErection") -> "Erection":
        return Erection(erection.mean_angle_degrees,
                        {load.joint: (load.force.x, load.force.y, load.force.z) for load in erection.push},
                        tuple(erection.path_degrees), erection.distance)


@dataclass(frozen=True)
class DesignInfo:
    """How a design stands."""

    state: str              # "starting", "running", "paused" or "ended"
    end: str                # "", "converged", "settled", "infeasible", "stuck", "iteration_limit", "stopped", "failed"
    iteration: int
    accepted: bool          # the trial of this iteration was taken
    start: DesignTerms
    now: DesignTerms
    best: DesignTerms       # that can be taken; counted anew when the goal changes
    best_iteration: int
    flat_height: float      # allowed
    weights: tuple[float, float, float]  # flat share, of distances, of the surface
    at_bound: tuple[int, ...]            # segments whose rest length is at a bound
    taken: int | None       # the revision that brought its best lengths
    message: str            # why it ended
    job: int
    lengths: str            # varied: "segments", "edges" or "kept"
    sections: str           # varied: "segments" or "kept"
    guard: str              # against buckling: "when_needed", "from_start" or "never"
    sections_at_bound: tuple[int, ...]
    refused: int            # trials that gained too little
    not_believed: int       # trials whose equilibria were lost, or lay on another branch
    flat_lost: int          # of these: the flat shape's, which had buckled
    guarded: bool           # the guard is up
    refusal: str            # why the last trial was not believed; "": it was
    other_optima: tuple[OtherOptimum, ...]  # of one that has ended by itself: earlier ones that ended elsewhere
    placement: Placement    # of the surface
    flat_angle: float | None  # mean angle that the flat shape is held at [degree]; None: nothing holds it
    least_cover: float      # required share of the start's area of cells
    erection: Erection | None  # how the best shape is opened from flat; None: not ended, or no way was found (message)

    @staticmethod
    def from_message(info: "messages.DesignInfo") -> "DesignInfo":
        terms = DesignTerms.from_message
        return DesignInfo(STATES.get(info.state, ""), ENDS.get(info.end, ""), info.iteration, info.accepted,
                          terms(info.start), terms(info.now), terms(info.best), info.best_iteration, info.flat_height,
                          (info.flat_share, info.distance_weight, info.surface_weight), tuple(info.at_bound),
                          info.taken_revision if info.HasField("taken_revision") else None, info.message, info.job,
                          LENGTHS.get(info.lengths, ""), SECTIONS.get(info.sections, ""), GUARDS.get(info.guard, ""),
                          tuple(info.sections_at_bound), info.refused, info.not_believed, info.flat_lost, info.guarded,
                          info.refusal, tuple(OtherOptimum.from_message(other) for other in info.other_optima),
                          Placement.from_message(info.placement),
                          info.flat_angle_degrees if info.HasField("flat_angle_degrees") else None, info.least_cover,
                          Erection.from_message(info.erection) if info.HasField("erection") else None)


def targets_of(targets: Any, field: str, joints: "Callable[[], int]") -> "list[messages.DesignTarget]":
    """{joint: position} or {joint: (position, weight)}, or positions of all joints (n x 3), so many as joints()."""
    if not isinstance(targets, Mapping):
        positions = checks.numeric(targets, field)
        if positions.ndim != 2 or positions.shape[1] != 3:
            raise invalid(field, f"{field} takes {{joint: position}}, or positions of all joints, n x 3")
        if len(positions) != joints():
            raise invalid(field, f"{field} has {len(positions)} positions for {joints()} joints: "
                                 f"take {{joint: position}} for some of them")
        targets = dict(enumerate(positions))
    made = []
    for joint, where in targets.items():
        name = f"{field}[{joint}]"
        parts = list(checks.several(where, name))
        weighed = len(parts) == 2
        target = messages.DesignTarget(joint=checks.whole(joint, f"{field} (joint)"),
                                       position=edits.vector(parts[0] if weighed else parts, name))
        if weighed:
            target.weight = checks.real(parts[1], f"{name} (weight)")
        made.append(target)
    return made


def surface_arrays(surface: Any, field: str) -> "tuple[np.ndarray, np.ndarray | None]":
    """Vertices and triangles of (vertices, triangles) or of points in rows, m x n x 3; points n x 3 have no
    triangles."""
    if isinstance(surface, tuple) and len(surface) == 2:
        vertices, triangles = (checks.numeric(part, field) for part in surface)
        return vertices, triangles
    points = checks.numeric(surface, field)
    if points.ndim != 3:
        return points, None
    at = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return points.reshape(-1, points.shape[2]), triangles


def surface_of(surface: Any, field: str) -> "messages.DesignSurface":
    """A file (.obj, .ply, .stl), (vertices, triangles), points in rows m x n x 3, or points n x 3 in no order."""
    if isinstance(surface, (str, os.PathLike)):
        return messages.DesignSurface(file=mesh_file(surface, field=field))
    vertices, triangles = surface_arrays(surface, field)
    if triangles is None:
        return messages.DesignSurface(points=arrays.to_message(vertices, np.float64))
    return messages.DesignSurface(triangles=messages.TriangleArrays(
        vertices=arrays.to_message(vertices, np.float64), triangles=arrays.to_message(triangles, np.int32)))


def placement_of(translation: Sequence[float] | None, rotation: Sequence[float] | None,
                 scale: float | None) -> "messages.SurfacePlacement | None":
    if translation is None and rotation is None and scale is None:
        return None
    placement = messages.SurfacePlacement()
    if translation is not None:
        placement.translation.CopyFrom(edits.vector(translation, "translation"))
    if rotation is not None:
        placement.rotation_degrees.CopyFrom(edits.vector(rotation, "rotation"))
    if scale is not None:
        placement.scale = checks.real(scale, "scale")
    return placement


def chosen_placement(placement: "Placement | None", translation: Sequence[float] | None,
                     rotation: Sequence[float] | None, scale: float | None) -> "messages.SurfacePlacement | None":
    if placement is None:
        return placement_of(translation, rotation, scale)
    if not isinstance(placement, Placement):
        raise invalid("placement", f"placement is a limber.Placement, as info.placement, not {placement!r}")
    if translation is not None or rotation is not None or scale is not None:
        raise invalid("placement", "give either a placement, or translation, rotation and scale")
    return placement_of(placement.translation, placement.rotation, placement.scale)


def request(session: str, joints: "Callable[[], int]", *, surface: Any, targets: Any, flat_share: float | None,
            distance_weight: float | None, surface_weight: float | None, translation: Sequence[float] | None, rotation: Sequence[float] | None,
            scale: float | None, shortest: float | None, longest: float | None, flat_height: float | None,
            smallest_angle: float | None, max_iterations: int | None, shortest_lengths: Any = None,
            longest_lengths: Any = None, joint_weights: Any = None, lengths: str | None = None,
            sections: str | None = None, thinnest: float | None = None, thickest: float | None = None,
            thinnest_sections: Any = None, thickest_sections: Any = None, guard: str | None = None,
            fitted_points: Any = None, flat_angle: float | None = None,
            placement: "Placement | None" = None, least_cover: float | None = None) -> "messages.StartDesignRequest":
    made = messages.StartDesignRequest(session=session)
    made.goal.SetInParent()
    if surface is not None:
        made.goal.surface.CopyFrom(surface_of(surface, "goal.surface"))
    if targets is not None:
        made.goal.targets.extend(targets_of(targets, "goal.targets", joints))
    place = chosen_placement(placement, translation, rotation, scale)
    if place is not None:
        made.goal.placement.CopyFrom(place)
    weights = {"flat_share": flat_share, "distance_weight": distance_weight, "surface_weight": surface_weight}
    _set_given(made.goal, weights)
    _set_given(made, {"shortest": shortest, "longest": longest, "flat_height": flat_height,
                      "smallest_angle_degrees": smallest_angle, "flat_angle_degrees": flat_angle,
                      "least_cover": least_cover, "thinnest": thinnest, "thickest": thickest})
    for name, names, chosen in (("lengths", LENGTHS, lengths), ("sections", SECTIONS, sections),
                                ("guard", GUARDS, guard)):
        if chosen is not None:
            setattr(made, name, _named(chosen, names, name))
    if fitted_points is not None:
        made.fitted_points.CopyFrom(arrays.to_message(checks.numeric(fitted_points, "fitted_points"), np.float64))
    for values, name, numbers in ((shortest_lengths, "shortest_lengths", made.shortest_lengths),
                                  (longest_lengths, "longest_lengths", made.longest_lengths),
                                  (thinnest_sections, "thinnest_sections", made.thinnest_sections),
                                  (thickest_sections, "thickest_sections", made.thickest_sections),
                                  (joint_weights, "joint_weights", made.goal.joint_surface_weights)):
        if values is not None:
            numbers.extend(_not_empty(checks.numeric(values, name), name).ravel())
    if max_iterations is not None:
        made.max_iterations = checks.whole(max_iterations, "max_iterations")
    return made


def _not_empty(values: np.ndarray, field: str) -> np.ndarray:
    """An empty array is none of bounds, and would be taken for that."""
    if values.size == 0:
        raise invalid(field, f"{field} is empty: leave it out where there is none")
    return values


def sorted_options(options: "Mapping[str, Any]", design: Any, of_scene: Callable[..., Any],
                   of_design: Callable[..., Any]) -> "tuple[dict[str, Any], dict[str, Any]]":
    """Keyword options of one call, told apart by the two calls that take them: of the scene, and of the design."""
    if design is not None and not isinstance(design, Mapping):
        raise invalid("design", f"design has options by name, as {{'max_iterations': 60}}, not {design!r}")
    known = {call: {name for name, parameter in signature(call).parameters.items()
                    if parameter.kind is Parameter.KEYWORD_ONLY} for call in (of_scene, of_design)}
    placed_by_grid = {"translation", "rotation", "scale", "fitted_points", "placement"}
    known[of_design] = (known[of_design] | {"targets"}) - placed_by_grid - {"flat_angle"}
    wanted = dict(design or {})
    for name in wanted:
        if name in placed_by_grid:
            raise invalid(f"design.{name}", "the surface is put where the grid fits")
        if name == "flat_angle":
            raise invalid("design.flat_angle", "it is the grid's: give it as flat_angle=")
        if name not in known[of_design]:
            raise invalid(f"design.{name}", f"there is no such option; a design has {', '.join(sorted(known[of_design]))}")
    scene = {}
    for name, value in options.items():
        if name in known[of_scene]:
            scene[name] = value
        elif name in known[of_design]:
            if name in wanted:
                raise invalid(name, f"is given twice: as {name}= and in design=")
            wanted[name] = value
        else:
            raise invalid(name, f"there is no such option; beside its own there are {', '.join(sorted(known[of_scene]))} "
                                f"of limber.linkage_scene and {', '.join(sorted(known[of_design]))} of a design")
    return scene, wanted


def _named(chosen: str, names: "dict[int, str]", field: str) -> int:
    for value, name in names.items():
        if name == chosen:
            return value
    raise invalid(field, f"{field} is one of {', '.join(names.values())}, not {chosen!r}")


def _set_given(message: Any, values: "dict[str, float | None]") -> None:
    for name, value in values.items():
        if value is not None:
            setattr(message, name, checks.real(value, name))


@dataclass(frozen=True)
class StartingGrid:
    """Two families of straight rods that lie flat and open to about a patch of surface: to begin a design with."""

    vertices: np.ndarray    # flat, in the plane z = 0, n x 3 [length unit]
    edges: np.ndarray       # m x 2
    deployed: np.ndarray    # the same vertices on the surface
    lengths: np.ndarray     # of the edges, flat [length unit]
    mean_angle: float       # at which rods cross on the surface [degree]
    misfit: float           # largest difference between a length and that on the surface, as a share
    push: np.ndarray        # forces along z at joints that open the grid to the surface's side of its plane, over Young's modulus
    remark: str             # what will stand in a design's way; "": nothing

    @property
    def columns(self) -> int:
        """Joints of a row; the joint of column c and row r is number r * columns + c."""
        return int(self.edges[self.edges[:, 0] == 0].max())

    @staticmethod
    def from_message(message: "messages.MakeStartingGridResponse") -> "StartingGrid":
        return StartingGrid(arrays.to_numpy(message.flat.vertices, "flat.vertices"),
                            arrays.to_numpy(message.flat.edges, "flat.edges"),
                            arrays.to_numpy(message.deployed.vertices, "deployed.vertices"),
                            np.array(message.segment_lengths), message.mean_angle_degrees, message.misfit,
                            np.array(message.push), message.remark)


def grid_request(surface: Any, columns: int | None, rows: int | None, flat_angle: float | None, margin: float | None,
                 translation: Sequence[float] | None, rotation: Sequence[float] | None,
                 scale: float | None, drive: float | None = None) -> "messages.MakeStartingGridRequest":
    made = messages.MakeStartingGridRequest(surface=surface_of(surface, "surface"))
    placement = placement_of(translation, rotation, scale)
    if placement is not None:
        made.placement.CopyFrom(placement)
    if columns is not None:
        made.columns = checks.whole(columns, "columns")
    if rows is not None:
        made.rows = checks.whole(rows, "rows")
    _set_given(made, {"flat_angle_degrees": flat_angle, "margin": margin, "drive": drive})
    return made


class Design:
    """The newest design of a session, whoever began it. Made by LinkageSession.design() and .current_design()."""

    def __init__(self, session: "LinkageSession", job: int = 0):
        self.session = session
        self.job = job

    def _get(self) -> "messages.GetDesignResponse":
        response = self.session.connection.call("get_design", messages.GetDesignRequest(session=self.session.reference))
        if not response.HasField("design"):
            raise LimberError("FAILED_PRECONDITION", f"session {self.session.id} has no design", "session")
        return response

    def info(self) -> DesignInfo:
        return DesignInfo.from_message(self._get().design)

    def best_lengths(self) -> np.ndarray:
        """Rest lengths of segments that take() would bring [length unit]; empty where there are none yet."""
        return np.array(self._get().best_lengths)

    def best_edge_lengths(self) -> np.ndarray:
        """The same of edges, where those are varied."""
        return np.array(self._get().best_edge_lengths)

    def best_section_scales(self) -> np.ndarray:
        """The same of sections, where those are varied: of each segment."""
        return np.array(self._get().best_section_scales)

    def change(self, *, surface: Any = None, targets: Any = None, flat_share: float | None = None,
               distance_weight: float | None = None, surface_weight: float | None = None,
               translation: Sequence[float] | None = None, rotation: Sequence[float] | None = None,
               scale: float | None = None, joint_weights: Any = None, placement: "Placement | None" = None) -> None:
        """Goes on towards another goal; what is not given stays. targets: in place of all there are. translation,
        rotation and scale: where the surface is put, all three in place of what they were; or a placement, as
        info().placement with some of it replaced (dataclasses.replace). joint_weights: of each
        joint's distance to the surface; [] makes them all 1 again."""
        made = messages.ChangeDesignRequest(session=self.session.reference)
        _set_given(made, {"flat_share": flat_share, "distance_weight": distance_weight,
                          "surface_weight": surface_weight})
        if targets is not None:
            made.targets.targets.extend(targets_of(targets, "targets", self.session.joint_count))
            made.targets.SetInParent()
        if surface is not None:
            made.surface.CopyFrom(surface_of(surface, "surface"))
        place = chosen_placement(placement, translation, rotation, scale)
        if place is not None:
            made.placement.CopyFrom(place)
        if joint_weights is not None:
            made.joint_surface_weights.weights.extend(checks.numeric(joint_weights, "joint_weights").ravel())
            made.joint_surface_weights.SetInParent()
        self.session.connection.call("change_design", made, timeout=max(60.0, self.session.connection.timeout))

    def pause(self) -> None:
        """When the step under way is done; edits stay refused."""
        self.session.connection.call("pause_design", messages.PauseDesignRequest(session=self.session.reference))

    def resume(self) -> None:
        self.session.connection.call("resume_design", messages.ResumeDesignRequest(session=self.session.reference))

    def stop(self, timeout: float = 60.0) -> None:
        """The session goes back to the shape it had, and takes edits again; the best so far can still be taken.

        timeout: how long the step under way may take to end [s] before LimberError TIMEOUT.
        """
        self.session.connection.call("stop_design", messages.StopDesignRequest(session=self.session.reference))
        self._wait_for_end(timeout)

    def _wait_for_end(self, timeout: float) -> None:
        given_up = time.monotonic() + timeout
        while self.info().state != "ended":
            if time.monotonic() > given_up:
                raise LimberError("TIMEOUT", f"the design was told to stop and has not ended for {timeout:g} s", "timeout")
            time.sleep(0.005)

    def take(self) -> int:
        """The best rest lengths become the session's: an edit, which undo() takes back. Its revision. A design under way
        ends: edits are taken again."""
        response = self.session.connection.call("take_design", messages.TakeDesignRequest(session=self.session.reference))
        self.session.revision = max(self.session.revision, response.revision)
        self._wait_for_end(60.0)
        return response.revision

    def steps(self, timeout: float | None = None) -> Iterator[DesignInfo]:
        """How it stands after every step that arrives (newest first where they come too fast), until it ends.

        timeout: longest silence [s] before LimberError TIMEOUT; None: as long as the server lives.
        """
        with self.session.stream(timeout=timeout) as stream:
            if self.info().state == "ended":
                return
            for frames in stream:
                if frames.result.design is not None:
                    yield frames.result.design
                elif frames.result.final and self.info().state == "ended":
                    return

    def wait(self, progress: ProgressOption = None, timeout: float = 3600.0) -> DesignInfo:
        """Until it has ended and the session shows what came of it. Raises what it failed with."""
        begun = time.monotonic()
        try:
            self.session.server.wait_job(self.info().job, progress, timeout)
        except LimberError as error:
            if error.code == "TIMEOUT":
                raise
        design = self._get().design
        if design.HasField("error"):
            raise from_message(design.error)
        info = DesignInfo.from_message(design)
        if info.taken is not None:
            self.session.revision = max(self.session.revision, info.taken)
            self.session.wait(info.taken, timeout=max(1.0, begun + timeout - time.monotonic()))
        return info

    def __repr__(self) -> str:
        return f"Design(of {self.session!r})"
