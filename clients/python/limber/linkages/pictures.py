"""Pictures of linkages as .svg: shapes side by side, with the surface they are to reach."""

from __future__ import annotations

import os
from html import escape
from typing import Any, Mapping, Sequence

import numpy as np

from .. import checks
from ..errors import invalid, of_file
from . import surfaces
from .goals import surface_arrays
from .shapes import Shape

PANEL = 360.0   # width and height of one shape's panel [px]
MARGIN = 24.0
ROD = "#1f4e79"
HIDDEN = "#8aa5c0"   # rods far from the eye
SURFACE = np.array([232, 163, 61])
NEAR, FAR = np.array([35, 120, 60]), np.array([200, 30, 30])  # joints on the surface, and the one farthest from it


def picture(path: "str | os.PathLike[str]", shapes: "Mapping[str, Shape | None]", surface: Any = None,
            view: Sequence[float] = (-60.0, 25.0), unit: str = "", apart: Sequence[str] = ()) -> None:
    """Writes shapes into one .svg file, from left to right, all at the same scale.

    shapes: by title, results of session.shape(); None: the surface alone. `surface`: a file (.obj, .ply, .stl, .off, .glb),
    (vertices, triangles), points in rows (m x n x 3) or in no order (n x 3), drawn behind every shape. Except with points in no
    order joints are drawn too: green on the surface, the redder the farther from it, the farthest of all shapes red. Under each
    shape is the root mean square of their distances. `view`: azimuth and elevation of the eye [degree]; it is far away, so that
    parallel lines stay parallel. `unit`: of lengths, in texts. `apart`: titles of shapes that are drawn without the surface, as
    the flat one of a linkage that is deployed to it.
    """
    target = checks.path(path, "path")
    if target.suffix.lower() != ".svg":
        raise invalid("path", f"pictures are .svg files, not {target.name}")
    for title, shape in shapes.items():
        if shape is not None and not isinstance(shape, Shape):
            raise invalid("shapes", f"{title}: pictures are of linkages, as session.shape() returns them, "
                                    f"not of {type(shape).__name__}")
    axes = _axes(*(checks.real(angle, "view") for angle in checks.several(view, "view")))
    ground = None if surface is None else _Ground(*_surface(surface), axes)
    for title in checks.several(apart, "apart"):
        if shapes.get(title) is None:
            raise invalid("apart", f"there is no shape called {title!r}")
    panels = {title: _Panel(shape, None if title in apart else ground, axes) for title, shape in shapes.items()}
    drawn = [point for panel in panels.values() for point in panel.lines] + ([ground.seen] if ground else [])
    if not panels or not drawn:
        raise invalid("shapes", "there is nothing to draw")
    low, high = np.concatenate(drawn).min(axis=0), np.concatenate(drawn).max(axis=0)
    size = float((high - low)[:2].max())
    if not np.isfinite(size) or size <= 0:
        raise invalid("shapes", "shapes have no extent")
    scale = (PANEL - 2 * MARGIN) / size
    farthest = max([float(panel.distances.max()) for panel in panels.values() if panel.distances.size], default=0.0)
    height = (high - low)[1] * scale + (4 if farthest else 3) * MARGIN
    parts = []
    for i, (title, panel) in enumerate(panels.items()):
        middle = PANEL * (i + 0.5)
        origin = np.array([middle, 1.7 * MARGIN + (high - low)[1] * scale / 2])

        def place(points: np.ndarray, origin: np.ndarray = origin) -> np.ndarray:
            return origin + (points[:, :2] - ((low + high) / 2)[:2]) * (scale, -scale)

        parts += (ground.drawn(place) if ground and title not in apart else []) + _rods(panel.lines, place)
        parts += _joints(panel, place, farthest)
        parts.append(f'<text x="{middle:.0f}" y="{MARGIN:.0f}" text-anchor="middle">{escape(title)}</text>')
        if panel.distances.size:
            rms = f"{np.sqrt(np.mean(panel.distances ** 2)):.2g} {unit}".strip()
            parts.append(f'<text x="{middle:.0f}" y="{height - MARGIN / 2:.0f}" text-anchor="middle" '
                         f'font-size="12">joints {escape(rms)} from the surface (rms)</text>')
    width = PANEL * len(panels)
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
            f'font-family="sans-serif" font-size="15" stroke-linejoin="round" stroke-linecap="round">')
    paper = f'<rect width="{width:.0f}" height="{height:.0f}" fill="white"/>'
    text = "\n".join([head, paper, *parts, "</svg>\n"])
    try:
        target.write_text(text, encoding="utf-8")
    except OSError as error:
        raise of_file(error, f"{target} cannot be written", "path") from error


def _surface(surface: Any) -> "tuple[np.ndarray, np.ndarray | None]":
    """Points and triangles that can be drawn. Errors in them are found here, without a server."""
    if isinstance(surface, (str, os.PathLike)):
        points, triangles = surfaces.read(surface, "surface")
    else:
        points, triangles = surface_arrays(surface, "surface")
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        size = " x ".join(map(str, points.shape))
        raise invalid("surface", f"surface needs points n x 3, or in rows m x n x 3, not {size}")
    if not np.isfinite(points).all():
        raise invalid("surface", "surface has points that are not finite")
    if triangles is None:
        return points, None
    if len(triangles) == 0:
        raise invalid("surface", "surface has no triangles: points in rows need two rows of two at least")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not np.issubdtype(triangles.dtype, np.integer):
        raise invalid("surface", "triangles of a surface are vertex numbers t x 3")
    if triangles.min() < 0 or triangles.max() >= len(points):
        worst = triangles.max() if triangles.max() >= len(points) else triangles.min()
        raise invalid("surface", f"a triangle has vertex {worst}, and the surface has {len(points)}")
    return points, triangles


def _axes(azimuth: float, elevation: float) -> np.ndarray:
    """Rows: to the right, up, and towards the eye."""
    a, e = np.radians(azimuth), np.radians(elevation)
    right = np.array([-np.sin(a), np.cos(a), 0])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return np.stack([right, np.cross(eye, right), eye])


class _Ground:
    """The surface."""

    def __init__(self, points: np.ndarray, triangles: "np.ndarray | None", axes: np.ndarray):
        self.points, self.triangles = points, triangles
        self.seen = points @ axes.T

    def drawn(self, place: Any) -> list[str]:
        """Points, or triangles from far to near, lit from the eye's upper left."""
        flat = place(self.seen)
        if self.triangles is None:
            return [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.5" fill="{_colour(SURFACE)}"/>' for x, y in flat]
        a, b, c = (self.seen[self.triangles[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        normals *= np.where(normals[:, 2] < 0, -1, 1)[:, None]
        light = 0.45 + 0.55 * np.clip(normals @ (np.array([-0.5, 0.7, 0.5]) / np.sqrt(0.99)), 0, 1)
        faces = []
        for t in np.argsort(self.seen[self.triangles, 2].mean(axis=1)):
            fill = _colour(255 - (255 - SURFACE) * 0.75 - 130 * (1 - light[t]))
            outline = "L".join(f"{x:.1f} {y:.1f}" for x, y in flat[self.triangles[t]])
            faces.append(f'<path d="M{outline}Z" fill="{fill}" stroke="{fill}" stroke-width="0.5"/>')
        return faces

    def distances(self, joints: np.ndarray) -> np.ndarray:
        """Distances of joints from the nearest triangle."""
        if self.triangles is None:
            return np.zeros(0)
        corners = self.points[self.triangles]
        return np.array([_distance(joint, corners) for joint in joints])


def _distance(point: np.ndarray, corners: np.ndarray) -> float:
    """From the nearest of triangles, t x 3 x 3: its inside where the point is over it, else one of its edges."""
    least = np.inf
    inside = np.ones(len(corners), dtype=bool)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for k in range(3):
        first, edge = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        share = np.einsum("ti,ti->t", point - first, edge) / np.maximum(np.einsum("ti,ti->t", edge, edge), 1e-300)
        least = min(least, np.linalg.norm(first + np.clip(share, 0, 1)[:, None] * edge - point, axis=1).min())
        inside &= np.einsum("ti,ti->t", np.cross(edge, point - first), normals) >= 0
    sizes = np.linalg.norm(normals, axis=1)
    inside &= sizes > 0
    if inside.any():
        over = np.abs(np.einsum("ti,ti->t", point - corners[:, 0], normals))[inside] / sizes[inside]
        least = min(least, over.min())
    return float(least)


class _Panel:
    """A shape as it is drawn."""

    def __init__(self, shape: "Shape | None", ground: "_Ground | None", axes: np.ndarray):
        self.lines = [] if shape is None else [line @ axes.T for line in shape.centrelines]
        joints = np.zeros((0, 3)) if shape is None else shape.joints[np.isfinite(shape.joints).all(axis=1)]
        self.joints = joints @ axes.T
        self.distances = ground.distances(joints) if ground and len(joints) else np.zeros(0)


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


def _joints(panel: _Panel, place: Any, farthest: float) -> list[str]:
    if not panel.distances.size:
        return []
    shares = panel.distances / farthest if farthest > 0 else panel.distances
    places = place(panel.joints)
    return [f'<circle cx="{places[j, 0]:.1f}" cy="{places[j, 1]:.1f}" r="3.2" '
            f'fill="{_colour(NEAR + shares[j] * (FAR - NEAR))}"/>' for j in np.argsort(panel.joints[:, 2])]


def _colour(rgb: np.ndarray) -> str:
    return "#" + "".join(f"{int(part):02x}" for part in np.clip(np.round(rgb), 0, 255))
