"""Scenes of elastic bodies from meshio meshes, mesh files and arrays."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Iterable

import numpy as np

from .. import arrays, checks
from ..errors import LimberError, invalid
from ..files import mesh_file, surface_beside, surface_file
from ..messages import scene as messages
from . import edits, mesh_groups, motions
from .stiffness import painted_stiffness, stiffness_file


def upload_files(scene: "messages.Scene", folder: Path) -> None:
    """Mesh, base motion and poses of keyframes: bytes in place of the paths in a scene."""
    for i, keyframe in enumerate(scene.keyframes):
        if keyframe.WhichOneof("pose") == "path":
            keyframe.file.CopyFrom(mesh_file(folder / keyframe.path, field=f"keyframes[{i}].path"))
    if scene.HasField("base_motion"):
        scene.base_motion.CopyFrom(motions.with_bytes(scene.base_motion, folder))
    if scene.mesh.WhichOneof("source") == "path":
        scene.mesh.file.CopyFrom(mesh_file(folder / scene.mesh.path))
    if scene.surface.WhichOneof("source") == "path":
        scene.surface.file.CopyFrom(surface_file(folder / scene.surface.path))
    if scene.painted_stiffness.WhichOneof("source") == "path":
        scene.painted_stiffness.file.CopyFrom(stiffness_file(folder / scene.painted_stiffness.path, "painted_stiffness.path"))


def paint(scene: "messages.Scene", stiffness: Any) -> None:
    """stiffness: as painted_stiffness() takes or returns it."""
    made = stiffness if isinstance(stiffness, messages.PaintedStiffness) else painted_stiffness(stiffness)
    scene.painted_stiffness.CopyFrom(made)


def scene_from_mesh(mesh: Any, **options: Any) -> "messages.Scene":
    """A scene from a meshio.Mesh (its tetrahedra; other cells are left out) or the path of a mesh file.

    The options are those of scene_from_arrays, and `materials`: by names of groups (physical groups, element sets) pairs or
    triples of Young's modulus [Pa], Poisson's ratio and density [kg/m^3]. For a meshio.Mesh the cell data youngs_modulus,
    poissons_ratio and density are the materials of its tets; groups that get no material are a limber.MaterialWarning. With
    `materials`, a path is read by the Python package meshio. Otherwise a path is sent unchanged and read by the server, with the
    surface in the same folder, STEM.surface.obj, .ply, .stl, .off or .glb.
    """
    if isinstance(mesh, (str, os.PathLike)) and options.get("materials"):
        mesh = mesh_groups.read(mesh)
    if isinstance(mesh, (str, os.PathLike)):
        scene = _scene(**options)
        scene.mesh.file.CopyFrom(mesh_file(mesh))
        beside = surface_beside(Path(mesh))
        if beside and not scene.HasField("surface"):
            scene.surface.file.CopyFrom(surface_file(beside))
        scene.name = scene.name or Path(mesh).stem
        return scene
    if not hasattr(mesh, "cells") or not hasattr(mesh, "points"):
        raise invalid("mesh", f"a mesh is a meshio.Mesh or the path of a mesh file, not {mesh!r}")
    tets = [np.asarray(block.data) for block in mesh.cells if block.type == "tetra"]
    if not tets:
        kinds = ", ".join(sorted({block.type for block in mesh.cells})) or "nothing"
        raise invalid("mesh", f"this mesh has no tetrahedra (cells of type tetra); it has {kinds}")
    materials = options.pop("materials", None)
    scene = scene_from_arrays(mesh.points, np.concatenate(tets), **options)
    mesh_groups.add_materials(scene, mesh, materials)
    return scene


def scene_from_arrays(nodes: Any, tets: Any, **options: Any) -> "messages.Scene":
    """A scene from nodes (n x 3, length unit) and tets (m x 4, node ids from 0).

    Options (keyword only): name, frames (N >= 3, default 120), fixed_nodes (ids), youngs_modulus [Pa], poissons_ratio, density
    [kg/m^3], length_unit_in_metres, merge_tolerance, modes, tolerance, basis_size, cubature_size, first_end, last_end ("free",
    "position", "position_velocity"; both "cyclic": a loop), frames_per_second, period_frames, damping_ratio, discretisation
    ("sampled", "differences"), force_smoothing [s], constraint_tolerance, optimise ("motion", "dynamics", "all"; see
    Session.optimise), candidate_modes, column_weight, max_frequency_hz and slow_steps (bounds of fitted frequencies), base_motion
    (frames x nodes x 3 positions, the path of a .pc2 or .pvd file, or a list of .vtu files, one per frame), keyframes (a list of
    limber.keyframe()), simulation (of limber.simulation()), surface (path of an .obj, .ply, .stl, .off or .glb that the body
    carries along with its own vertices), stiffness (of single tets, by a factor at each vertex of the surface or node: as
    limber.painted_stiffness() takes or returns it).
    """
    nodes = checks.numeric(nodes, "mesh.arrays.nodes")
    tets = checks.numeric(tets, "mesh.arrays.tets")
    if nodes.ndim != 2 or nodes.shape[1] != 3:
        raise invalid("mesh.arrays.nodes", f"nodes have the shape {nodes.shape}, not (n, 3)")
    if tets.ndim != 2 or tets.shape[1] != 4 or not np.issubdtype(tets.dtype, np.integer):
        raise invalid("mesh.arrays.tets", f"tets are {tets.dtype} of shape {tets.shape}, not integers of shape (m, 4)")
    outside = np.argwhere((tets < 0) | (tets >= len(nodes)))
    if len(outside):
        tet, corner = outside[0]
        raise LimberError("OUT_OF_RANGE", f"tet {tet} names node {tets[tet, corner]}; the mesh has "
                                          f"{len(nodes)} nodes, from 0", f"mesh.tets[{tet}]")
    scene = _scene(**options)
    scene.mesh.arrays.nodes.CopyFrom(arrays.to_message(nodes, np.float64))
    scene.mesh.arrays.tets.CopyFrom(arrays.to_message(tets, np.int32))
    return scene


def _scene(*, name: str = "", frames: int = 120, fixed_nodes: Iterable[int] = (), first_end: str = "position_velocity",
           last_end: str = "position_velocity", base_motion: Any = None, optimise: str = "motion",
           simulation: "messages.Simulation | None" = None, surface: Any = None, stiffness: Any = None,
           keyframes: "Iterable[messages.Keyframe]" = (), discretisation: str | None = None,
           **values: float) -> "messages.Scene":
    scene = messages.Scene(name=checks.text(name, "name"), frames=checks.whole(frames, "frames"),
                           fixed_nodes=checks.wholes(fixed_nodes, "fixed_nodes"))
    ends = edits.ends(first_end, last_end).set_ends
    scene.first_end, scene.last_end = ends.first_end, ends.last_end
    scene.material_optimisation.variables = edits.optimise(optimise).set_material.variables
    if discretisation is not None:
        scene.dynamics.discretisation = edits.dynamics(discretisation=discretisation).values["discretisation"]
    for key, value in values.items():
        for part in (scene, scene.material, scene.dynamics, scene.model, scene.material_optimisation):
            field = part.DESCRIPTOR.fields_by_name.get(key)
            if field is not None and field.message_type is None:
                is_real = field.cpp_type in (field.CPPTYPE_DOUBLE, field.CPPTYPE_FLOAT)
                setattr(part, key, checks.real(value, key) if is_real else checks.whole(value, key))
                break
        else:
            raise TypeError(f"a scene has no option {key!r}")
    if base_motion is not None:
        scene.base_motion.CopyFrom(motions.base_motion(base_motion))
    scene.keyframes.extend(checks.several(keyframes, "keyframes"))
    if surface is not None:
        scene.surface.file.CopyFrom(surface_file(surface))
    if stiffness is not None:
        paint(scene, stiffness)
    if simulation is not None:
        scene.simulation.CopyFrom(simulation)
    return scene
