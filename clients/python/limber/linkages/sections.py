"""Sections of rods as numbers, for makers and weights."""

from __future__ import annotations

import numpy as np

from .. import arrays
from ..errors import LimberError
from ..messages import scene as messages


def area(section: "messages.RodSection") -> float:
    """[length unit^2]"""
    shape = section.WhichOneof("shape")
    made = getattr(section, shape) if shape else None
    if shape == "rectangle":
        return made.width * made.height
    if shape == "ellipse":
        return np.pi / 4 * made.width * made.height
    if shape == "i":
        return 2 * made.flange_width * made.flange_thickness + (made.height - 2 * made.flange_thickness) * made.web_thickness
    if shape in ("l", "plus"):
        return (made.width + made.height - made.thickness) * made.thickness
    if shape == "tube":
        return np.pi * made.wall_thickness * (made.diameter - made.wall_thickness)
    if shape == "profile":
        return _polygon(made.outer) - sum(_polygon(hole) for hole in made.holes)
    raise LimberError("UNSUPPORTED", f"this client does not know sections of the shape {shape}", "section")


def _polygon(corners: "messages.Array") -> float:
    x, y = arrays.to_numpy(corners, "section.profile").astype(float).T
    return float(abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2)


def describe(section: "messages.RodSection", scale: float = 1.0) -> str:
    """`rectangle 20 x 5`, lengths times scale."""
    shape = section.WhichOneof("shape") or ""
    if shape == "profile":
        return f"profile of {arrays.to_numpy(section.profile.outer, 'section.profile').shape[0]} corners"
    made = getattr(section, shape)
    return f"{shape} " + " x ".join(f"{getattr(made, field.name) * scale:.6g}" for field in made.DESCRIPTOR.fields)
