"""Materials of single tets, as a session reports them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..messages import scene as messages


@dataclass(frozen=True)
class TetMaterials:
    """One row for each tet."""

    youngs_modulus: np.ndarray  # [Pa]
    poissons_ratio: np.ndarray
    density: np.ndarray         # [kg/m^3]

    @property
    def mu(self) -> np.ndarray:
        """Lame's second parameter, the shear modulus [Pa]."""
        return self.youngs_modulus / (2 * (1 + self.poissons_ratio))

    @property
    def lam(self) -> np.ndarray:
        """Lame's first parameter [Pa]."""
        poisson = self.poissons_ratio
        return self.youngs_modulus * poisson / ((1 + poisson) * (1 - 2 * poisson))

    def __getitem__(self, tets: np.ndarray) -> "TetMaterials":
        return TetMaterials(self.youngs_modulus[tets], self.poissons_ratio[tets], self.density[tets])


def of_scene(scene: "messages.Scene", tet_count: int) -> TetMaterials:
    """scene: as a session reports it, with material groups for the materials of its mesh file, too."""
    rows = np.tile(_row(scene.material), (tet_count, 1))
    for group in scene.material_groups:
        rows[np.array(group.tets, dtype=np.int64)] = _row(group.material)
    return TetMaterials(*rows.T)


def _row(material: "messages.Material") -> "tuple[float, float, float]":
    return material.youngs_modulus, material.poissons_ratio, material.density
