"""Which precision positions need: far from the origin, float32 has too few digits."""

from __future__ import annotations

import numpy as np

FAR_SIZES = 8  # coordinates beyond so many times the size need float64; the server's rule


def is_far(points: np.ndarray) -> bool:
    """points: (..., 3). Whether float32 would round them by more than half a millionth of their size."""
    flat = points.reshape(-1, 3)
    if not len(flat):
        return False
    return bool(np.abs(flat).max() > FAR_SIZES * np.ptp(flat, axis=0).max())


def origin_for(points: np.ndarray) -> np.ndarray:
    """float64: the middle of the box around the points if they are far, else zeros. Values in single precision are written
    relative to it."""
    flat = points.reshape(-1, 3)
    if not is_far(flat):
        return np.zeros(3)
    return (flat.min(axis=0).astype(float) + flat.max(axis=0)) / 2


def relative(points: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """points - origin, float32."""
    return (points.astype(float) - origin).astype(np.float32) if origin.any() else points.astype(np.float32)
