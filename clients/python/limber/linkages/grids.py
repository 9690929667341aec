"""Starting grids: straight rods for a patch of surface, to begin a design with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np

from .. import arrays, checks
from ..messages import design as messages
from .goals import placement_of, set_given, surface_of


@dataclass(frozen=True)
class StartingGrid:
    """Two families of straight rods that lie flat and open to about a patch of surface: to begin a design with."""

    vertices: np.ndarray    # flat, in the plane z = 0, n x 3 [length unit]
    edges: np.ndarray       # m x 2
    deployed: np.ndarray    # the same vertices on the surface
    lengths: np.ndarray     # of the edges, flat [length unit]
    mean_angle: float       # at which rods cross on the surface [degree]
    misfit: float           # largest difference between a length and that on the surface, as a share
    push: np.ndarray        # forces along z at joints that open the grid to the surface's side of its plane, over Young's modulus
    remark: str             # obstacles for a design; "": none

    @property
    def columns(self) -> int:
        """Joints of a row; the joint of column c and row r is number r * columns + c."""
        return int(self.edges[self.edges[:, 0] == 0].max())

    @staticmethod
    def from_message(message: "messages.MakeStartingGridResponse") -> "StartingGrid":
        return StartingGrid(arrays.to_numpy(message.flat.vertices, "flat.vertices"),
                            arrays.to_numpy(message.flat.edges, "flat.edges"),
                            arrays.to_numpy(message.deployed.vertices, "deployed.vertices"),
                            np.array(message.segment_lengths), message.mean_angle_degrees, message.misfit,
                            np.array(message.push), message.remark)


def grid_request(surface: Any, columns: int | None, rows: int | None, flat_angle: float | None, margin: float | None,
                 translation: Sequence[float] | None, rotation: Sequence[float] | None,
                 scale: float | None, drive: float | None = None) -> "messages.MakeStartingGridRequest":
    made = messages.MakeStartingGridRequest(surface=surface_of(surface, "surface"))
    placement = placement_of(translation, rotation, scale)
    if placement is not None:
        made.placement.CopyFrom(placement)
    if columns is not None:
        made.columns = checks.whole(columns, "columns")
    if rows is not None:
        made.rows = checks.whole(rows, "rows")
    set_given(made, {"flat_angle_degrees": flat_angle, "margin": margin, "drive": drive})
    return made
