"""Paths of linkages for the player, which sweeps their rods itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import arrays, precision
from ..errors import invalid
from ..messages import service
from ..moving import PATH_RATE
from ..player import Played

if TYPE_CHECKING:
    from .session import LinkageSession


def played(session: "LinkageSession", drawn: "tuple[np.ndarray, np.ndarray] | None") -> Played:
    """The equilibria along the path."""
    if drawn is not None:
        raise invalid("surface", "a surface follows bodies alone")
    frames = session.raw_frames()
    numbers = arrays.to_numpy(frames.data, "frames")
    request = service.GetGeometryRequest(session=session.reference, basis_hash=frames.basis_hash)
    geometry = session.connection.call("get_geometry", request, timeout=max(60.0, session.connection.timeout))
    made = session.geometry_for(frames)
    joints = np.stack([shape.joints for shape in made.shapes(numbers)])
    origin = precision.origin_for(made.positions(numbers))
    if origin.any():
        numbers = made.moved(numbers, -origin).astype(np.float32)
        joints = precision.relative(joints, origin)
    return Played("linkages", session.scene().name or session.id, "z", PATH_RATE, "Step along the path to this shape",
                  service.GetGeometryResponse(linkage=geometry.linkage), numbers, joints)
