"""Stiffness painted on a body, as scenes take it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import invalid
from ..files import read
from ..messages import scene as messages

_POINTS = {"auto": messages.PAINTED_POINTS_UNSPECIFIED, "nodes": messages.PAINTED_POINTS_NODES,
           "surface": messages.PAINTED_POINTS_SURFACE}
_QUANTITIES = {"factor": messages.PAINTED_QUANTITY_FACTOR, "youngs_modulus": messages.PAINTED_QUANTITY_YOUNGS_MODULUS}


def painted_stiffness(values: Any, *, points: str = "auto", quantity: str = "factor") -> "messages.PaintedStiffness":
    """How stiff a body is at points of it, for `stiffness` of limber.scene_from_arrays() and its like.

    values: a number > 0 for each point (array of n), the path of a file, or groups: by name {"vertices": ids from 0, "factor": f}
    or {"vertices": ids, "youngs_modulus": E}. Points of no group keep their stiffness. A file is a text with a number for each
    point, a .npy, JSON of groups, or a .ply whose vertices have the property stiffness, quality, value or scalar_... `points`:
    "surface", vertices of the surface that the scene carries, or "nodes" of its mesh; "auto": the surface if there is one.
    `quantity`: meaning of numbers without groups, "factor" of the Young's modulus or "youngs_modulus" itself [Pa].

    A tet gets the geometric mean of its four nodes, or that of the vertex nearest to its centre. The server does it: errors of
    counts and values come when the scene is opened or validated.
    """
    made = messages.PaintedStiffness(points=_POINTS[checks.one_of(points, _POINTS, "points")],
                                     quantity=_QUANTITIES[checks.one_of(quantity, _QUANTITIES, "quantity")])
    if isinstance(values, (str, os.PathLike)):
        path = checks.path(values, "stiffness")
        if path.suffix.lower() != ".npy":
            made.file.CopyFrom(stiffness_file(path, "stiffness"))
            return made
        try:
            values = np.load(path, allow_pickle=False)
        except (OSError, ValueError) as error:
            raise invalid("stiffness", f"cannot read {path}: {error}") from error
    if isinstance(values, dict):
        groups = {str(name): {key: np.asarray(value).tolist() for key, value in group.items()} for name, group in values.items()}
        made.file.name, made.file.content = "groups.json", json.dumps({"groups": groups}).encode()
        return made
    numbers = checks.numeric(values, "stiffness")
    if numbers.ndim != 1:
        raise invalid("stiffness", f"stiffness has the shape {numbers.shape}: one number for each point is expected")
    made.values.extend(numbers.astype(float).tolist())
    return made


def stiffness_file(path: Path, field: str) -> "messages.MeshFile":
    """A file's bytes for upload."""
    return messages.MeshFile(name=path.name, content=read(path, field))
