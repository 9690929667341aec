"""Scenes of every kind from files, mappings and messages."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any, Mapping, Union

from google.protobuf import json_format

from . import checks, json_values, kind
from .errors import LimberError, invalid
from .files import read
from .messages import scene as messages

SceneLike = Union["messages.Scene", Mapping[str, Any], str, "os.PathLike[str]"]


def load_scene(path: "str | os.PathLike[str]") -> "messages.Scene":
    """Reads a scene file (JSON form of limber.v1.Scene) and puts the bytes of the files that it names (mesh, base
    motion, poses of keyframes) in place of their paths."""
    return _with_bytes(*_read_scene(path))


def _read_scene(path: "str | os.PathLike[str]") -> "tuple[messages.Scene, Path]":
    """A scene as its file says, and the folder that its paths are relative to."""
    path = checks.path(path, "scene")
    for known in kind.every():
        job = known.read_job(path)
        if job is not None:
            return job, path.parent
    try:
        text = read(path, "scene").decode("utf-8-sig")
        scene = _parse(_each_key_once(json.loads(text, object_pairs_hook=_Pairs), "scene", str(path)), str(path))
    except LimberError:
        raise
    except ValueError as error:
        raise invalid("scene", f"{path} is not JSON: {error}") from error
    except RecursionError:
        raise invalid("scene", f"{path} is nested too deeply") from None
    return scene, path.parent


def _with_bytes(scene: "messages.Scene", folder: Path) -> "messages.Scene":
    kind.of(scene).upload_files(scene, folder)
    return scene


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
    for known in kind.every():
        value = known.as_scene(value)
    try:
        return json_values.parse(value, messages.Scene())
    except (json_format.ParseError, TypeError, AttributeError) as error:
        field, why = checks.json_fault(error)
        raise invalid(f"scene{field}", f"{what} is no scene: {why}") from error


def describe_material(scene: "messages.Scene", material: "messages.Material") -> str:
    """A part of a message: values of a scene, as the server has it, and of its material."""
    return (f"Young's modulus {material.youngs_modulus:.3g} Pa, Poisson's ratio {material.poissons_ratio:.3g}, "
            f"{material.density:.4g} kg/m3, 1 unit = {scene.length_unit_in_metres:.4g} m")
