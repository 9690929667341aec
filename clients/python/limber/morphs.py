"""Motions as a base shape and few morph targets with a weight for each frame."""

from __future__ import annotations

import numpy as np

GRAM = 600  # frames of which targets are made at once


def targets_of(positions: np.ndarray, tolerance: float, most: int,
               base: "np.ndarray | None" = None) -> "tuple[np.ndarray, np.ndarray, np.ndarray, float]":
    """positions: frames x vertices x 3; tolerance: largest distance of a vertex that may be left [length unit]; most: as many
    targets at most.

    Base (vertices x 3), targets (k x vertices x 3, added to the base) and weights (frames x k), all float32, and the largest
    distance that is left with these. `base`: the first frame if none is given.
    """
    frames, vertices = positions.shape[:2]
    base = np.array(positions[0] if base is None else base, dtype=np.float32)
    moved = positions.reshape(frames, -1).astype(np.float64) - base.reshape(1, -1).astype(np.float64)
    chosen = np.unique(np.linspace(0, frames - 1, min(frames, GRAM)).round().astype(int))
    while True:
        directions = _principal(moved[chosen])
        weights = moved @ directions.T
        count = _least(lambda k: _error(moved, weights[:, :k], directions[:k], vertices), min(len(directions), most), tolerance)
        found = _scaled(directions[:count], weights[:, :count], vertices)
        apart = _distances(moved, found[1], found[0].reshape(count, 3 * vertices), vertices)
        worst = apart.max(axis=1)
        if worst.max(initial=0) <= tolerance or count == most or len(chosen) == frames:
            return base, *found, float(worst.max(initial=0))
        chosen = np.unique(np.concatenate([chosen, np.argsort(-worst)[:GRAM // 4]]))


def sliders(positions: np.ndarray, tolerance: float, most: int) -> "tuple[np.ndarray, np.ndarray, np.ndarray, float]":
    """As targets_of(), of weights in [0, 1] and fewer targets than frames."""
    base, targets, weights, error = targets_of(positions, tolerance, most)
    targets, weights = one_sided(targets, weights)
    exact = of_frames(positions)
    if len(targets) < len(exact[1]):
        return base, targets, weights, error
    base, targets, weights = exact
    left = np.abs(base + np.einsum("fk,kvx->fvx", weights.astype(float), targets) - positions)
    return base, targets, weights, float(np.linalg.norm(left, axis=2).max(initial=0))


def one_sided(targets: np.ndarray, weights: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """The same with weights in [0, 1] alone, to which programs such as Blender cut them: a target whose weight has both signs
    becomes two, opposite to each other."""
    up, down = weights.max(axis=0, initial=0) > 0, weights.min(axis=0, initial=0) < 0
    return (np.concatenate([targets[up], -targets[down]]),
            np.concatenate([np.maximum(weights[:, up], 0), np.maximum(-weights[:, down], 0)], axis=1))


def of_frames(positions: np.ndarray) -> "tuple[np.ndarray, np.ndarray, np.ndarray]":
    """Base, targets and weights of which each frame but the first has one target, frames of one shape the same: exact, and fewer
    targets than frames."""
    shapes = positions.astype(np.float32)
    numbers: "dict[bytes, int]" = {}
    of_frame = [numbers.setdefault(shape.tobytes(), frame) for frame, shape in enumerate(shapes)]
    chosen = sorted(set(of_frame) - {0})
    weights = (np.array(of_frame)[:, None] == np.array(chosen, dtype=int)[None]).astype(np.float32)
    return shapes[0], (positions[chosen] - shapes[0].astype(np.float64)).astype(np.float32), weights


def _principal(moved: np.ndarray) -> np.ndarray:
    """Orthonormal directions, those with most motion first."""
    values, vectors = np.linalg.eigh(moved @ moved.T)
    order = [i for i in np.argsort(-values) if values[i] > 1e-14 * max(values.max(), 1e-300)]
    directions = vectors[:, order].T @ moved
    lengths = np.linalg.norm(directions, axis=1)
    directions = directions[lengths > 0] / lengths[lengths > 0][:, None]
    return np.linalg.qr(directions.T)[0].T if len(directions) else directions


def _distances(moved: np.ndarray, weights: np.ndarray, directions: np.ndarray, vertices: int) -> np.ndarray:
    """frames x vertices"""
    left = moved - weights.astype(np.float64) @ directions.astype(np.float64)
    return np.linalg.norm(left.reshape(len(moved), vertices, 3), axis=2)


def _error(moved: np.ndarray, weights: np.ndarray, directions: np.ndarray, vertices: int) -> float:
    return float(_distances(moved, weights, directions, vertices).max(initial=0))


def _least(error, most: int, tolerance: float) -> int:
    """The least count in [0, most] whose error is within the tolerance, else most; errors fall with the count, nearly."""
    low, high = -1, most
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if error(middle) <= 0.9 * tolerance else (middle, high)
    return high


def _scaled(directions: np.ndarray, weights: np.ndarray, vertices: int) -> "tuple[np.ndarray, np.ndarray]":
    """Weights within [-1, 1], as programs with sliders for them expect."""
    sizes = np.maximum(np.abs(weights).max(axis=0, initial=0), 1e-300)
    return ((directions * sizes[:, None]).reshape(-1, vertices, 3).astype(np.float32), (weights / sizes).astype(np.float32))
