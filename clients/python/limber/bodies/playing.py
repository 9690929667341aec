"""Motions of bodies for the player: the surface as a sum of few deformations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import arrays, morphs, precision
from ..errors import LimberError
from ..messages import service
from ..player import Played

if TYPE_CHECKING:
    from .session import Session

MOST_COLUMNS = 256


def played(session: "Session", tolerance: float, drawn: "tuple[np.ndarray, np.ndarray] | None") -> Played:
    """As many deformations as it takes to be within the tolerance, a share of the size. The surface is the one that is given,
    that the scene carries, or the boundary of the tets."""
    moving = session.moving_surface(drawn)
    faces, positions = moving.faces, moving.positions
    if drawn is None:
        try:
            carried = session.carried_surface()
            faces, positions = carried.triangles, carried.positions(session.frames())
        except LimberError as error:
            if error.code != "FAILED_PRECONDITION":
                raise
    positions = precision.relative(positions, precision.origin_for(positions))
    base, targets, weights, _ = morphs.targets_of(positions, 0.8 * tolerance * moving.size, MOST_COLUMNS)
    geometry = service.GetGeometryResponse(rest=arrays.to_message(base, np.float32),
                                           surface=arrays.to_message(faces, np.int32))
    basis = targets.reshape(len(targets), base.size).T
    return Played("bodies", moving.name, "y", moving.frames_per_second, "Frame", geometry, weights, positions, basis)
