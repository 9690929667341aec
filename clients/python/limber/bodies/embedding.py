"""Points that follow tets: a detailed surface inside a coarse body keeps its own vertices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import checks
from ..errors import invalid

INSIDE = -1e-7    # of the least barycentric coordinate: what lies between two tets is in one of them
NEAR = 24         # boundary triangles that are looked at for a point outside, the nearest by their middles
CHUNK = 4_000_000  # numbers that are compared at once
CORNERS = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])  # of the face opposite each corner of a tet


@dataclass(frozen=True)
class Embedding:
    """Each point is a fixed mixture of the four nodes of one tet: of the one that it lies in, or, outside, of the one with
    the nearest boundary triangle, beyond which it goes on linearly."""

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
        if not len(tets) or not np.isfinite(points).all() or tets.min() < 0 or tets.max() >= len(nodes):
            raise invalid("tets", "points are embedded in tets of known nodes, at finite places")
        corners = nodes[tets]
        inverse = np.linalg.pinv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
        found = _containing(points, corners, inverse)
        distances = np.zeros(len(points))
        outside = np.flatnonzero(found < 0)
        if len(outside):
            found[outside], distances[outside] = _nearest(points[outside], nodes, tets)
        weights = _barycentric(points, corners[found, 0], inverse[found])
        return Embedding(found, tets[found], weights, distances)

    def positions(self, nodes: np.ndarray) -> np.ndarray:
        """Of the points, from those of nodes: (frames x) n x 3 to (frames x) points x 3, in their type."""
        weights = self.weights.astype(nodes.dtype)
        moved = weights[:, :1] * nodes[..., self.nodes[:, 0], :]
        for corner in range(1, 4):
            moved += weights[:, corner:corner + 1] * nodes[..., self.nodes[:, corner], :]
        return moved

    def basis(self, basis: np.ndarray) -> np.ndarray:
        """Of the points, from a body's basis: n x 3 x h to points x 3 x h."""
        moved = self.positions(np.moveaxis(basis, 2, 0))
        return np.ascontiguousarray(np.moveaxis(moved, 0, 2))


def _barycentric(points: np.ndarray, first: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    others = np.einsum("...ij,...j->...i", inverse, points - first)
    return np.concatenate([1 - others.sum(axis=-1, keepdims=True), others], axis=-1)


def _containing(points: np.ndarray, corners: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """The tet that each point lies in, -1: none. Tets are looked up by cells of a grid about as large as they are."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    size = np.maximum(np.median(high - low, axis=0), np.ptp(corners.reshape(-1, 3), axis=0).max() / 400 + 1e-300)
    origin = low.min(axis=0)
    first, last = (np.floor((edge - origin) / size + shift).astype(np.int64) for edge, shift in ((low, -1e-6), (high, 1e-6)))
    shape = last.max(axis=0) + 2
    counts = np.prod(last - first + 1, axis=1)
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
    wanted = np.where(within, _keys(at, shape), -1)
    found = np.full(len(points), -1, dtype=np.int64)
    by_key = np.argsort(wanted, kind="stable")
    for run in np.split(by_key, np.flatnonzero(np.diff(wanted[by_key])) + 1):
        key = wanted[run[0]] if len(run) else -1
        begin, end = np.searchsorted(keys, key), np.searchsorted(keys, key, side="right")
        if key < 0 or begin == end:
            continue
        candidates = tet[begin:end]
        for part in np.array_split(run, max(1, len(run) * len(candidates) * 12 // CHUNK)):
            weights = _barycentric(points[part][:, None], corners[candidates, 0], inverse[candidates])
            least = weights.min(axis=2)
            best = least.argmax(axis=1)
            inside = least[np.arange(len(part)), best] >= INSIDE
            found[part[inside]] = candidates[best[inside]]
    return found


def _keys(cells: np.ndarray, shape: np.ndarray) -> np.ndarray:
    x, y, z = (cells + 1).T
    return (x * (shape[1] + 2) + y) * (shape[2] + 2) + z


def _nearest(points: np.ndarray, nodes: np.ndarray, tets: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """The tet with the nearest boundary triangle, and how far that is."""
    faces = tets[:, CORNERS].reshape(-1, 3)
    _, index, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    boundary = index[counts == 1]
    triangles = nodes[faces[boundary]]
    middles = triangles.mean(axis=1)
    near = min(NEAR, len(boundary))
    tet, distance = np.zeros(len(points), dtype=np.int64), np.zeros(len(points))
    squares = (middles ** 2).sum(axis=1)
    for part in np.array_split(np.arange(len(points)), max(1, len(points) * len(boundary) // CHUNK)):
        apart = squares - 2 * points[part] @ middles.T
        chosen = np.argpartition(apart, near - 1, axis=1)[:, :near] if near < len(boundary) else \
            np.broadcast_to(np.arange(len(boundary)), (len(part), near))
        far = _distances(points[part][:, None], triangles[chosen])
        best = far.argmin(axis=1)
        rows = np.arange(len(part))
        tet[part] = boundary[chosen[rows, best]] // 4
        distance[part] = far[rows, best]
    return tet, distance


def _distances(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """m x k: of points (m x 1 x 3) from triangles (m x k x 3 x 3)."""
    normals = np.cross(triangles[..., 1, :] - triangles[..., 0, :], triangles[..., 2, :] - triangles[..., 0, :])
    sizes = np.maximum(np.linalg.norm(normals, axis=-1), 1e-300)
    least = np.full(normals.shape[:-1], np.inf)
    inside = np.ones(normals.shape[:-1], dtype=bool)
    for k in range(3):
        first, edge = triangles[..., k, :], triangles[..., (k + 1) % 3, :] - triangles[..., k, :]
        out = points - first
        share = (out * edge).sum(axis=-1) / np.maximum((edge * edge).sum(axis=-1), 1e-300)
        foot = out - np.clip(share, 0, 1)[..., None] * edge
        least = np.minimum(least, np.linalg.norm(foot, axis=-1))
        inside &= (np.cross(edge, out) * normals).sum(axis=-1) >= 0
    over = np.abs(((points - triangles[..., 0, :]) * normals).sum(axis=-1)) / sizes
    return np.where(inside, np.minimum(over, least), least)
