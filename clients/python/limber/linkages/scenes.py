"""Scenes of rod linkages."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Mapping

import numpy as np

from .. import arrays, checks
from ..errors import invalid
from ..files import mesh_file
from ..messages import scene as messages

STIFF_AXES = {"as_given": messages.STIFF_AXIS_AS_GIVEN, "d1": messages.STIFF_AXIS_D1, "d2": messages.STIFF_AXIS_D2}
BENDING = {"material_frames": messages.ROD_BENDING_MATERIAL_FRAMES,
           "averaged_frames": messages.ROD_BENDING_AVERAGED_FRAMES,
           "turning_angle": messages.ROD_BENDING_TURNING_ANGLE}
REST_LENGTHS = {"as_drawn": messages.REST_LENGTHS_AS_DRAWN, "least_stress": messages.REST_LENGTHS_LEAST_STRESS}


def linkage_scene(vertices: Any, edges: Any = None, *, section: Mapping[str, Any], name: str = "",
                  edges_per_segment: int | None = None, stiff_axis: str = "as_given", bending: str = "turning_angle",
                  rest_lengths: str = "as_drawn", length_unit_in_metres: float | None = None,
                  youngs_modulus: float | None = None, poissons_ratio: float | None = None,
                  density: float | None = None, tolerance: float | None = None, normals: Any = None) -> "messages.Scene":
    """A scene of a rod linkage: vertices (n x 3, length unit) and edges (m x 2, vertex ids from 0), or the path of an
    .obj file with lines.

    section: the shape of the rods and its dimensions, e.g. {"rectangle": (width, height)} or {"tube": {"diameter": 0.02,
    "wall_thickness": 0.002}}: rectangle, ellipse, i, l, plus, tube; {"profile": corners} takes a closed polygon. `stiff_axis`:
    "as_given" (a width lies in the surface, a height stands on it), "d1" (the stiffer axis lies in the surface: bending sideways
    is the stiffer) or "d2". `normals`: n x 3, of the surface at the vertices. `bending`: "material_frames", "averaged_frames" or
    "turning_angle". `rest_lengths`: "as_drawn", or "least_stress": those for which the linkage as drawn has least elastic energy.
    `tolerance`: bound of position errors by discretisation, as a share of the linkage's size; without edges_per_segment, as many
    are chosen as that takes. Options that are not given have the server's default.
    """
    scene = messages.Scene(name=checks.text(name, "name"))
    linkage = scene.linkage
    if edges is None:
        linkage.lines.file.CopyFrom(mesh_file(checks.path(vertices, "vertices"), field="linkage.lines.path"))
        scene.name = scene.name or Path(os.fspath(vertices)).stem
    else:
        points = checks.numeric(vertices, "linkage.lines.arrays.vertices")
        pairs = checks.numeric(edges, "linkage.lines.arrays.edges")
        linkage.lines.arrays.vertices.CopyFrom(arrays.to_message(points, np.float64))
        linkage.lines.arrays.edges.CopyFrom(arrays.to_message(pairs, np.int32))
    if normals is not None:
        linkage.normals.CopyFrom(arrays.to_message(checks.numeric(normals, "linkage.normals"), np.float64))
    put_section(section, linkage.section)
    if edges_per_segment is not None:
        linkage.edges_per_segment = checks.whole(edges_per_segment, "edges_per_segment")
    if tolerance is not None:
        linkage.tolerance = checks.real(tolerance, "tolerance")
    linkage.stiff_axis = STIFF_AXES[checks.one_of(stiff_axis, STIFF_AXES, "stiff_axis")]
    linkage.bending = BENDING[checks.one_of(bending, BENDING, "bending")]
    linkage.rest_lengths = REST_LENGTHS[checks.one_of(rest_lengths, REST_LENGTHS, "rest_lengths")]
    if length_unit_in_metres is not None:
        scene.length_unit_in_metres = checks.real(length_unit_in_metres, "length_unit_in_metres")
    material = {"youngs_modulus": youngs_modulus, "poissons_ratio": poissons_ratio, "density": density}
    for key, value in material.items():
        if value is not None:
            setattr(linkage.material, key, checks.real(value, key))
    return scene


def put_section(section: Any, message: "messages.RodSection") -> None:
    """The shape of rods with its dimensions, as linkage_scene() takes it."""
    shapes = message.DESCRIPTOR.fields_by_name
    if not isinstance(section, Mapping) or len(section) != 1:
        raise invalid("section", f"section takes one shape with its dimensions, e.g. {{'rectangle': (0.02, 0.005)}}, "
                                 f"not {section!r}")
    (shape, dimensions), = section.items()
    made = getattr(message, checks.one_of(shape, shapes, "section"))
    made.SetInParent()
    if shape == "profile":
        made.outer.CopyFrom(arrays.to_message(checks.numeric(dimensions, "section.profile"), np.float64))
        return
    names = [field.name for field in made.DESCRIPTOR.fields]
    if not isinstance(dimensions, Mapping):
        values = list(checks.several(dimensions, f"section.{shape}"))
        if len(values) != len(names):
            raise invalid(f"section.{shape}", f"{shape} takes {', '.join(names)}, not {dimensions!r}")
        dimensions = dict(zip(names, values))
    for key, value in dimensions.items():
        setattr(made, checks.one_of(key, names, f"section.{shape}"), checks.real(value, f"section.{shape}.{key}"))


def upload_files(scene: "messages.Scene", folder: Path) -> None:
    """The bytes of the file of lines in place of its path."""
    lines = scene.linkage.lines
    if lines.WhichOneof("source") == "path":
        lines.file.CopyFrom(mesh_file(folder / lines.path, field="linkage.lines.path"))
