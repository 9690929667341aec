"""Which elements of a structure of beams are one piece: its members, as laths."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import checks
from ..errors import LimberError, invalid
from ..laths import UNITS, Hole, Lath, Laths, crossed, drilled, runs
from .surfaces import section_axes, turned

if TYPE_CHECKING:
    from .session import BeamSession
    from .solutions import BeamSolution

STRAIGHT = 15.0  # turn at a node up to which two elements are one member [degree]


def of(session: "BeamSession", unit: str, overhang: float | None, straight: float, hole: float | None,
       edge_distance: float) -> Laths:
    """Members as drawn, with the stresses of the newest equilibrium."""
    checks.one_of(unit, UNITS, "unit")
    if not 0 <= checks.real(straight, "straight") <= 180:
        raise invalid("straight", f"straight must be in [0, 180] degrees, is {straight}")
    solution, scene = session.solution(), session.scene()
    structure = scene.beams.structure
    if not len(structure.elements):
        raise LimberError("FAILED_PRECONDITION", "this structure has no elements")
    nodes = np.array([[node.position.x, node.position.y, node.position.z] for node in structure.nodes])
    pairs = np.array([[element.start, element.finish] for element in structure.elements])
    kinds = [(element.section, element.kind) for element in structure.elements]
    scale = 1.0 / UNITS[unit]
    drawn = np.linalg.norm(nodes[pairs[:, 1]] - nodes[pairs[:, 0]], axis=1)
    rests = np.array([element.rest_length or length for element, length in zip(structure.elements, drawn)]) * scale
    made = []
    for number, (elements, at_nodes) in enumerate(members(nodes, pairs, kinds, straight)):
        section = structure.sections[kinds[elements[0]][0]]
        width, height, words = _size(section, scale)
        at = np.concatenate([[0.0], np.cumsum(rests[list(elements)])])
        bent = _bent(elements, at_nodes, structure, pairs, solution)
        holes = tuple(Hole(int(node), float(where), (), float("nan"), side / scale, normal / scale, float("nan"))
                      for node, where, (side, normal) in zip(at_nodes, at, bent))
        made.append(Lath(number=number, parts=elements, length=float(at[-1]), cuts=tuple(at.tolist()),
                         widths=(width,) * len(elements), heights=(height,) * len(elements), holes=holes,
                         closed=at_nodes[0] == at_nodes[-1], largest_stress=float(solution.stresses[list(elements)].max()),
                         section=words))
    joined, diameter, apart = drilled(_joined(made, solution.positions), overhang, hole, edge_distance)
    sections = {lath.section for lath in made}
    return Laths(name=scene.name, unit=unit, section=sections.pop() if len(sections) == 1 else "", laths=joined,
                 youngs_modulus=structure.sections[0].young, hole=diameter, edge_distance=apart,
                 revision=session.status().revision, converged=solution.converged)


def members(nodes: np.ndarray, pairs: np.ndarray, kinds: "list[Any]",
            straight: float) -> "list[tuple[tuple[int, ...], list[int]]]":
    """Elements in order with the nodes along them: at each node the straightest pairs of one section go on."""
    ends: "dict[int, list[tuple[int, int]]]" = {}
    for e, (start, finish) in enumerate(pairs):
        ends.setdefault(int(start), []).append((e, 0))
        ends.setdefault(int(finish), []).append((e, 1))
    follows: "dict[tuple[int, int], tuple[int, int]]" = {}
    for node, meeting in ends.items():
        away = {(e, end): _unit(nodes[pairs[e, 1 - end]] - nodes[node]) for e, end in meeting}
        turns = sorted((float(np.degrees(np.arccos(np.clip(-away[a] @ away[b], -1, 1)))), a, b)
                       for i, a in enumerate(meeting) for b in meeting[i + 1:] if kinds[a[0]] == kinds[b[0]])
        for turn, a, b in turns:
            if turn <= straight and a not in follows and b not in follows:
                follows[a], follows[b] = b, a
    return [(tuple(element for element, _ in run),
             [int(pairs[run[0][0], run[0][1]])] + [int(pairs[element, 1 - end]) for element, end in run])
            for run, _ in runs(len(pairs), follows)]


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / max(float(np.linalg.norm(vector)), 1e-300)


def _size(section: Any, scale: float) -> "tuple[float, float, str]":
    """Width, height and words."""
    if section.HasField("tube"):
        outer, inner = 2 * section.tube.outer_radius * scale, 2 * section.tube.inner_radius * scale
        return outer, outer, f"tube {outer:.6g} x {inner:.6g}" if inner else f"rod {outer:.6g}"
    width, height = section.rectangle.width * scale, section.rectangle.height * scale
    return width, height, f"rectangle {width:.6g} x {height:.6g}"


def _bent(elements: "tuple[int, ...]", at_nodes: "list[int]", structure: Any, pairs: np.ndarray,
          solution: "BeamSolution") -> "list[tuple[float, float]]":
    """Curvature at each node of a member [1/m], to its side and towards its normal; NaN at its ends. It is that of the circle
    through the node and those before and behind it."""
    third = section_axes(structure)[2]
    made = [(float("nan"), float("nan"))]
    points = solution.positions[at_nodes]
    for i in range(1, len(at_nodes) - 1):
        before, after = points[i] - points[i - 1], points[i + 1] - points[i]
        lengths = np.linalg.norm(before), np.linalg.norm(after)
        along = _unit(before / lengths[0] + after / lengths[1])
        bend = (after / lengths[1] - before / lengths[0]) / ((lengths[0] + lengths[1]) / 2)
        normal = turned(solution.rotations[None, at_nodes[i]:at_nodes[i] + 1], third[elements[i], None])[0, 0]
        normal = _unit(normal - (normal @ along) * along)
        made.append((float(bend @ np.cross(normal, along)), float(bend @ normal)))
    return made + [(float("nan"), float("nan"))]


def _joined(made: "list[Lath]", positions: np.ndarray) -> "tuple[Lath, ...]":
    """Holes are where other members meet, a member's other nodes are none; their angle is the smallest between its direction and
    theirs, in [0, 90]."""
    laths = crossed(made)
    directions = {(lath.number, hole.joint): _direction(lath, i, positions) for lath in laths for i, hole in enumerate(lath.holes)}

    def angle(lath: Lath, hole: Hole) -> float:
        own = directions[lath.number, hole.joint]
        cosines = [abs(own @ directions[other, hole.joint]) for other in hole.crosses]
        return float(np.degrees(np.arccos(min(max(cosines), 1.0))))

    return tuple(replace(lath, holes=tuple(replace(hole, angle=angle(lath, hole)) for hole in lath.holes if hole.crosses))
                 for lath in laths)


def _direction(lath: Lath, i: int, positions: np.ndarray) -> np.ndarray:
    """Direction of a member at one of its nodes, all of which are holes still."""
    at = [hole.joint for hole in lath.holes]
    edges = [_unit(positions[at[k + 1]] - positions[at[k]]) for k in (i - 1, i) if 0 <= k < len(at) - 1]
    return _unit(np.sum(edges, axis=0))
