"""Materials and groups of tets that a meshio.Mesh has."""

from __future__ import annotations

import os
import warnings
from typing import Any, Mapping, Sequence

import numpy as np

from .. import checks
from ..errors import LimberError, invalid
from ..messages import scene as messages
from ..open_session import MaterialWarning

FIELDS = ("youngs_modulus", "poissons_ratio", "density")
GROUP_DATA = ("gmsh:physical", "medit:ref", "material", "MaterialIds", "region", "cell_tags")
VOLUME = 3  # dimension of a physical group


def material(numbers: "Sequence[float]") -> "messages.Material":
    """Material of (E [Pa], nu) or (E, nu, density [kg/m^3])."""
    values = [checks.real(number, "materials") for number in checks.several(numbers, "materials")]
    if len(values) not in (2, 3):
        raise invalid("materials", f"a material is Young's modulus, Poisson's ratio and density, not {numbers!r}")
    return messages.Material(**dict(zip(FIELDS, values)))


def read(path: "str | os.PathLike[str]") -> Any:
    """A file as a meshio.Mesh, which knows the names of its groups."""
    try:
        import meshio
    except ImportError as error:
        raise LimberError("UNSUPPORTED", f"materials of groups in a file need the Python package meshio (python3-meshio): {error}",
                          "materials") from error
    try:
        return meshio.read(path)
    except (meshio.ReadError, OSError) as error:
        raise LimberError("IO", f"meshio cannot read {os.fspath(path)}: {error}", "mesh") from error


def _of_tets(mesh: Any, values: "Sequence[Any]") -> np.ndarray:
    """Cell data, a block each, of the tets alone."""
    return np.concatenate([np.asarray(part) for block, part in zip(mesh.cells, values) if block.type == "tetra"])


def groups_of(mesh: Any) -> "dict[str, np.ndarray]":
    """Ids of tets by the names of their groups, or by their numbers where those have no names."""
    found: "dict[str, np.ndarray]" = {}
    names = {int(number): name for name, (number, dimension) in (mesh.field_data or {}).items() if int(dimension) == VOLUME}
    data = next((mesh.cell_data[name] for name in GROUP_DATA if name in mesh.cell_data), None)
    if data is not None:
        numbers = _of_tets(mesh, data)
        if numbers.ndim == 1:
            for number in np.unique(numbers).tolist():
                found[names.get(int(number), str(int(number)))] = np.flatnonzero(numbers == number)
    for name, parts in (getattr(mesh, "cell_sets", None) or {}).items():
        tets, first = [], 0
        for block, part in zip(mesh.cells, parts):
            if block.type == "tetra":
                if part is not None:
                    tets.append(first + np.asarray(part, dtype=np.int64))
                first += len(block.data)
        if tets and not name.startswith("gmsh:"):
            found.setdefault(name, np.concatenate(tets))
    count = sum(len(block.data) for block in mesh.cells if block.type == "tetra")
    return {name: tets for name, tets in found.items() if 0 < len(tets) and (len(tets) < count or name in names.values())}


def add_materials(scene: "messages.Scene", mesh: Any, materials: "Mapping[str, Sequence[float]] | None") -> None:
    """To a scene of the mesh's tets: those of its cell data, else those that are given for its groups."""
    groups = groups_of(mesh)
    for name, numbers in (materials or {}).items():
        if name not in groups:
            raise LimberError("NOT_FOUND", f"the mesh has no group {name!r}; it has {', '.join(groups) or 'none'}", "materials")
        scene.material_groups.add(material=material(numbers), tets=groups[name].tolist())
    if materials:
        return
    if all(field in mesh.cell_data for field in FIELDS[:2]):
        columns = [_of_tets(mesh, mesh.cell_data[field]) for field in FIELDS if field in mesh.cell_data]
        rows, number = np.unique(np.stack(columns, axis=1).astype(float), axis=0, return_inverse=True)
        for i, row in enumerate(rows.tolist()):
            scene.material_groups.add(material=material(row), tets=np.flatnonzero(number.ravel() == i).tolist())
    elif groups:
        listed = ", ".join(f"{name} ({len(tets)} tets)" for name, tets in list(groups.items())[:10])
        warnings.warn(f"the mesh has groups of tets without a material: {listed}. All of them get the scene's material; "
                      "the option `materials` gives them their own", MaterialWarning, stacklevel=4)
