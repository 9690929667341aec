"""Beams as they are seen: their sections along their elements."""

from __future__ import annotations

import numpy as np

from ..messages import scene as messages

ROUND = 8  # corners of tubes


def section_axes(structure: "messages.BeamStructure") -> "tuple[np.ndarray, np.ndarray, np.ndarray]":
    """Axes 1, 2 and 3 of each element as drawn, elements x 3. Axis 3 points to the element's normal or the mean of its nodes',
    else to z, else to x."""
    nodes = np.array([[node.position.x, node.position.y, node.position.z] for node in structure.nodes])
    normals = np.array([[node.normal.x, node.normal.y, node.normal.z] if node.HasField("normal") else [0, 0, 1]
                        for node in structure.nodes], dtype=float)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    axes = np.zeros((3, len(structure.elements), 3))
    for e, element in enumerate(structure.elements):
        along = nodes[element.finish] - nodes[element.start]
        along = along / max(float(np.linalg.norm(along)), 1e-300)
        own = np.array([element.normal.x, element.normal.y, element.normal.z])
        for wish in ([own] if element.HasField("normal") else []) + [normals[element.start] + normals[element.finish],
                                                                     np.array([0.0, 0, 1]), np.array([1.0, 0, 0])]:
            third = wish - (wish @ along) * along
            if np.linalg.norm(third) > np.sin(np.radians(0.1)) * np.linalg.norm(wish):
                third = third / np.linalg.norm(third)
                break
        axes[:, e] = along, np.cross(third, along), third
    return axes[0], axes[1], axes[2]


def turned(rotations: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """frames x n x 3 from quaternions w, x, y, z (frames x n x 4) and vectors (n x 3)."""
    w, v = rotations[..., :1], rotations[..., 1:]
    across = np.cross(v, np.broadcast_to(vectors, v.shape))
    return vectors + 2 * (w * across + np.cross(v, across))


def outline(section: "messages.BeamSection") -> np.ndarray:
    """Corners x 2, along axes 2 and 3 [m]."""
    if section.HasField("tube"):
        angles = 2 * np.pi * (np.arange(ROUND) + 0.5) / ROUND
        return section.tube.outer_radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    width, height = section.rectangle.width / 2, section.rectangle.height / 2
    return np.array([(-width, -height), (width, -height), (width, height), (-width, height)])


def swept(structure: "messages.BeamStructure", positions: np.ndarray,
          rotations: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """Triangles x 3, outward, and their vertices, frames x vertices x 3 [m], in the type of positions. The vertices are the
    corners at the start and at the finish of each element, in its order; no two elements share one.

    positions: frames x nodes x 3; rotations: frames x nodes x 4, from how the structure is drawn.
    """
    _, second, third = section_axes(structure)
    faces, parts, first = [], [], 0
    for e, element in enumerate(structure.elements):
        corners = outline(structure.sections[element.section])
        count = len(corners)
        offsets = corners[:, :1] * second[e] + corners[:, 1:] * third[e]
        for node in (element.start, element.finish):
            at = np.broadcast_to(rotations[:, node:node + 1], (len(rotations), count, 4))
            parts.append(positions[:, node:node + 1] + turned(at, offsets))
        i, after = np.arange(count), (np.arange(count) + 1) % count
        faces += [np.stack([first + i, first + after, first + count + after], axis=1),
                  np.stack([first + i, first + count + after, first + count + i], axis=1)]
        fan = np.stack([np.zeros(count - 2, dtype=int), i[1:-1], i[2:]], axis=1)
        faces += [first + fan[:, ::-1], first + count + fan]
        first += 2 * count
    return np.concatenate(faces), np.concatenate(parts, axis=1).astype(positions.dtype)


def counts(structure: "messages.BeamStructure") -> "tuple[np.ndarray, np.ndarray]":
    """Corners of the section and triangles of each element of swept()."""
    corners = np.array([len(outline(structure.sections[element.section])) for element in structure.elements])
    return corners, 4 * corners - 4
