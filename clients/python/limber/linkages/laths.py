"""Segments of a linkage that form one lath, and the places of its holes and bends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import checks
from ..errors import LimberError
from ..laths import UNITS, Hole, Lath, Laths, crossed, drilled
from . import sections, solutions, statics

if TYPE_CHECKING:
    from .session import LinkageSession
    from .shapes import Rod
    from .solutions import LinkageSolution


def of(session: "LinkageSession", unit: str, overhang: float | None, hole: float | None, edge_distance: float) -> Laths:
    """Laths of the newest final shape."""
    checks.one_of(unit, UNITS, "unit")
    solution = solutions.of(session)
    if not len(solution.lengths):
        raise LimberError("FAILED_PRECONDITION", "this linkage has no segments")
    scale = solution.length_unit_in_metres / UNITS[unit]
    scene = session.scene()
    extent = np.ptp(session.geometry().outline, axis=0) * scale
    bare = [_lath(number, rod, solution, extent, scale) for number, rod in enumerate(solution.rods)]
    made, diameter, apart = drilled(bare, overhang, hole, edge_distance)
    material = scene.linkage.material
    return Laths(name=scene.name, unit=unit, section=sections.describe(scene.linkage.section, scale),
                 laths=crossed(made), youngs_modulus=material.youngs_modulus, hole=diameter, edge_distance=apart,
                 revision=solution.revision, converged=solution.converged)


def _lath(number: int, rod: "Rod", solution: "LinkageSolution", extent: np.ndarray, scale: float) -> Lath:
    """From its first joint or free end to its last."""
    segments = rod.segments
    ends = [solution.joints_of_segment[s][:: -1 if reversed_ else 1] for s, reversed_ in zip(segments, rod.reversed)]
    joints = [int(ends[0][0])] + [int(pair[1]) for pair in ends]
    at = np.concatenate([[0.0], np.cumsum(solution.rest_lengths[list(segments)] * scale)])
    holes = []
    for i, joint in enumerate(joints):
        if joint >= 0:
            beside = [(k, end) for k, end in ((i - 1, 1), (i, 0)) if 0 <= k < len(segments)]
            bends = np.mean([_bend(solution, segments[k], not rod.reversed[k], end, joint) for k, end in beside], axis=0)
            holes.append(Hole(joint=joint, at=float(at[i]), crosses=(), angle=float(solution.angles[joint]),
                              curvature_side=bends[0] / scale, curvature_normal=bends[1] / scale,
                              twist_rate=bends[2] / scale))
    scales = solution.section_scales[list(segments)]
    stress = solution.stresses[list(segments)].max()
    return Lath(number=number, parts=segments, length=float(at[-1]), cuts=tuple(at.tolist()),
                widths=tuple((extent[0] * scales).tolist()), heights=tuple((extent[1] * scales).tolist()),
                holes=tuple(holes), closed=rod.closed, largest_stress=float(stress))


def _bend(solution: "LinkageSolution", segment: int, forward: bool, end: int, joint: int) -> np.ndarray:
    """Curvature towards the side and towards the normal of the joint, and twist, at an end of a walked segment."""
    stations = solution.stations(segment)
    t, d1, d2 = statics.frames(solution.points[stations], solution.directors[stations])
    i = -1 if (end == 1) == forward else 0
    curvature = solution.curvatures[stations][i]
    vector = curvature[0] * d1[i] + curvature[1] * d2[i]
    normal = solution.normals[joint]
    side = np.cross(normal, t[i] if forward else -t[i])
    return np.array([vector @ side, vector @ normal, solution.twist_rates[stations][i]])

