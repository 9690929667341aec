"""Sheets of laths as .dxf and .svg."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Sequence

from .errors import LimberError, invalid

if TYPE_CHECKING:
    from .laths import Lath
    from .sheets import Sheet

INSUNITS = {"in": 1, "mm": 4, "cm": 5, "m": 6}
LAYERS = {"SHEETS": 8, "OUTLINES": 1, "HOLES": 5, "MARKS": 3}  # and their colours


def outline(lath: "Lath", kerf: float = 0.0) -> "list[tuple[float, float]]":
    """Corners around a lath along x, half a kerf outside."""
    upper = []
    for i, width in enumerate(lath.widths):
        for cut, other in ((lath.cuts[i], i - 1), (lath.cuts[i + 1], i + 1)):
            is_end = not 0 <= other < len(lath.widths)
            if not is_end and lath.widths[other] == width:
                continue
            outward = 1 if other > i else -1
            grows = kerf / 2 if is_end or lath.widths[other] < width else -kerf / 2
            upper.append((cut + outward * grows, (width + kerf) / 2))
    return upper + [(x, -y) for x, y in reversed(upper)]


def radius(hole: float, kerf: float) -> float:
    """Radius of holes of a diameter, half a kerf inside."""
    if hole <= kerf:
        raise invalid("kerf", f"a kerf of {kerf:g} leaves nothing of holes of {hole:.6g}")
    return (hole - kerf) / 2


def dxf(path: Path, sheets: "Sequence[Sheet]", unit: str, hole: float) -> None:
    try:
        import ezdxf
    except ImportError as error:
        raise LimberError("UNSUPPORTED", f"drawings as .dxf need the Python package ezdxf (python3-ezdxf): {error}") from error
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = INSUNITS[unit]
    drawing.header["$MEASUREMENT"] = 0 if unit == "in" else 1
    for name, colour in LAYERS.items():
        drawing.layers.add(name, color=colour)
    space, left = drawing.modelspace(), 0.0
    for sheet in sheets:
        rim = [(left, 0), (left + sheet.length, 0), (left + sheet.length, sheet.height), (left, sheet.height)]
        space.add_lwpolyline(rim, close=True, dxfattribs={"layer": "SHEETS"})
        for placed in sheet.placed:
            x, y, lath = left + placed.x, placed.y, placed.lath
            space.add_lwpolyline([(x + u, y + v) for u, v in outline(lath, sheet.kerf)], close=True,
                                 dxfattribs={"layer": "OUTLINES"})
            for at in lath.holes:
                space.add_circle((x + at.at, y), radius(hole, sheet.kerf), dxfattribs={"layer": "HOLES"})
            for u, v, size, text in marks(lath):
                mark = space.add_text(text, dxfattribs={"layer": "MARKS", "height": size})
                mark.dxf.insert = (x + u, y + v)
        left += 1.05 * sheet.length
    drawing.saveas(str(path))


def marks(lath: "Lath") -> "list[tuple[float, float, float, str]]":
    """Texts on a lath: position (x along it, y across), size, text."""
    size = 0.2 * min(lath.widths)
    text = [(at.at + 0.8 * size, 0.4 * size, size, str(at.joint)) for at in lath.holes[:-1]]
    if lath.holes:
        last = lath.holes[-1]
        text.append((last.at - (0.8 + 0.7 * len(str(last.joint))) * size, 0.4 * size, size, str(last.joint)))
    first = lath.holes[0].at if lath.holes else 0.0
    return [*text, (first + 0.8 * size, -1.6 * size, size, f"L{lath.number}")]


def svg(sheet: "Sheet", unit: str, hole: float, title: str) -> str:
    """At its true size; y counts downwards there."""
    width, height = sheet.length, sheet.height
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6g}{unit}" height="{height:.6g}{unit}" '
             f'viewBox="0 0 {width:.6g} {height:.6g}" font-family="sans-serif" fill="none">' if unit != "m" else
             f'<svg xmlns="http://www.w3.org/2000/svg" width="{100 * width:.6g}cm" height="{100 * height:.6g}cm" '
             f'viewBox="0 0 {width:.6g} {height:.6g}" font-family="sans-serif" fill="none">',
             f"<title>{escape(title)}</title>",
             f'<rect width="{width:.6g}" height="{height:.6g}" fill="white" stroke="#999" stroke-width="{width / 2000:.4g}"/>']
    for placed in sheet.placed:
        lath = placed.lath
        line = min(lath.widths) / 60
        corners = " ".join(f"{placed.x + u:.6g},{height - placed.y - v:.6g}" for u, v in outline(lath, sheet.kerf))
        parts.append(f'<polygon points="{corners}" stroke="#c00" stroke-width="{line:.4g}"/>')
        for at in lath.holes:
            parts.append(f'<circle cx="{placed.x + at.at:.6g}" cy="{height - placed.y:.6g}" '
                         f'r="{radius(hole, sheet.kerf):.6g}" stroke="#00c" stroke-width="{line:.4g}"/>')
        for u, v, size, text in marks(lath):
            parts.append(f'<text x="{placed.x + u:.6g}" y="{height - placed.y - v:.6g}" font-size="{size:.4g}" '
                         f'fill="#060">{escape(text)}</text>')
    return "\n".join([*parts, "</svg>\n"])
