"""Frames of structures of beams: positions and rotations of nodes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .. import arrays
from ..errors import LimberError
from ..messages import service


@dataclass(frozen=True)
class BeamGeometry:
    """Data common to all shapes of a structure of beams."""

    rest: np.ndarray      # nodes x 3, float32, or float64 far from the origin, as drawn [m]
    elements: np.ndarray  # elements x 2, int32: their nodes
    basis_hash: str = field(default="")  # frames of beams have no basis

    @staticmethod
    def from_message(message: "service.GetGeometryResponse") -> "BeamGeometry":
        return BeamGeometry(arrays.to_numpy(message.rest, "rest"), arrays.to_numpy(message.beams.elements, "elements"))

    def _shapes(self, coordinates: np.ndarray) -> np.ndarray:
        if coordinates.ndim != 2 or coordinates.shape[1] != 7 * len(self.rest):
            raise LimberError("MALFORMED", f"coordinates {coordinates.shape} do not fit {len(self.rest)} nodes")
        return coordinates.reshape(len(coordinates), -1, 7)

    def positions(self, coordinates: np.ndarray) -> np.ndarray:
        """frames x nodes x 3 [m], in the type of the coordinates"""
        return np.array(self._shapes(coordinates)[:, :, :3])

    def rotations(self, coordinates: np.ndarray) -> np.ndarray:
        """frames x nodes x 4 float32: quaternions w, x, y, z from rest"""
        return np.array(self._shapes(coordinates)[:, :, 3:], dtype=np.float32)
