"""Scenes from files, meshio meshes, arrays and mappings."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any, Iterable, Mapping, Union

import numpy as np
from google.protobuf import json_format

from . import arrays, beams, checks, edits, keyframes, motions
from .errors import LimberError, invalid
from .mesh_files import mesh_file
from .messages import scene as messages

SceneLike = Union["messages.Scene", Mapping[str, Any], str, "os.PathLike[str]"]

def load_scene(path: "str | os.PathLike[str]") -> "messages.Scene":
    """Reads a scene file (JSON form of limber.v1.Scene) and puts the bytes of the files that it names (mesh, base
    motion, poses of keyframes) in place of their paths."""
    return _with_bytes(*_read_scene(path))


def _read_scene(path: "str | os.PathLike[str]") -> "tuple[messages.Scene, Path]":
    """A scene as its file says, and the folder that its paths are relative to."""
    path = checks.path(path, "scene")
    if beams.is_job(path):
        scene = messages.Scene()
        scene.beams.job.CopyFrom(beams.load_structure(path))
        return scene, path.parent
    try:
        text = motions.read(path, "scene").decode("utf-8-sig")
        scene = _parse(_each_key_once(json.loads(text, object_pairs_hook=_Pairs), "scene", str(path)), str(path))
    except ValueError as error:
        raise invalid("scene", f"{path} is not JSON: {error}") from error
    except RecursionError:
        raise invalid("scene", f"{path} is nested too deeply") from None
    return scene, path.parent


def with_mesh_bytes(scene: "messages.Scene", folder: "str | os.PathLike[str]" = ".") -> "messages.Scene":
    """The scene with mesh.path, taken from `folder`, replaced by the file's bytes; other meshes are left alone."""
    if scene.mesh.WhichOneof("source") == "path":
        scene.mesh.file.CopyFrom(mesh_file(Path(folder) / scene.mesh.path))
    return scene


def _with_bytes(scene: "messages.Scene", folder: "str | os.PathLike[str]" = ".") -> "messages.Scene":
    if scene.HasField("beams"):
        lines = scene.beams.lines
        if lines.WhichOneof("source") == "path":
            lines.file.CopyFrom(mesh_file(Path(folder) / lines.path, field="beams.lines.path"))
        return scene
    if scene.HasField("linkage"):
        lines = scene.linkage.lines
        if lines.WhichOneof("source") == "path":
            lines.file.CopyFrom(mesh_file(Path(folder) / lines.path, field="linkage.lines.path"))
        return scene
    for i, keyframe in enumerate(scene.keyframes):
        if keyframe.WhichOneof("pose") == "path":
            keyframe.file.CopyFrom(mesh_file(Path(folder) / keyframe.path, field=f"keyframes[{i}].path"))
    if scene.HasField("base_motion"):
        scene.base_motion.CopyFrom(motions.with_bytes(scene.base_motion, folder))
    return with_mesh_bytes(scene, folder)


def to_message(scene: SceneLike, *, base_motion: bool = True) -> "messages.Scene":
    """A scene from a message, a mapping (its JSON form; paths are taken from the current folder) or a scene file.

    base_motion: False leaves it out, unread.
    """
    made, folder = _as_given(scene)
    if not base_motion:
        made = messages.Scene.FromString(made.SerializeToString())  # the caller's keeps its own
        made.ClearField("base_motion")
    return _with_bytes(made, folder)


def _as_given(scene: SceneLike) -> "tuple[messages.Scene, Path]":
    if isinstance(scene, messages.Scene):
        return scene, Path(".")
    if isinstance(scene, Mapping):
        return _parse(scene, "scene"), Path(".")
    if isinstance(scene, (str, os.PathLike)):
        return _read_scene(scene)
    raise invalid("scene", f"a scene is a file name, a mapping or a message, not {type(scene).__name__}")


def scene_from_mesh(mesh: Any, **options: Any) -> "messages.Scene":
    """A scene from a meshio.Mesh (its tetrahedra; other cells are left out) or the path of a mesh file.

    The options are those of scene_from_arrays. A path is sent as it is and read by the server.
    """
    if isinstance(mesh, (str, os.PathLike)):
        scene = _scene(**options)
        scene.mesh.file.CopyFrom(mesh_file(mesh))
        scene.name = scene.name or Path(mesh).stem
        return scene
    if not hasattr(mesh, "cells") or not hasattr(mesh, "points"):
        raise invalid("mesh", f"a mesh is a meshio.Mesh or the path of a mesh file, not {mesh!r}")
    tets = [np.asarray(block.data) for block in mesh.cells if block.type == "tetra"]
    if not tets:
        kinds = ", ".join(sorted({block.type for block in mesh.cells})) or "nothing"
        raise invalid("mesh", f"this mesh has no tetrahedra (cells of type tetra); it has {kinds}")
    return scene_from_arrays(mesh.points, np.concatenate(tets), **options)


def scene_from_arrays(nodes: Any, tets: Any, **options: Any) -> "messages.Scene":
    """A scene from nodes (n x 3, length unit) and tets (m x 4, node ids from 0).

    Options (keyword only): name, frames (N >= 3, default 120), fixed_nodes (ids), youngs_modulus [Pa],
    poissons_ratio, density [kg/m^3], length_unit_in_metres, merge_tolerance, modes, tolerance, basis_size,
    cubature_size, first_end, last_end ("free", "position", "position_velocity"), frames_per_second, period_frames,
    damping_ratio, constraint_tolerance, optimise ("motion", "dynamics", "all"; see Session.optimise),
    candidate_modes, column_weight, max_frequency_hz and slow_steps (bounds of fitted frequencies), base_motion
    (frames x nodes x 3 positions, the path of a .pc2 or .pvd file, or a list of .vtu files, one per frame), keyframes
    (a list of limber.keyframe()), simulation (of limber.simulation()).
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
           simulation: "messages.Simulation | None" = None, keyframes: "Iterable[messages.Keyframe]" = (),
           **values: float) -> "messages.Scene":
    scene = messages.Scene(name=checks.text(name, "name"), frames=checks.whole(frames, "frames"),
                           fixed_nodes=checks.wholes(fixed_nodes, "fixed_nodes"))
    ends = edits.ends(first_end, last_end).set_ends
    scene.first_end, scene.last_end = ends.first_end, ends.last_end
    scene.material_optimisation.variables = edits.optimise(optimise).set_material.variables
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
    if simulation is not None:
        scene.simulation.CopyFrom(simulation)
    return scene


class _Pairs(list):
    """A JSON object as it was written: its keys may repeat."""


def _spelling(key: str) -> str:
    """fixed_nodes as fixedNodes; keys that can be no field (file names) as they are."""
    return re.sub(r"_([a-z])", lambda found: found[1].upper(), key) if key.isidentifier() else key


def _each_key_once(value: Any, field: str, what: str) -> Any:
    """json's objects as dicts; of a key that is given twice, json would take the last."""
    if isinstance(value, _Pairs):
        made: dict[str, Any] = {}
        spellings = set()
        for key, inner in value:
            if _spelling(key) in spellings:
                raise invalid(f"{field}.{key}", f"{what} is no scene: {key} is given twice")
            spellings.add(_spelling(key))
            made[key] = _each_key_once(inner, f"{field}.{key}", what)
        return made
    if isinstance(value, list):
        return [_each_key_once(inner, f"{field}[{i}]", what) for i, inner in enumerate(value)]
    return value


def _parse(value: Any, what: str) -> "messages.Scene":
    if not isinstance(value, Mapping):
        raise invalid("scene", f"{what} is no scene: a JSON object is expected")
    if "beams" not in value and ("nodes" in value or "elements" in value):  # scenes have none: a structure of beams alone
        value = {"beams": {"structure": value}}
    try:
        return json_format.ParseDict(checks.plain(value), messages.Scene())
    except (json_format.ParseError, TypeError, AttributeError) as error:
        field, why = checks.json_fault(error)
        raise invalid(f"scene{field}", f"{what} is no scene: {why}") from error
