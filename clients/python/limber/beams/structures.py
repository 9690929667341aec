"""Structures of beams from files, mappings and messages, and jobs of the public relaxation code."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Mapping, Union

from google.protobuf import json_format

from .. import checks, json_values
from ..errors import invalid
from ..files import read
from ..messages import beam_structure, scene

BeamsLike = Union["beam_structure.BeamStructure", Mapping[str, Any], str, "os.PathLike[str]"]

JOB = "SimulationJob.json"
_SETTINGS = "DRMSettings.json"
_JOB_KEYS = ("mesh filename", "cross section dim", "beam material")  # any of them identifies a job


def is_job(path: Path) -> bool:
    """A job of the public relaxation code: its folder, or its SimulationJob.json."""
    return path.is_dir() or path.name == JOB


def load_structure(path: "str | os.PathLike[str]") -> "beam_structure.BeamStructure | scene.MeshFile":
    """A structure (JSON form of limber.v1.BeamStructure), that of a scene file, or a job of the public relaxation code. A job is
    its folder or its SimulationJob.json, with the mesh that it names and DRMSettings.json from the same folder."""
    path = checks.path(path, "structure")
    if path.is_dir():
        path = path / JOB
    content = read(path, "structure")
    try:
        value = json.loads(content)
    except ValueError as error:
        raise invalid("structure", f"{path} is not JSON: {error}") from error
    except RecursionError:
        raise invalid("structure", f"{path} is nested too deeply") from None
    if not isinstance(value, Mapping) or not (path.name == JOB or any(key in value for key in _JOB_KEYS)):
        return _parse(value, str(path))
    made = scene.MeshFile(name=path.name, content=content)
    if "mesh filename" in value:  # otherwise the server names the misspelt key
        mesh = Path(checks.text(value["mesh filename"], "job")).name  # a job does not reach out of its folder
        made.companions[mesh] = read(path.with_name(mesh), "job")
    if path.with_name(_SETTINGS).is_file():
        made.companions[_SETTINGS] = read(path.with_name(_SETTINGS), "job")
    return made


def _of_scene(drawn: "scene.Scene", what: str) -> "beam_structure.BeamStructure | scene.MeshFile":
    """Structure that is solved for a scene of beams when it is drawn."""
    if drawn.beams.HasField("lines"):
        raise invalid("structure.beams.lines", f"the nodes of {what} come from a file of lines: open() reads it")
    return drawn.beams.job if drawn.beams.HasField("job") else drawn.beams.structure


def _parse(value: Any, what: str) -> "beam_structure.BeamStructure | scene.MeshFile":
    if not isinstance(value, Mapping):
        raise invalid("structure", f"{what} is no structure: a JSON object is expected")
    try:
        if "beams" in value:
            return _of_scene(json_values.parse(value, scene.Scene()), what)
        return json_values.parse(value, beam_structure.BeamStructure())
    except (json_format.ParseError, TypeError, AttributeError) as error:
        path, why = checks.json_fault(error)
        raise invalid(f"structure{path}", f"{what} is no structure: {why}") from error


def structure_of(structure: BeamsLike) -> "beam_structure.BeamStructure | scene.MeshFile":
    """A structure, or a job with its files."""
    if isinstance(structure, (str, os.PathLike)):
        return load_structure(structure)
    return structure if isinstance(structure, beam_structure.BeamStructure) else _parse(structure, "the value")
