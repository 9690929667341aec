"""Pictures of linkages as .svg: shapes side by side, with the surface they are to reach."""

from __future__ import annotations

import os
from html import escape
from typing import Any, Mapping, Sequence

import numpy as np

from . import checks
from .errors import LimberError, invalid
from .linkage_shapes import Shape

PANEL = 360.0   # width and height of one shape's panel [px]
MARGIN = 24.0
ROD = "#1f4e79"
HIDDEN = "#9fb6cd"   # rods far from the eye
SURFACE = "#e8a33d"


def picture(path: "str | os.PathLike[str]", shapes: "Mapping[str, Shape | None]", surface: Any = None,
            view: Sequence[float] = (-60.0, 25.0)) -> None:
    """Writes shapes into one .svg file, from left to right, all at the same scale.

    shapes: by title, what session.shape() returns; None: the surface alone. surface: (vertices, triangles), or points,
    drawn behind every shape. view: azimuth and elevation of the eye [degree]; it is far away, so that parallel lines
    stay parallel.
    """
    target = checks.path(path, "path")
    axes = _axes(*(checks.real(angle, "view") for angle in checks.several(view, "view")))
    ground = _projected(surface, axes)
    panels = {title: [] if shape is None else [line @ axes.T for line in shape.centrelines]
              for title, shape in shapes.items()}
    drawn = [point for lines in panels.values() for point in lines] + ([ground[0]] if ground else [])
    if not panels or not drawn:
        raise invalid("shapes", "there is nothing to draw")
    low, high = np.concatenate(drawn).min(axis=0), np.concatenate(drawn).max(axis=0)
    size = float((high - low)[:2].max())
    if not np.isfinite(size) or size <= 0:
        raise invalid("shapes", "shapes have no extent")
    scale = (PANEL - 2 * MARGIN) / size
    height = (high - low)[1] * scale + 3 * MARGIN
    parts = []
    for i, (title, lines) in enumerate(panels.items()):
        origin = np.array([PANEL * (i + 0.5), height / 2 + MARGIN / 2])

        def place(points: np.ndarray, origin: np.ndarray = origin) -> np.ndarray:
            return origin + (points[:, :2] - ((low + high) / 2)[:2]) * (scale, -scale)

        parts += _surface(ground, place) + _rods(lines, place)
        parts.append(f'<text x="{PANEL * (i + 0.5):.0f}" y="{MARGIN:.0f}" text-anchor="middle">{escape(title)}</text>')
    width = PANEL * len(panels)
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
            f'font-family="sans-serif" font-size="15" stroke-linejoin="round" stroke-linecap="round">')
    paper = f'<rect width="{width:.0f}" height="{height:.0f}" fill="white"/>'
    text = "\n".join([head, paper, *parts, "</svg>\n"])
    try:
        target.write_text(text, encoding="utf-8")
    except OSError as error:
        raise LimberError("IO", f"{target} cannot be written: {error.strerror}", "path") from error


def _axes(azimuth: float, elevation: float) -> np.ndarray:
    """Rows: to the right, up, and towards the eye."""
    a, e = np.radians(azimuth), np.radians(elevation)
    right = np.array([-np.sin(a), np.cos(a), 0])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return np.stack([right, np.cross(eye, right), eye])


def _projected(surface: Any, axes: np.ndarray) -> "tuple[np.ndarray, np.ndarray | None] | None":
    if surface is None:
        return None
    if isinstance(surface, tuple) and len(surface) == 2:
        return checks.numeric(surface[0], "surface") @ axes.T, checks.numeric(surface[1], "surface")
    return checks.numeric(surface, "surface") @ axes.T, None


def _surface(ground: Any, place: Any) -> list[str]:
    if ground is None:
        return []
    points, triangles = ground
    flat = place(points)
    if triangles is None:
        return [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.5" fill="{SURFACE}"/>' for x, y in flat]
    order = np.argsort(points[triangles, 2].mean(axis=1))
    outlines = "".join("M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in flat[corners]) + "Z"
                       for corners in triangles[order])
    return [f'<path d="{outlines}" fill="{SURFACE}" fill-opacity="0.18" stroke="{SURFACE}" stroke-width="0.4" '
            'stroke-opacity="0.5"/>']


def _rods(lines: "list[np.ndarray]", place: Any) -> list[str]:
    """From far to near, the nearer the darker."""
    if not lines:
        return []
    depth = np.array([line[:, 2].mean() for line in lines])
    near = (depth - depth.min()) / max(float(np.ptp(depth)), 1e-12)
    drawn = []
    for s in np.argsort(depth):
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in place(lines[s]))
        drawn.append(f'<polyline points="{points}" fill="none" stroke="{ROD if near[s] > 0.4 else HIDDEN}" '
                     f'stroke-width="{1.2 + near[s]:.1f}"/>')
    return drawn
