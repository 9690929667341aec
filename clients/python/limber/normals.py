"""Normals of surfaces that move."""

from __future__ import annotations

from typing import Iterable

import numpy as np

CREASE = 45.0  # angle between triangles from which their edge is sharp [degree]


def of_vertices(faces: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Unit normals, vertices x 3: of the triangles (t x 3) around each vertex of `shape` (vertices x 3), by their areas. (0, 0, 1)
    where there are none."""
    areas = _areas(faces, shape)
    sums = np.stack([np.bincount(faces.ravel(), np.repeat(areas[:, axis], 3), len(shape)) for axis in range(3)], axis=1)
    lengths = np.linalg.norm(sums, axis=1)
    is_flat = lengths <= 1e-30
    sums[is_flat], lengths[is_flat] = (0, 0, 1), 1
    return sums / lengths[:, None]


def split_creases(faces: np.ndarray, shape: np.ndarray, degrees: float = CREASE) -> "tuple[np.ndarray, np.ndarray]":
    """Faces t x 3 of vertices that are there more than once where sharp edges meet, and of each vertex the given one that it is
    a copy of. The given vertices keep their numbers, copies follow."""
    normals = _areas(faces, shape)
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(lengths, 1e-300)[:, None]
    corners = np.arange(3 * len(faces)).reshape(-1, 3)
    starts, ends = corners.ravel(), corners[:, (1, 2, 0)].ravel()
    at = faces.ravel()
    is_turned = at[starts] > at[ends]
    low, high = np.where(is_turned, ends, starts), np.where(is_turned, starts, ends)
    order = np.lexsort((at[high], at[low]))
    low, high = low[order], high[order]
    one, other = low[:-1] // 3, low[1:] // 3
    is_smooth = (np.einsum("ij,ij->i", normals[one], normals[other]) >= np.cos(np.radians(degrees))) \
        | (lengths[one] == 0) | (lengths[other] == 0)
    joined = is_smooth & (at[low[:-1]] == at[low[1:]]) & (at[high[:-1]] == at[high[1:]])
    first = np.concatenate([low[:-1][joined], high[:-1][joined]])
    second = np.concatenate([low[1:][joined], high[1:][joined]])
    group = np.arange(3 * len(faces))  # of corners: the least one that it shares a vertex with
    while True:
        least = np.minimum(group[first], group[second])
        before = group.copy()
        np.minimum.at(group, first, least)
        np.minimum.at(group, second, least)
        group = group[group]
        if np.array_equal(group, before):
            break
    leaders = np.unique(group)
    is_copy = np.ones(len(leaders), dtype=bool)
    is_copy[np.unique(at[leaders], return_index=True)[1]] = False
    numbers = at[leaders].copy()
    numbers[is_copy] = len(shape) + np.arange(np.count_nonzero(is_copy))
    source = np.concatenate([np.arange(len(shape)), at[leaders[is_copy]]])
    return numbers[np.searchsorted(leaders, group)].reshape(-1, 3), source


def fitted(faces: np.ndarray, base: np.ndarray, shapes: Iterable[np.ndarray], weights: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """Normals of `base` (vertices x 3), and the increments of each target per weight (targets x vertices x 3). They are least
    squares of the normals of `shapes`, of each frame, under their weights (frames x targets)."""
    rest = of_vertices(faces, base)
    inverse = np.linalg.pinv(weights.astype(float), rcond=1e-5)
    added = np.zeros((weights.shape[1], *rest.shape))
    for share, shape in zip(inverse.T, shapes):
        change = of_vertices(faces, shape) - rest
        for target in np.flatnonzero(share):
            added[target] += share[target] * change
    return rest, added


def _areas(faces: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """For triangles: normals as long as twice their areas."""
    a, b, c = (np.asarray(shape, dtype=float)[faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)
