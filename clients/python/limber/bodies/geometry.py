"""Meshes and bases of elastic bodies."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .. import arrays
from ..errors import LimberError
from ..messages import service
from ..results import issue_text


@dataclass(frozen=True)
class Geometry:
    """The mesh as it was sent and the basis of its motion: positions = rest + basis . coordinates."""

    rest: np.ndarray      # nodes x 3, float32 [length unit]
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
        """frames x nodes x 3 float32 [length unit] from frames x h coordinates."""
        nodes, _, size = self.basis.shape
        if coordinates.ndim != 2 or coordinates.shape[1] != size:
            raise LimberError("MALFORMED", f"coordinates {coordinates.shape} do not fit a basis of {size} columns")
        moved = coordinates.astype(np.float32) @ self.basis.reshape(3 * nodes, size).T
        moved += self.rest.reshape(1, 3 * nodes)
        return moved.reshape(-1, nodes, 3)
