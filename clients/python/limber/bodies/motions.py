"""Base motions from arrays and files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from .. import arrays, checks
from ..errors import invalid
from ..files import read
from ..messages import scene as messages


def base_motion(value: Any) -> "messages.BaseMotion":
    """A base motion from positions (frames x nodes x 3), the path of a .pc2 or .pvd file, or a list of paths of .vtu files, one
    for every frame in order. The result of animated_pins() is accepted too."""
    if isinstance(value, messages.BaseMotion):
        return value
    if isinstance(value, (str, os.PathLike)):
        return with_bytes(messages.BaseMotion(path=str(checks.path(value, "base_motion.path"))))
    if isinstance(value, (list, tuple)) and value and all(isinstance(item, (str, os.PathLike)) for item in value):
        return with_bytes(messages.BaseMotion(vtu_series=messages.VtuSeries(paths=[str(item) for item in value])))
    positions = checks.numeric(value, "base_motion")
    return messages.BaseMotion(positions=arrays.to_message(positions, np.float64))


def animated_pins(positions: Any) -> "messages.BaseMotion":
    """A base motion of paths of the scene's fixed nodes, frames x fixed nodes x 3 in their order [length unit]. The other nodes
    follow: as a rigid body, and by the remaining motion of the pins, evenly spread between them."""
    paths = checks.numeric(positions, "base_motion.pins")
    return messages.BaseMotion(pins=arrays.to_message(paths, np.float64))


def with_bytes(motion: "messages.BaseMotion", folder: "str | os.PathLike[str]" = ".") -> "messages.BaseMotion":
    """The motion with the bytes of the files that it names, which are taken from `folder`, in place of their paths."""
    source = motion.WhichOneof("source")
    made = _source_with_bytes(motion, source, folder)
    if motion.HasField("inertia"):
        made.inertia = motion.inertia
    return made


def _source_with_bytes(motion: "messages.BaseMotion", source: "str | None",
                       folder: "str | os.PathLike[str]") -> "messages.BaseMotion":
    if source == "path":
        return _read_path(Path(folder) / motion.path)
    if source == "vtu_series" and motion.vtu_series.paths:
        series = messages.VtuSeries()
        for i, name in enumerate(motion.vtu_series.paths):
            series.files.add(name=name, content=read(Path(folder) / name, f"base_motion.vtu_series.paths[{i}]"))
        return messages.BaseMotion(vtu_series=series)
    return motion


def _read_path(path: Path) -> "messages.BaseMotion":
    field = "base_motion.path"
    ending = path.suffix.lower()
    if ending == ".pc2":
        return messages.BaseMotion(pc2=read(path, field))
    if ending != ".pvd":
        raise invalid(field, f"{path} is neither a .pc2 nor a .pvd; .vtu files are given as a list, one per frame")
    content = read(path, field)
    try:
        sets = ElementTree.fromstring(content).iter("DataSet")
        series = messages.VtuSeries(pvd=content.decode("utf-8"))
    except (ElementTree.ParseError, UnicodeDecodeError) as error:
        raise invalid(field, f"{path} is no .pvd: {error}") from error
    for name in dict.fromkeys(item.get("file", "") for item in sets):  # the server parses its other attributes
        series.files.add(name=name, content=read(path.parent / name, field))
    return messages.BaseMotion(vtu_series=series)
