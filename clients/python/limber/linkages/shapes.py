"""Shapes of rod linkages: centrelines, frames, angles, swept surfaces."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .. import arrays
from ..errors import LimberError
from ..messages import service


@dataclass(frozen=True)
class Shape:
    """One shape. The first and the last edge of a segment reach half their length beyond its joints."""

    centrelines: tuple[np.ndarray, ...]  # of each segment, (edges + 1) x 3 [length unit]
    directors: tuple[np.ndarray, ...]    # of each segment, d1 of its edges, edges x 3
    angles: np.ndarray                   # opening angle of each joint [degree]
    joints: np.ndarray                   # positions, joints x 3 [length unit]; NaN where a joint has no segment


@dataclass(frozen=True)
class Rod:
    """Segments that go on in each other at joints: the same in every shape."""

    segments: tuple[int, ...]   # in order along the rod
    reversed: tuple[bool, ...]  # of each: it runs from its last end to its first
    closed: bool                # a ring: the last segment goes on in the first


@dataclass(frozen=True)
class LinkageGeometry:
    """Data common to all shapes of a linkage, until it is cut into more edges for its tolerance."""

    coordinates: int               # numbers of one shape
    edges: tuple[int, ...]         # of each segment
    joints_of_segment: np.ndarray  # segments x 2; -1: a free end
    vertex_of_joint: np.ndarray    # joints, ids of the line mesh
    outline: np.ndarray            # of the section, corners x 2, in (d1, d2) [length unit]
    surface: np.ndarray            # triangles x 3, outward, of the swept surface
    nodes: int                     # of the swept surface
    rods: tuple[Rod, ...] = ()   # every segment is in one
    mixed_angles: bool = False     # a rotation that opens one joint closes the next: there is no mean angle to request
    basis_hash: str = field(default="")  # of the edges: frames say by theirs which ones they are of

    @staticmethod
    def from_message(message: "service.GetGeometryResponse") -> "LinkageGeometry":
        made = message.linkage
        geometry = LinkageGeometry(
            made.coordinates, tuple(made.edges), arrays.to_numpy(made.joints_of_segment, "joints_of_segment"),
            np.array(made.vertex_of_joint, dtype=np.int64), arrays.to_numpy(made.outline, "outline"),
            arrays.to_numpy(message.surface, "surface"), made.surface_nodes,
            tuple(Rod(tuple(rod.segments), tuple(rod.reversed), rod.closed) for rod in made.rods), made.mixed_angles,
            message.basis_hash)
        numbers = sum(6 * edges + 3 for edges in geometry.edges) + len(geometry.vertex_of_joint)
        if numbers != geometry.coordinates:
            raise LimberError("MALFORMED", f"a shape of {geometry.coordinates} numbers, its parts have {numbers}")
        return geometry

    def shapes(self, coordinates: np.ndarray) -> list[Shape]:
        """The shape of each row of frames in ENCODING_COORDINATES."""
        self._check(coordinates)
        return [self._shape(row) for row in coordinates]

    def positions(self, coordinates: np.ndarray) -> np.ndarray:
        """Nodes of the swept surface, frames x nodes x 3 [length unit], in the type of the coordinates."""
        self._check(coordinates)
        frames, at, parts = len(coordinates), 0, []
        outline = self.outline.astype(coordinates.dtype)
        for edges in self.edges:
            size = 3 * (edges + 1)
            x = coordinates[:, at:at + size].reshape(frames, edges + 1, 3)
            d = coordinates[:, at + size:at + size + 3 * edges].reshape(frames, edges, 3)
            at += size + 3 * edges
            before, after = np.maximum(np.arange(edges + 1) - 1, 0), np.minimum(np.arange(edges + 1), edges - 1)
            edge_tangents = _unit(np.diff(x, axis=1))
            t = _unit(edge_tangents[:, before] + edge_tangents[:, after])
            d1 = d[:, before] + d[:, after]
            d1 = _unit(d1 - t * (t * d1).sum(axis=-1, keepdims=True))
            d2 = np.cross(t, d1)
            ring = (x[:, :, None] + outline[:, :1] * d1[:, :, None] + outline[:, 1:] * d2[:, :, None])
            parts.append(ring.reshape(frames, -1, 3))
        return np.concatenate(parts, axis=1).astype(coordinates.dtype)

    def moved(self, coordinates: np.ndarray, by: np.ndarray) -> np.ndarray:
        """Coordinates of the shapes after a translation [length unit]."""
        self._check(coordinates)
        result, at = coordinates.astype(float), 0
        for edges in self.edges:
            size = 3 * (edges + 1)
            result[:, at:at + size] += np.tile(by, edges + 1)
            at += size + 3 * edges
        return result

    def _check(self, coordinates: np.ndarray) -> None:
        if coordinates.ndim != 2 or coordinates.shape[1] != self.coordinates:
            raise LimberError("MALFORMED", f"coordinates {coordinates.shape} do not fit a shape of {self.coordinates}")

    def _shape(self, row: np.ndarray) -> Shape:
        at, lines, directors = 0, [], []
        joints = np.full((len(self.vertex_of_joint), 3), np.nan, dtype=row.dtype)
        for edges, ends in zip(self.edges, self.joints_of_segment):
            size = 3 * (edges + 1)
            line = row[at:at + size].reshape(-1, 3)
            lines.append(line)
            directors.append(row[at + size:at + size + 3 * edges].reshape(-1, 3))
            at += size + 3 * edges
            for joint, (inner, outer) in zip(ends, ((0, 1), (-1, -2))):
                if joint >= 0:
                    joints[joint] = (line[inner] + line[outer]) / 2
        return Shape(tuple(lines), tuple(directors), np.degrees(row[at:]), joints)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
