"""What the rods of a linkage do to its joints: forces and moments at the ends of segments, from what segments carry."""

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


def end_forces(points: np.ndarray, directors: np.ndarray, axial: np.ndarray, bending: np.ndarray, torque: np.ndarray,
               weight: np.ndarray, pulls: "list[tuple[float, np.ndarray]]") -> np.ndarray:
    """What a segment does to what it is joined to: forces at its ends [N], then moments [N m], 4 x 3.

    A rod in equilibrium has one force and one moment to be known; these are fitted to the moments and axial forces of all
    stations between the ends. Transverse forces are no field of a station: they follow from how moments change; of a segment
    of two edges, which is very short, they are not known and taken to be as small as they can be.

    points, directors: of stations [m], 1; axial: [N]; bending: stations x 2, torque: [N m]; weight: of the segment per
    length [N/m]; pulls: (share of the length, force [N]) of springs at it.
    """
    t, d1, d2 = frames(points, directors)
    moments = bending[:, :1] * d2 - bending[:, 1:] * d1 + torque[:, None] * t
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    extent = along[-1]
    # What the force has lost since the start, and its moment: n = n0 - lost, m = m0 - (x - x0) x n0 + turned.
    lost = along[:, None] * weight
    for share, force in pulls:
        lost = lost + (along >= share * extent)[:, None] * force
    turned = np.concatenate([np.zeros((1, 3)), np.cumsum(np.cross(steps, (lost[1:] + lost[:-1]) / 2), axis=0)])
    rows, values = [], []
    for j in range(1, len(points) - 1):
        x, y, z = points[j] - points[0]
        arm = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])  # arm @ n = (x - x0) x n
        rows.append(np.hstack([-arm / extent, np.eye(3)]))
        values.append((moments[j] - turned[j]) / extent)
        # The edges at joints are of two segments: what a station beside one has is the mean of both.
        if 2 <= j <= len(points) - 3 or len(points) < 5:
            rows.append(np.concatenate([t[j], np.zeros(3)])[None])
            values.append(np.array([axial[j] + lost[j] @ t[j]]))
    fit = np.linalg.lstsq(np.vstack(rows), np.concatenate(values), rcond=None)[0]
    force, moment = fit[:3], fit[3:] * extent
    last = moment - np.cross(points[-1] - points[0], force) + turned[-1]
    return np.stack([force, -(force - lost[-1]), moment, -last])
