"""Which segments of a linkage are one lath, and what is drilled and bent where."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .. import checks
from ..errors import LimberError, invalid
from ..laths import UNITS, Hole, Lath, Laths, crossed, runs
from . import sections, solutions, statics

if TYPE_CHECKING:
    from .session import LinkageSession
    from .shapes import LinkageGeometry, Shape
    from .solutions import LinkageSolution


def of(session: "LinkageSession", unit: str, overhang: float) -> Laths:
    """Of the newest final shape."""
    checks.one_of(unit, UNITS, "unit")
    if not 0 <= checks.real(overhang, "overhang") < np.inf:
        raise invalid("overhang", f"overhang must be >= 0, is {overhang}")
    solution = solutions.of(session)
    if not len(solution.lengths):
        raise LimberError("FAILED_PRECONDITION", "this linkage has no segments")
    rods = chains(solution.joints_of_segment, session.geometry(), session.shape(final=True))
    scale = solution.length_unit_in_metres / UNITS[unit]
    scene = session.scene()
    extent = np.ptp(session.geometry().outline, axis=0) * scale
    made = [_lath(number, run, solution, extent, scale, overhang) for number, run in enumerate(rods)]
    material = scene.linkage.material
    return Laths(name=scene.name, unit=unit, section=sections.describe(scene.linkage.section, scale),
                 laths=crossed(made), youngs_modulus=material.youngs_modulus, revision=solution.revision, converged=solution.converged)


@dataclass(frozen=True)
class Run:
    """Segments that are one piece, in order; forward: whether each is walked from its first end to its last."""

    segments: tuple[int, ...]
    forward: tuple[bool, ...]
    closed: bool


def chains(joints_of_segment: np.ndarray, geometry: "LinkageGeometry", shape: "Shape") -> list[Run]:
    """Two segments are one rod at a joint where they share the edge that lies across it."""
    edges: "dict[int, list[tuple[int, int, np.ndarray]]]" = {}
    for s, ends in enumerate(joints_of_segment):
        line = shape.centrelines[s]
        for end, joint in enumerate(ends):
            if joint >= 0:
                edges.setdefault(int(joint), []).append((s, end, line[:2] if end == 0 else line[:-3:-1]))
    follows: "dict[tuple[int, int], tuple[int, int]]" = {}
    for joined in edges.values():
        # Two rods cross at a joint, so that of 3 ends two are of one, of 4 two and two. Where a linkage is closed all lie
        # close together: those that are the same are the nearest.
        apart = sorted((float(np.abs(edge - other_edge[::-1]).max()), i, k) for i, (_, _, edge) in enumerate(joined)
                       for k, (_, _, other_edge) in enumerate(joined) if i < k)
        for _ in range(len(joined) - 2):
            _, i, k = next(pair for pair in apart if not {joined[pair[1]][:2], joined[pair[2]][:2]} & set(follows))
            one, other = joined[i][:2], joined[k][:2]
            follows[one], follows[other] = other, one
    return [Run(tuple(segment for segment, _ in run), tuple(entered == 0 for _, entered in run), closed)
            for run, closed in runs(len(joints_of_segment), follows)]


def _lath(number: int, run: Run, solution: "LinkageSolution", extent: np.ndarray, scale: float, overhang: float) -> Lath:
    ends = [solution.joints_of_segment[s][:: 1 if forward else -1] for s, forward in zip(run.segments, run.forward)]
    rests = [solution.rest_lengths[s] * scale for s in run.segments]
    joints = [int(ends[0][0])] + [int(pair[1]) for pair in ends]
    before, after = (overhang if joint >= 0 else 0.0 for joint in (joints[0], joints[-1]))
    at = before + np.concatenate([[0.0], np.cumsum(rests)])
    holes = []
    for i, joint in enumerate(joints):
        if joint >= 0:
            beside = [(k, end) for k, end in ((i - 1, 1), (i, 0)) if 0 <= k < len(run.segments)]
            bends = np.mean([_bend(solution, run.segments[k], run.forward[k], end, joint) for k, end in beside], axis=0)
            holes.append(Hole(joint=joint, at=float(at[i]), crosses=(), angle=float(solution.angles[joint]),
                              curvature_side=bends[0] / scale, curvature_normal=bends[1] / scale,
                              twist_rate=bends[2] / scale))
    scales = solution.section_scales[list(run.segments)]
    cuts = np.concatenate([[0.0], at[1:-1], [at[-1] + after]])
    stress = solution.stresses[list(run.segments)].max()
    return Lath(number=number, parts=run.segments, length=float(cuts[-1]), cuts=tuple(cuts.tolist()),
                widths=tuple((extent[0] * scales).tolist()), heights=tuple((extent[1] * scales).tolist()),
                holes=tuple(holes), closed=run.closed, largest_stress=float(stress))


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

