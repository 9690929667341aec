"""Goals of designs of rod linkages: surfaces and their placement, targets, variables and bounds."""

from __future__ import annotations

import os
from dataclasses import dataclass
from inspect import Parameter, signature
from typing import Any, Callable, Mapping, Sequence

import numpy as np

from .. import arrays, checks
from ..edits import vector
from ..errors import invalid
from ..files import mesh_file
from ..messages import design as messages

LENGTHS = {messages.DESIGN_LENGTHS_SEGMENTS: "segments", messages.DESIGN_LENGTHS_EDGES: "edges",
           messages.DESIGN_LENGTHS_KEPT: "kept"}
SECTIONS = {messages.DESIGN_SECTIONS_KEPT: "kept", messages.DESIGN_SECTIONS_SEGMENTS: "segments"}
GUARDS = {messages.DESIGN_GUARD_WHEN_NEEDED: "when_needed", messages.DESIGN_GUARD_FROM_START: "from_start",
          messages.DESIGN_GUARD_NEVER: "never"}


@dataclass(frozen=True)
class Placement:
    """Placement of a design's surface: turned, then scaled, then moved."""

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
        turn, shift = placed.rotation_degrees, placed.translation
        return Placement((turn.x, turn.y, turn.z), placed.scale if placed.HasField("scale") else 1.0,
                         (shift.x, shift.y, shift.z))


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
                                       position=vector(parts[0] if weighed else parts, name))
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
    """A file (.obj, .ply, .stl, .off, .glb), (vertices, triangles), points in rows m x n x 3, or points n x 3 in no order."""
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
        placement.translation.CopyFrom(vector(translation, "translation"))
    if rotation is not None:
        placement.rotation_degrees.CopyFrom(vector(rotation, "rotation"))
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
    set_given(made.goal, weights)
    set_given(made, {"shortest": shortest, "longest": longest, "flat_height": flat_height,
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
    """Keyword options of one call, sorted by the two calls that take them: of the scene, and of the design."""
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


def set_given(message: Any, values: "dict[str, float | None]") -> None:
    for name, value in values.items():
        if value is not None:
            setattr(message, name, checks.real(value, name))
