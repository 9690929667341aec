"""Strains and stresses of tets, for pictures."""

from __future__ import annotations

import numpy as np

from .tet_materials import TetMaterials


def gradients(rest: np.ndarray, tets: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Deformation gradient of each tet, tets x 3 x 3."""
    drawn, moved = (np.swapaxes(points[tets[:, 1:]] - points[tets[:, :1]], 1, 2).astype(float)
                    for points in (rest, positions))
    return moved @ np.linalg.inv(drawn)


def largest_strain(gradient: np.ndarray) -> np.ndarray:
    """By which a tet is stretched or squeezed the most: the largest |principal stretch - 1|."""
    return np.abs(np.linalg.svd(gradient, compute_uv=False) - 1).max(axis=1)


def von_mises(gradient: np.ndarray, materials: TetMaterials) -> np.ndarray:
    """Equivalent of the true stress of St. Venant-Kirchhoff materials, one for each gradient [Pa]."""
    identity = np.eye(3)
    strain = (np.swapaxes(gradient, 1, 2) @ gradient - identity) / 2
    lam, mu = (values[:, None, None] for values in (materials.lam, materials.mu))
    second = 2 * mu * strain + lam * np.trace(strain, axis1=1, axis2=2)[:, None, None] * identity
    volume = np.maximum(np.abs(np.linalg.det(gradient)), 1e-12)
    stress = gradient @ second @ np.swapaxes(gradient, 1, 2) / volume[:, None, None]
    deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3 * identity
    return np.sqrt(1.5 * (deviator ** 2).sum(axis=(1, 2)))


def tets_of(faces: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """The tet that each boundary triangle belongs to."""
    sides = np.sort(tets[:, [(1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2)]].reshape(-1, 3), axis=1)
    size = int(tets.max()) + 1

    def keys(rows: np.ndarray) -> np.ndarray:
        return (rows[:, 0].astype(np.int64) * size + rows[:, 1]) * size + rows[:, 2]

    found = keys(sides)
    order = np.argsort(found, kind="stable")
    return order[np.searchsorted(found[order], keys(np.sort(faces, axis=1)))] // 4
