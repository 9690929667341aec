"""Pictures of sessions of every kind, coloured by their results, drawn by matplotlib without a display."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Sequence

import numpy as np

from . import checks
from .errors import LimberError, invalid, of_file

if TYPE_CHECKING:
    from .open_session import OpenSession

ENDINGS = (".png", ".svg", ".pdf")
COLOUR = "#c9a35c"  # where nothing is coloured
LIGHT = np.array([-0.45, 0.55, 0.7])
MAP = "viridis"


@dataclass(frozen=True)
class Coloured:
    """A surface in one frame, and a number for each of its triangles."""

    faces: np.ndarray      # triangles x 3
    positions: np.ndarray  # vertices x 3 [length unit]
    values: np.ndarray     # triangles; empty: no colours
    label: str             # of the values, with their unit


def of_vertices(faces: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Value of each triangle, the mean of its vertices."""
    return values[faces].mean(axis=1)


def draw(session: "OpenSession", path: "str | os.PathLike[str]", *, colour: str, frame: int, view: Sequence[float],
         up: str, size: Sequence[float], title: str, limits: "Sequence[float] | None",
         yield_stress: "float | None") -> Path:
    """See OpenSession.picture()."""
    target = checks.path(path, "path")
    checks.one_of(target.suffix.lower(), ENDINGS, "path")
    checks.one_of(colour, session.COLOURS, "colour")
    checks.one_of(up, ("y", "z"), "up")
    azimuth, elevation = _two(view, "view")
    width, height = _two(size, "size")
    if not (0 < width <= 100 and 0 < height <= 100):
        raise invalid("size", f"size is width and height in inches, in (0, 100], not {size!r}")
    if yield_stress is not None and not checks.real(yield_stress, "yield_stress") > 0:
        raise invalid("yield_stress", f"yield_stress must be > 0 Pa, is {yield_stress}")
    shape = session.coloured(colour, frame, yield_stress)
    bounds = None if limits is None else _two(limits, "limits")
    try:
        import matplotlib.figure
        from matplotlib.backends.backend_agg import FigureCanvasAgg
    except ImportError as error:
        raise LimberError("UNSUPPORTED", f"pictures need the Python package matplotlib (python3-matplotlib): {error}") from error
    figure = matplotlib.figure.Figure(figsize=(width, height), dpi=120)
    FigureCanvasAgg(figure)  # no display
    _draw(figure, shape, _axes(azimuth, elevation, up), bounds, checks.text(title, "title"))
    try:
        figure.savefig(target)
    except OSError as error:
        raise of_file(error, f"{target} cannot be written", "path") from error
    return target


def _two(values: "Sequence[float]", field: str) -> "tuple[float, float]":
    given = [checks.real(value, field) for value in checks.several(values, field)]
    if len(given) != 2 or not np.isfinite(given).all():
        raise invalid(field, f"{field} are two numbers, not {values!r}")
    return given[0], given[1]


def _axes(azimuth: float, elevation: float, up: str) -> np.ndarray:
    """Rows: to the right, up, and towards the eye, which is far away."""
    a, e = np.radians(azimuth), np.radians(elevation)
    right = np.array([-np.sin(a), np.cos(a), 0])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    rows = np.stack([right, np.cross(eye, right), eye])
    return rows if up == "z" else rows @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # y to z


def _draw(figure, shape: Coloured, axes: np.ndarray, bounds: "tuple[float, float] | None", title: str) -> None:
    from matplotlib import cm, collections, colors
    seen = shape.positions.astype(float) @ axes.T
    corners = seen[shape.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    normals *= np.where(normals[:, 2] < 0, -1, 1)[:, None]
    light = 0.5 + 0.5 * np.clip(normals @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    order = np.argsort(corners[:, :, 2].mean(axis=1))  # from far to near
    box = figure.add_axes([0.02, 0.04, 0.8 if len(shape.values) else 0.96, 0.88 if title else 0.92])
    if len(shape.values):
        finite = shape.values[np.isfinite(shape.values)]
        low, high = bounds or ((float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0))
        scale = cm.ScalarMappable(colors.Normalize(low, high if high > low else low + max(abs(low), 1.0) * 1e-9), MAP)
        colours = scale.to_rgba(shape.values)
        bar = figure.colorbar(scale, cax=figure.add_axes([0.86, 0.12, 0.025, 0.72]))
        bar.set_label(shape.label)
    else:
        colours = np.broadcast_to(colors.to_rgba(COLOUR), (len(shape.faces), 4)).copy()
    colours[:, :3] *= light[:, None]
    drawn = collections.PolyCollection(corners[order][:, :, :2], facecolors=colours[order], edgecolors=colours[order],
                                       linewidths=0.3)
    box.add_collection(drawn)
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    rim = 0.03 * max(float((high - low).max()), 1e-300)
    box.set_xlim(low[0] - rim, high[0] + rim)
    box.set_ylim(low[1] - rim, high[1] + rim)
    box.set_aspect("equal")
    box.set_axis_off()
    if title:
        figure.suptitle(title)
