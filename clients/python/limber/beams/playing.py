"""Paths of structures of beams for the player, which sweeps their elements itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import arrays, precision
from ..errors import invalid
from ..messages import service
from ..moving import PATH_RATE
from ..player import Played

if TYPE_CHECKING:
    from .session import BeamSession


def played(session: "BeamSession", drawn: "tuple[np.ndarray, np.ndarray] | None") -> Played:
    """The equilibria along the path."""
    if drawn is not None:
        raise invalid("surface", "a surface follows bodies alone")
    numbers = arrays.to_numpy(session.raw_frames().data, "frames")
    geometry = session.connection.call("get_geometry", service.GetGeometryRequest(session=session.reference),
                                       timeout=max(60.0, session.connection.timeout))
    scene = session.scene()
    positions = session.geometry().positions(numbers)
    origin = precision.origin_for(positions)
    if origin.any():
        numbers = numbers.reshape(len(numbers), -1, 7) - np.concatenate([origin, np.zeros(4)])
        numbers = numbers.reshape(len(numbers), -1).astype(np.float32)
    rest = precision.relative(arrays.to_numpy(geometry.rest, "rest"), origin)
    return Played("beams", scene.name or session.id, "z", PATH_RATE, "Step along the path to this shape",
                  service.GetGeometryResponse(rest=arrays.to_message(rest, np.float32), beams=geometry.beams), numbers,
                  precision.relative(positions, origin), structure=scene.beams.structure.SerializeToString())
