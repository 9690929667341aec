"""Moving surfaces of a session for drawing: made by each kind, written by saving.py."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Sequence

import numpy as np

PATH_RATE = 24.0  # frames a second of equilibria along a path, which have no time of their own


@dataclass(frozen=True)
class MovingSurface:
    """A surface of triangles whose vertices move."""

    name: str
    faces: np.ndarray          # triangles x 3, vertices from 0
    positions: np.ndarray      # frames x vertices x 3, float32, or float64 far from the origin [length unit]
    frames_per_second: float
    metres: float              # one length unit
    is_loop: bool = False      # the last frame leads into the first

    @property
    def size(self) -> float:
        """Diagonal of the box around all frames [length unit]."""
        flat = self.positions.reshape(-1, 3)
        return float(np.linalg.norm(np.ptp(flat, axis=0))) if len(flat) else 0.0


@dataclass(frozen=True)
class MovingPoints:
    """Nodes or joints that move."""

    name: str                  # of one of them: "node", "joint"
    numbers: Sequence[int]
    positions: np.ndarray      # frames x points x 3 [length unit]
    frames_per_second: float


def of_nodes(faces: np.ndarray, positions: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """Faces and positions of the nodes that faces have, in their order."""
    nodes, numbers = np.unique(faces, return_inverse=True)
    return numbers.reshape(faces.shape), positions[:, nodes]
