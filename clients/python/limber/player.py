"""A motion and the player of it in one .html, which needs neither a server nor a network."""

from __future__ import annotations

import base64
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import checks, obj_files
from .errors import LimberError, invalid, not_there, of_file
from .messages import service
from .saving import Saved

if TYPE_CHECKING:
    from .open_session import OpenSession

VERSION = 1       # of the player's input
LEVELS = 65535    # of numbers in 16 bits
TEMPLATE = Path(__file__).with_name("data") / "player.html"
PLACE = '"/*motion*/"'


@dataclass(frozen=True)
class Played:
    """A motion as the player takes it: made by each kind. Its numbers are of single precision, so that a motion far from the
    origin is relative to its middle."""

    kind: str                # by which the player draws: "bodies", "linkages", "beams"
    title: str
    up: str                  # of the scene: "y" or "z"
    rate: float              # frames a second
    frame_name: str          # name of a frame
    geometry: "service.GetGeometryResponse"
    frames: np.ndarray       # frames x numbers
    points: np.ndarray       # frames x points x 3: points that the picture is to hold [length unit]
    basis: "np.ndarray | None" = None  # of a body: (3 vertices) x numbers of a frame [length unit]
    structure: bytes = b""   # of beams: a BeamStructure


def save(session: "OpenSession", path: "str | os.PathLike[str]", *, tolerance: float, up: "str | None",
         frames_per_second: "float | None", surface: "str | os.PathLike[str] | None") -> Saved:
    """See OpenSession.save_html()."""
    target = checks.path(path, "path")
    checks.one_of(target.suffix.lower(), (".html", ".htm"), "path")
    text, saved = document(session, tolerance=tolerance, up=up, frames_per_second=frames_per_second, surface=surface)
    try:
        target.write_text(text, encoding="utf-8")
    except OSError as error:
        raise of_file(error, f"{target} cannot be written", "path") from error
    return Saved((target,), *saved)


def document(session: "OpenSession", *, tolerance: float, up: "str | None" = None, frames_per_second: "float | None" = None,
             surface: "str | os.PathLike[str] | None" = None,
             frame: "int | None" = None) -> "tuple[str, tuple[int, int, int, float]]":
    """The page, and of Saved all but the files. frame: that the picture is to hold, negative ones from the end; all by default."""
    if not 0 < checks.real(tolerance, "tolerance") <= 1:
        raise invalid("tolerance", f"tolerance must be in (0, 1], is {tolerance}")
    if up is not None:
        checks.one_of(up, ("y", "z"), "up")
    if frames_per_second is not None and not 0 < checks.real(frames_per_second, "frames_per_second") < float("inf"):
        raise invalid("frames_per_second", f"frames_per_second must be > 0, is {frames_per_second}")
    template = _template()
    drawn = None if surface is None else obj_files.load(checks.path(surface, "surface"), "surface")
    played = session.played(tolerance, None if drawn is None else (drawn.vertices, drawn.corners))
    count = len(played.frames)
    if frame is not None and not -count <= checks.real(frame, "frame") < count:
        raise LimberError("OUT_OF_RANGE", f"frame {frame}: there are {count}, from 0", "frame")
    frames, kept = _pack(played.frames)
    seen = (played.points if frame is None else played.points[checks.whole(frame % count, "frame")]).reshape(-1, 3)
    low, high = seen.min(axis=0), seen.max(axis=0)
    motion: "dict[str, Any]" = {
        "version": VERSION, "kind": played.kind, "title": played.title, "up": up or played.up,
        "rate": frames_per_second or played.rate, "frameName": played.frame_name, "low": low.astype(float).tolist(),
        "high": high.astype(float).tolist(), "geometry": _text(played.geometry.SerializeToString()), "frames": frames}
    if played.structure:
        motion["structure"] = _text(played.structure)
    targets, error = 0, float(np.abs(kept - played.frames).max(initial=0))
    if played.basis is not None:
        motion["basis"], basis = _pack(played.basis)
        targets, error = basis.shape[1], _error(played, basis, kept)
    embedded = json.dumps(motion, separators=(",", ":")).replace("<", "\\u003c")
    return template.replace(PLACE, embedded, 1), (count, played.points.shape[1], targets, error)


def _template() -> str:
    try:
        return TEMPLATE.read_text(encoding="utf-8")
    except OSError as error:
        raise not_there(f"this limber was built without the player of motions ({TEMPLATE}); scripts/build-web makes it",
                        "") from error


def _text(content: bytes) -> str:
    return base64.b64encode(content).decode()


def _pack(values: np.ndarray) -> "tuple[dict[str, Any], np.ndarray]":
    """rows x columns in 16 bits, evenly between the ends of each column; and the player's values of them."""
    wide = np.asarray(values, dtype=np.float64)
    low = wide.min(axis=0, initial=np.inf) if len(wide) else np.zeros(wide.shape[1])
    low = low.astype("<f4")
    step = ((wide.max(axis=0, initial=-np.inf) - low) / LEVELS).astype("<f4")
    # If all rows are the same, and that is beyond single precision, the divisor would be 0.
    numbers = np.rint((wide - low) / np.where(step > 0, step, 1)).clip(0, LEVELS).astype("<u2")
    packed = {"rows": wide.shape[0], "columns": wide.shape[1], "low": _text(low.tobytes()), "step": _text(step.tobytes()),
              "numbers": _text(numbers.tobytes())}
    return packed, low.astype(np.float64) + step.astype(np.float64) * numbers


def _error(played: Played, basis: np.ndarray, frames: np.ndarray) -> float:
    """The largest distance of a vertex from the motion [length unit]."""
    rest = np.frombuffer(played.geometry.rest.data, dtype="<f4")
    worst = 0.0
    for numbers, points in zip(frames, played.points):
        apart = (rest + basis @ numbers).reshape(-1, 3) - points
        worst = max(worst, float(np.linalg.norm(apart, axis=1).max(initial=0)))
    return worst
