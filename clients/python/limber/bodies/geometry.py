"""Meshes and bases of elastic bodies."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .. import arrays, precision
from ..errors import LimberError
from ..messages import service
from ..results import issue_text
from . import embedding

ROUNDING = 1e-6  # of positions in files, as a share of the size


@dataclass(frozen=True)
class CarriedSurface:
    """A surface of its own vertices that a body carries along."""

    name: str               # of its file
    vertices: np.ndarray    # at rest, vertices x 3, float32 (far from the origin float64) [length unit], in the file's order
    triangles: np.ndarray   # triangles x 3, int32; polygons are fanned
    nodes: np.ndarray       # vertices x 4, int32: corners of the tet that holds the vertex, or is nearest
    weights: np.ndarray     # vertices x 4, float32; each row's sum is 1
    outside_count: int      # vertices outside the mesh
    outside_distance: float  # largest distance of one from the mesh [length unit]

    @staticmethod
    def from_message(message: "service.CarriedSurface") -> "CarriedSurface":
        return CarriedSurface(
            message.name, arrays.to_numpy(message.vertices, "vertices"), arrays.to_numpy(message.triangles, "triangles"),
            arrays.to_numpy(message.nodes, "nodes"), arrays.to_numpy(message.weights, "weights"), message.outside_count,
            message.outside_distance)

    def positions(self, nodes: np.ndarray) -> np.ndarray:
        """frames x vertices x 3 from frames x nodes x 3, as Session.frames() has them, in their type."""
        nodes = np.asarray(nodes)
        nodes = nodes if nodes.dtype == np.float64 else nodes.astype(np.float32)
        origin = precision.origin_for(nodes).astype(nodes.dtype)
        return embedding.interpolate(self.nodes, self.weights, nodes - origin) + origin

    def basis(self, basis: np.ndarray) -> np.ndarray:
        """Basis of the vertices, from a body's: nodes x 3 x h to vertices x 3 x h."""
        return embedding.interpolate_basis(self.nodes, self.weights, basis)

    def has_vertices(self, vertices: np.ndarray) -> bool:
        """Whether these are its vertices at rest, in their order, to the digits of files."""
        if np.shape(vertices) != self.vertices.shape:
            return False
        size = float(np.ptp(self.vertices, axis=0).max(initial=0))
        return bool(np.abs(vertices - self.vertices).max(initial=0) <= ROUNDING * size)


@dataclass(frozen=True)
class Geometry:
    """The mesh as it was sent and the basis of its motion: positions = rest + basis . coordinates."""

    rest: np.ndarray      # nodes x 3, float32, or float64 far from the origin [length unit]
    tets: np.ndarray      # tets x 4, int32
    surface: np.ndarray   # triangles x 3, int32, outward
    basis: np.ndarray     # nodes x 3 x h, float32 [length unit]
    basis_hash: str
    issues: tuple[str, ...] = field(default=())

    @staticmethod
    def from_message(message: "service.GetGeometryResponse", known: "Geometry | None" = None) -> "Geometry":
        """known: where the basis, or its first columns, are taken from if the message leaves them out."""
        rest = arrays.to_numpy(message.rest, "rest")
        if message.HasField("basis"):
            basis = arrays.to_numpy(message.basis, "basis")
            if message.known_columns > 0:
                if known is None or known.basis.shape[2] != message.known_columns or basis.ndim != 3:
                    raise LimberError("INTERNAL", "the server sent the end of a basis that this client does not hold", "basis")
                basis = np.concatenate([known.basis, basis], axis=2)
        elif known is not None and known.basis_hash == message.basis_hash:
            basis = known.basis
        else:
            raise LimberError("INTERNAL", "the server left out a basis that this client does not hold", "basis")
        if rest.ndim != 2 or rest.shape[1] != 3 or basis.ndim != 3 or basis.shape[:2] != rest.shape:
            raise LimberError("MALFORMED", f"rest {rest.shape} and basis {basis.shape} do not fit each other")
        return Geometry(rest, arrays.to_numpy(message.tets, "tets"), arrays.to_numpy(message.surface, "surface"),
                        basis, message.basis_hash, tuple(issue_text(issue) for issue in message.issues))

    def positions(self, coordinates: np.ndarray) -> np.ndarray:
        """frames x nodes x 3 [length unit] from frames x h coordinates, in the type of `rest`."""
        nodes, _, size = self.basis.shape
        if coordinates.ndim != 2 or coordinates.shape[1] != size:
            raise LimberError("MALFORMED", f"coordinates {coordinates.shape} do not fit a basis of {size} columns")
        moved = coordinates.astype(np.float32) @ self.basis.reshape(3 * nodes, size).T
        rest = self.rest.reshape(1, 3 * nodes)
        if rest.dtype == np.float64:
            return (moved + rest).reshape(-1, nodes, 3)
        moved += rest
        return moved.reshape(-1, nodes, 3)
