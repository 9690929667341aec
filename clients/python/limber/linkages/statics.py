"""Frames of the rods of a linkage at their stations."""

from __future__ import annotations

import numpy as np


def tangents(points: np.ndarray) -> np.ndarray:
    """At the points of a line, unit: between those of its edges."""
    edges = np.diff(points, axis=0)
    edges = edges / np.maximum(np.linalg.norm(edges, axis=1), 1e-300)[:, None]
    mean = np.concatenate([edges[:1], edges[:-1] + edges[1:], edges[-1:]])
    return mean / np.linalg.norm(mean, axis=1)[:, None]


def frames(points: np.ndarray, directors: np.ndarray) -> "tuple[np.ndarray, np.ndarray, np.ndarray]":
    """t, d1, d2 at stations, unit and at right angles."""
    t = tangents(points)
    d1 = directors - (directors * t).sum(axis=1)[:, None] * t
    d1 = d1 / np.linalg.norm(d1, axis=1)[:, None]
    return t, d1, np.cross(t, d1)
