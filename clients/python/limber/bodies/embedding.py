"""Points that follow tets: a detailed surface inside a coarse body keeps its own vertices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import checks
from ..errors import invalid

MIN_WEIGHT_INSIDE = -1e-7  # of the least barycentric coordinate: points between two tets are in one of them
MAX_CELLS_PER_TET = 64  # of the grid in which tets are looked up, on average
MAX_NUMBERS_AT_ONCE = 4_000_000  # of arrays of distances
MIN_RELATIVE_GAP = 1e-9  # distances that differ by less, relative to the size of the mesh, are equal: the first tet counts
FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])  # opposite each corner of a tet


@dataclass(frozen=True)
class Embedding:
    """Each point is a fixed mixture of the four nodes of one tet: of the one that contains it, or, outside, of the nearest one,
    extrapolated linearly. The server (limberd) embeds the surface of a scene by the same rule (Session.carried_surface())."""

    tets: np.ndarray       # points, int64: the tet of each
    nodes: np.ndarray      # points x 4
    weights: np.ndarray    # points x 4, of sum 1; below 0 outside
    distances: np.ndarray  # points: how far outside [length unit], 0 inside

    @staticmethod
    def of(points: Any, nodes: Any, tets: Any) -> "Embedding":
        """points: m x 3, in the rest shape of nodes (n x 3) and tets (k x 4) [length unit]."""
        points, nodes = (np.asarray(checks.numeric(value, name), dtype=float)
                         for value, name in ((points, "points"), (nodes, "nodes")))
        tets = np.asarray(checks.numeric(tets, "tets"), dtype=np.int64)
        for value, name, width in ((points, "points", 3), (nodes, "nodes", 3), (tets, "tets", 4)):
            if value.ndim != 2 or value.shape[1] != width:
                raise invalid(name, f"{name} are rows of {width} numbers, not of shape {value.shape}")
        if not len(tets) or tets.min() < 0 or tets.max() >= len(nodes):
            raise invalid("tets", f"tets are one or more, of nodes from 0 to {len(nodes) - 1}")
        for value, name in ((points, "points"), (nodes, "nodes")):
            if not np.isfinite(value).all():
                raise invalid(name, f"coordinates of {name} must be finite")
        corners = nodes[tets]
        inverse = np.linalg.pinv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
        tet_of = _containing(points, corners, inverse)
        distances = np.zeros(len(points))
        outside = np.flatnonzero(tet_of < 0)
        if len(outside):
            tet_of[outside], distances[outside] = _nearest(points[outside], nodes, tets)
        weights = _barycentric(points, corners[tet_of, 0], inverse[tet_of])
        return Embedding(tet_of, tets[tet_of], weights, distances)

    def positions(self, nodes: np.ndarray) -> np.ndarray:
        """Positions of the points, from those of nodes: (frames x) n x 3 to (frames x) points x 3, in their type."""
        return interpolate(self.nodes, self.weights, nodes)

    def basis(self, basis: np.ndarray) -> np.ndarray:
        """Basis of the points, from a body's basis: n x 3 x h to points x 3 x h."""
        return interpolate_basis(self.nodes, self.weights, basis)


def interpolate(corners: np.ndarray, weights: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """corners, weights: points x 4; nodes: (frames x) n x 3. (frames x) points x 3, in the type of nodes."""
    weights = weights.astype(nodes.dtype)
    moved = weights[:, :1] * nodes[..., corners[:, 0], :]
    for corner in range(1, 4):
        moved += weights[:, corner:corner + 1] * nodes[..., corners[:, corner], :]
    return moved


def interpolate_basis(corners: np.ndarray, weights: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """The same of a basis: n x 3 x h to points x 3 x h."""
    moved = interpolate(corners, weights, np.moveaxis(basis, 2, 0))
    return np.ascontiguousarray(np.moveaxis(moved, 0, 2))


def _barycentric(points: np.ndarray, first: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    others = np.einsum("...ij,...j->...i", inverse, points - first)
    return np.concatenate([1 - others.sum(axis=-1, keepdims=True), others], axis=-1)


def _containing(points: np.ndarray, corners: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """The tet that contains each point, -1: none. Tets are looked up by cells of a grid about as large as they are."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    origin = low.min(axis=0)
    size = np.maximum(np.median(high - low, axis=0), np.ptp(corners.reshape(-1, 3), axis=0).max() / 400 + 1e-300)
    while True:
        first, last = (np.floor((edge - origin) / size + shift).astype(np.int64) for edge, shift in ((low, -1e-6), (high, 1e-6)))
        counts = np.prod(last - first + 1, axis=1)
        if counts.sum() <= MAX_CELLS_PER_TET * len(corners):
            break
        size *= 2  # a few large tets among many small ones
    shape = last.max(axis=0) + 2
    tet = np.repeat(np.arange(len(corners)), counts)
    step = np.arange(len(tet)) - np.repeat(np.cumsum(counts) - counts, counts)
    spans = (last - first + 1)[tet]
    cell = first[tet] + np.stack([step // (spans[:, 1] * spans[:, 2]), step // spans[:, 2] % spans[:, 1],
                                  step % spans[:, 2]], axis=1)
    keys = _keys(cell, shape)
    order = np.argsort(keys, kind="stable")
    keys, tet = keys[order], tet[order]
    at = np.floor((points - origin) / size).astype(np.int64)
    within = ((at >= -1) & (at < shape)).all(axis=1)
    key_of = np.where(within, _keys(at, shape), -1)
    tet_of = np.full(len(points), -1, dtype=np.int64)
    by_key = np.argsort(key_of, kind="stable")
    for run in np.split(by_key, np.flatnonzero(np.diff(key_of[by_key])) + 1):
        key = key_of[run[0]] if len(run) else -1
        begin, end = np.searchsorted(keys, key), np.searchsorted(keys, key, side="right")
        if key < 0 or begin == end:
            continue
        candidates = tet[begin:end]
        for part in np.array_split(run, max(1, len(run) * len(candidates) * 12 // MAX_NUMBERS_AT_ONCE)):
            weights = _barycentric(points[part][:, None], corners[candidates, 0], inverse[candidates])
            least = weights.min(axis=2)
            best = least.argmax(axis=1)
            inside = least[np.arange(len(part)), best] >= MIN_WEIGHT_INSIDE
            tet_of[part[inside]] = candidates[best[inside]]
    return tet_of


def _keys(cells: np.ndarray, shape: np.ndarray) -> np.ndarray:
    x, y, z = (cells + 1).T
    return (x * (shape[1] + 2) + y) * (shape[2] + 2) + z


def _nearest(points: np.ndarray, nodes: np.ndarray, tets: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """The tet with the nearest boundary triangle, of several the first, and the distance."""
    faces = tets[:, FACES].reshape(-1, 3)
    _, index, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    boundary = np.sort(index[counts == 1])  # in the order of tets
    triangles = nodes[faces[boundary]]
    centres = triangles.mean(axis=1)
    radii = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)  # of spheres around the triangles
    gap = MIN_RELATIVE_GAP * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    tet, distance = np.zeros(len(points), dtype=np.int64), np.zeros(len(points))
    for part in np.array_split(np.arange(len(points)), max(1, 12 * len(points) * len(boundary) // MAX_NUMBERS_AT_ONCE)):
        to_centres = np.linalg.norm(points[part][:, None] - centres, axis=2)
        bound = _distances(points[part], triangles[to_centres.argmin(axis=1)])
        rows, columns = np.nonzero(to_centres - radii <= bound[:, None] + gap)  # no triangle is nearer than its sphere
        apart = _distances(points[part][rows], triangles[columns])
        starts = np.searchsorted(rows, np.arange(len(part)))
        least = np.minimum.reduceat(apart, starts)
        is_nearest = np.flatnonzero(apart <= least[rows] + gap)
        first = is_nearest[np.searchsorted(rows[is_nearest], np.arange(len(part)))]
        tet[part], distance[part] = boundary[columns[first]] // 4, least
    return tet, distance


def _distances(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distances of points (m x 3) from triangles (m x 3 x 3)."""
    normals = np.cross(triangles[..., 1, :] - triangles[..., 0, :], triangles[..., 2, :] - triangles[..., 0, :])
    sizes = np.linalg.norm(normals, axis=-1)
    least = np.full(normals.shape[:-1], np.inf)
    inside = sizes > 0
    for k in range(3):
        first, edge = triangles[..., k, :], triangles[..., (k + 1) % 3, :] - triangles[..., k, :]
        out = points - first
        share = (out * edge).sum(axis=-1) / np.maximum((edge * edge).sum(axis=-1), 1e-300)
        foot = out - np.clip(share, 0, 1)[..., None] * edge
        least = np.minimum(least, np.linalg.norm(foot, axis=-1))
        inside &= (np.cross(edge, out) * normals).sum(axis=-1) >= 0
    over = np.abs(((points - triangles[..., 0, :]) * normals).sum(axis=-1)) / np.maximum(sizes, 1e-300)
    return np.where(inside, np.minimum(over, least), least)
