"""Picking: nodes and points of surfaces by where they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Sequence, Union

import numpy as np

from .. import checks
from ..errors import invalid
from ..messages import scene

SURFACES = {
    "shown": scene.POINT_SURFACE_UNSPECIFIED,  # the carried surface where the scene names one, else the mesh's
    "mesh": scene.POINT_SURFACE_MESH,
    "carried": scene.POINT_SURFACE_CARRIED,
}
MAX_TRIANGLES_AT_ONCE = 1_000_000


@dataclass(frozen=True)
class SurfacePoint:
    """A point of a triangle: the sum of weights times its corners. Value for `surface_point` of a constraint."""

    triangle: int                          # from 0, of Geometry.surface or CarriedSurface.triangles
    weights: tuple[float, float, float]    # of its corners in their order, >= 0, their sum 1
    surface: str = "shown"                 # "mesh" or "carried"; "shown": carried where the scene names a surface
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)  # where it was when it was picked [length unit]
    distance: float = 0.0                  # of that from where it was looked for


SurfacePointLike = Union[SurfacePoint, Sequence[Any]]  # or (triangle, (w0, w1, w2)), or (triangle, (w0, w1, w2), surface)


def to_message(point: SurfacePointLike) -> "scene.SurfacePoint":
    if not isinstance(point, SurfacePoint):
        parts = list(checks.several(point, "surface_point"))
        if len(parts) not in (2, 3):
            raise invalid("surface_point", "a point is (triangle, (w0, w1, w2)), and its surface, if it is not the shown one")
        point = SurfacePoint(*parts)
    weights = [checks.real(weight, f"surface_point.weights[{i}]")
               for i, weight in enumerate(checks.several(point.weights, "surface_point.weights"))]
    if point.surface not in SURFACES:
        raise invalid("surface_point.surface", f"a surface is one of {', '.join(SURFACES)}, not {point.surface!r}")
    return scene.SurfacePoint(triangle=checks.whole(point.triangle, "surface_point.triangle"), weights=weights,
                              surface=SURFACES[point.surface])


def from_message(message: "scene.SurfacePoint") -> SurfacePoint:
    names = {value: name for name, value in SURFACES.items()}
    return SurfacePoint(message.triangle, tuple(message.weights), names.get(message.surface, "shown"))


def point_of(values: Any, field: str) -> np.ndarray:
    """Three finite numbers."""
    point = np.asarray(checks.numeric(values, field), dtype=float)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise invalid(field, f"{field} is a point x, y, z, not {values!r}")
    return point


def nodes_in_box(nodes: np.ndarray, low: Any, high: Any) -> np.ndarray:
    """Ids of the points (n x 3) in a box with sides along the axes, its faces included, ascending."""
    low, high = point_of(low, "low"), point_of(high, "high")
    if (low > high).any():
        raise invalid("low", f"low must be <= high on each axis, are {low.tolist()} and {high.tolist()}")
    return np.flatnonzero(((nodes >= low) & (nodes <= high)).all(axis=1))


def nearest_point(position: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> "tuple[int, np.ndarray, np.ndarray]":
    """The point of the triangles (t x 3, of vertices n x 3) nearest to a position; of several the first triangle's.
    Returns the triangle, the weights of its corners and where the point is."""
    if not len(triangles):
        raise invalid("triangles", "a surface without triangles has no points")
    best: "tuple[float, int, np.ndarray, np.ndarray] | None" = None
    for first in range(0, len(triangles), MAX_TRIANGLES_AT_ONCE):
        corners = vertices[triangles[first:first + MAX_TRIANGLES_AT_ONCE]].astype(float)
        weights = _weights_of_nearest(position, corners)
        points = np.einsum("tc,tci->ti", weights, corners)
        distances = np.linalg.norm(points - position, axis=1)
        t = int(distances.argmin())
        if best is None or distances[t] < best[0]:
            best = (float(distances[t]), first + t, weights[t], points[t])
    return best[1], best[2], best[3]


def _weights_of_nearest(x: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """t x 3 weights of the point of each triangle (t x 3 x 3) that is nearest to x."""
    count = len(corners)
    origin = corners[:, 0]
    u, v, w = corners[:, 1] - origin, corners[:, 2] - origin, x - origin
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    uw, vw = (u * w).sum(1), (v * w).sum(1)
    area = uu * vv - uv * uv
    is_flat = area <= 1e-14 * uu * vv
    area = np.where(is_flat, 1.0, area)
    b, c = (vv * uw - uv * vw) / area, (uu * vw - uv * uw) / area
    weights = np.stack([1 - b - c, b, c], axis=1)
    outside = is_flat | (weights < 0).any(axis=1)
    # Outside, or without area: the nearest point of the three edges.
    least = np.full(count, np.inf)
    of_edges = np.zeros((count, 3))
    for k in range(3):
        start, edge = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        share = ((x - start) * edge).sum(1) / np.maximum((edge * edge).sum(1), 1e-300)
        share = np.clip(share, 0, 1)
        distance = np.linalg.norm(start + share[:, None] * edge - x, axis=1)
        nearer = distance < least
        least = np.where(nearer, distance, least)
        on_edge = np.zeros((count, 3))
        on_edge[:, k], on_edge[:, (k + 1) % 3] = 1 - share, share
        of_edges = np.where(nearer[:, None], on_edge, of_edges)
    return np.where(outside[:, None], of_edges, weights)
