"""Laths laid out on sheets, in rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Sequence

from . import checks
from .errors import LimberError, invalid

if TYPE_CHECKING:
    from .laths import Lath


@dataclass(frozen=True)
class Placed:
    """A lath along x, its first end at x, its axis at y."""

    lath: "Lath"
    x: float
    y: float


@dataclass(frozen=True)
class Sheet:
    length: float
    height: float
    kerf: float
    placed: tuple[Placed, ...]


class _Row:
    def __init__(self, y: float, height: float):
        self.y, self.height, self.end = y, height, 0.0
        self.placed: "list[tuple[Lath, float]]" = []


def nest(laths: "Sequence[Lath]", unit: str, size: "Sequence[float] | None", margin: float, gap: float,
         kerf: float) -> list[Sheet]:
    """First fit of the widest and longest first: each lath in the first row that has room, each row on the first sheet."""
    for name, value in (("margin", margin), ("gap", gap), ("kerf", kerf)):
        if not 0 <= checks.real(value, name) < float("inf"):
            raise invalid(name, f"{name} must be >= 0 {unit}, is {value}")
    order = sorted(laths, key=lambda lath: (-lath.width, -lath.length, lath.number))
    between = gap + kerf
    if size is None:
        length = max((lath.length for lath in order), default=0.0) + kerf
        height = float("inf")
    else:
        given = [checks.real(value, "sheet") for value in checks.several(size, "sheet")]
        if len(given) != 2 or min(given) <= 2 * margin:
            raise invalid("sheet", f"a sheet is its length and its height, both more than two margins, not {size!r}")
        length, height = (value - 2 * margin for value in given)
    sheets: "list[list[_Row]]" = []
    for lath in order:
        if lath.length + kerf > length * (1 + 1e-12):
            raise LimberError("OUT_OF_RANGE", f"lath {lath.number} is {lath.length:.6g} {unit} long, the sheet has "
                                              f"{length - kerf:.6g} {unit} for it", "sheet")
        if lath.width + kerf > height * (1 + 1e-12):
            raise LimberError("OUT_OF_RANGE", f"lath {lath.number} is {lath.width:.6g} {unit} wide, the sheet has "
                                              f"{height - kerf:.6g} {unit} for it", "sheet")
        row = next((row for rows in sheets for row in rows
                    if lath.width <= row.height and row.end + lath.length + kerf <= length * (1 + 1e-12)), None)
        if row is None:
            row = _new_row(sheets, lath.width, height, between, kerf)
        row.placed.append((lath, row.end + kerf / 2))
        row.end += lath.length + kerf + gap
    made = []
    for rows in sheets:
        placed = tuple(Placed(lath, margin + x, margin + row.y + kerf / 2 + row.height / 2)
                       for row in rows for lath, x in row.placed)
        used = rows[-1].y + rows[-1].height + kerf
        made.append(Sheet(length + 2 * margin, (used if size is None else height) + 2 * margin, kerf, placed))
    return made


def _new_row(sheets: "list[list[_Row]]", width: float, height: float, between: float, kerf: float) -> _Row:
    for rows in sheets:
        y = rows[-1].y + rows[-1].height + between
        if y + width + kerf <= height * (1 + 1e-12):
            rows.append(_Row(y, width))
            return rows[-1]
    sheets.append([_Row(0.0, width)])
    return sheets[-1][0]
