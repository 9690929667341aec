"""Cutting plans for a workshop: laths with their holes, as a table, as drawings on sheets."""

from __future__ import annotations

import csv
import io
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Sequence

from . import checks, lath_drawings, sheets
from .errors import invalid, of_file
from .sheets import Sheet

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}  # in metres
HOLE = 0.2           # diameter of holes where none is given, as a share of the narrowest lath's width
LARGEST_HOLE = 0.5   # the same of the largest that a lath may have
EDGE_DISTANCE = 1.5  # from the middle of a lath's outer hole to its end, in diameters


@dataclass(frozen=True)
class Hole:
    """Place at which a lath is joined to others. Lengths in the unit of the laths."""

    joint: int                # of the linkage, node of a structure of beams
    at: float                 # from the lath's first end
    crosses: tuple[int, ...]  # laths with the same hole
    angle: float              # the joint's opening angle in the shape; of beams between them, in [0, 90] [degree]
    # Curvature of the lath here [1 / unit]: to the left of its direction as seen against the joint's normal, and towards the
    # normal (of beams NaN at their ends). `twist_rate`: its twist [radian / unit] (of beams NaN).
    curvature_side: float
    curvature_normal: float
    twist_rate: float


@dataclass(frozen=True)
class Lath:
    """One piece, straight when it is cut. Lengths in the unit of the laths."""

    number: int
    parts: tuple[int, ...]      # segments, or elements, that it is made of, in order
    length: float               # from end to end, including the ends beyond its outer holes
    cuts: tuple[float, ...]     # from the first end: where each part begins, and the last one ends
    widths: tuple[float, ...]   # of each part, across the holes
    heights: tuple[float, ...]  # of each part, along the holes
    holes: tuple[Hole, ...]     # in order
    closed: bool                # a ring: the first and the last hole are the same joint
    largest_stress: float       # in the shape [Pa]; NaN where it is not known
    section: str = ""           # of beams, whose laths differ

    @property
    def width(self) -> float:
        """The largest."""
        return max(self.widths)

    @property
    def height(self) -> float:
        """The largest: how thick the sheet is that it is cut from."""
        return max(self.heights)


COLUMNS = ("lath", "section", "length_{u}", "width_{u}", "height_{u}", "closed", "largest_stress_Pa", "parts", "hole", "joint",
           "at_{u}", "crosses", "angle_degree", "curvature_side_per_{u}", "curvature_normal_per_{u}",
           "twist_radian_per_{u}")


@dataclass(frozen=True)
class Laths:
    """All laths of a linkage or a structure."""

    name: str
    unit: str                   # of all lengths here
    section: str                # of the scene, with its dimensions
    laths: tuple[Lath, ...]
    youngs_modulus: float       # [Pa]
    hole: float                 # diameter of all holes
    edge_distance: float        # that every outer hole has at least from its end, in diameters
    revision: int               # of the session
    converged: bool             # false: the curvatures are of no equilibrium; lengths and holes are right

    def __iter__(self):
        return iter(self.laths)

    def __len__(self) -> int:
        return len(self.laths)

    def __getitem__(self, number: int) -> Lath:
        return self.laths[number]

    @property
    def length(self) -> float:
        """Length of all laths together."""
        return sum(lath.length for lath in self.laths)

    def csv(self) -> str:
        """A row for each hole, and one for a lath that has none; units are in the names of the columns."""
        text = io.StringIO()
        out = csv.writer(text, lineterminator="\n")
        out.writerow(name.format(u=self.unit) for name in COLUMNS)
        for lath in self.laths:
            head = [lath.number, lath.section or self.section, _short(lath.length), _short(lath.width), _short(lath.height),
                    int(lath.closed), _short(lath.largest_stress), " ".join(map(str, lath.parts))]
            for i, hole in enumerate(lath.holes):
                out.writerow([*head, i, hole.joint, _short(hole.at), " ".join(map(str, hole.crosses)), _short(hole.angle),
                              _short(hole.curvature_side), _short(hole.curvature_normal), _short(hole.twist_rate)])
            if not lath.holes:
                out.writerow([*head, *[""] * (len(COLUMNS) - len(head))])
        return text.getvalue()

    def save_csv(self, path: "str | os.PathLike[str]") -> Path:
        return _written(checks.path(path, "path"), self.csv())

    def sheets(self, sheet: "Sequence[float] | None" = None, margin: float = 0.0, gap: float = 0.0,
               kerf: float = 0.0) -> list[Sheet]:
        """The laths laid out in rows, the widest and longest first; all in the unit of the laths.

        sheet: (length, height) of a sheet; None: one of sufficient size. `margin`: free at its rim; gap: between cut parts; kerf:
        width of the cut, half of which lies outside every outline and inside every hole.
        """
        return sheets.nest(self.laths, self.unit, sheet, margin, gap, kerf)

    def save_dxf(self, path: "str | os.PathLike[str]", *, hole: float | None = None, **layout: object) -> Path:
        """Sheets side by side in one drawing in this unit ($INSUNITS), of layers SHEETS, OUTLINES, HOLES and MARKS. Needs
        python3-ezdxf.

        hole: another diameter than that of these laths, which they must have room for; layout: arguments of sheets().
        """
        target, diameter = checks.path(path, "path"), self._diameter(hole)
        try:
            lath_drawings.dxf(target, self.sheets(**layout), self.unit, diameter)  # type: ignore[arg-type]
        except OSError as error:
            raise of_file(error, f"{target} cannot be written", "path") from error
        return target

    def save_svg(self, path: "str | os.PathLike[str]", *, hole: float | None = None, **layout: object) -> tuple[Path, ...]:
        """A drawing for each sheet at its true size: PATH for the first, then PATH with _2, _3 ... in its name. Arguments
        as of save_dxf()."""
        target, diameter = checks.path(path, "path"), self._diameter(hole)
        laid = self.sheets(**layout)  # type: ignore[arg-type]
        names = [target if i == 0 else target.with_name(f"{target.stem}_{i + 1}{target.suffix}") for i in range(len(laid))]
        return tuple(_written(name, lath_drawings.svg(sheet, self.unit, diameter, f"{self.name} {i + 1}/{len(laid)}"))
                     for i, (name, sheet) in enumerate(zip(names, laid)))


    def _diameter(self, hole: float | None) -> float:
        """Diameter of holes to be drawn: each lies within its lath, with the distance from the ends that laths() was given."""
        diameter = self.hole if hole is None else diameter_of(self.laths, hole)
        for lath in self.laths:
            for drilled in lath.holes:
                left, text = min(drilled.at, lath.length - drilled.at), f"a hole of {diameter:.6g} {self.unit} at joint {drilled.joint}"
                if left <= diameter / 2:
                    raise invalid("hole", f"{text} cuts the end of lath {lath.number}: take a larger overhang, or give laths() the "
                                          "diameter of its holes")
                if left < self.edge_distance * diameter * (1 - 1e-9):
                    raise invalid("hole", f"{text} is {left:.6g} {self.unit} from the end of lath {lath.number}, less than "
                                          f"{self.edge_distance:.6g} diameters: take a larger overhang, or give laths() the "
                                          "diameter of its holes or a smaller edge_distance")
        return diameter


def diameter_of(laths: "Sequence[Lath]", hole: float | None) -> float:
    """Diameter of all holes, in the unit of the laths."""
    narrowest = min(laths, key=lambda lath: min(lath.widths))
    width = min(narrowest.widths)
    if hole is None:
        return HOLE * width
    if not 0 < checks.real(hole, "hole") <= LARGEST_HOLE * width:
        raise invalid("hole", f"holes of {hole:g} do not fit lath {narrowest.number}, which is {width:.6g} wide: at most half "
                              "of that leaves enough beside them")
    return hole


def drilled(laths: "Sequence[Lath]", overhang: float | None, hole: float | None,
            edge_distance: float) -> "tuple[tuple[Lath, ...], float, float]":
    """Laths made longer if they end too near their outer holes, and the diameter of all holes. Also how many diameters their
    middles are from the ends at least, of those requested.

    overhang: from the middle of an outer hole to the end, at least; None: edge_distance diameters.
    """
    if overhang is not None and not 0 <= checks.real(overhang, "overhang") < float("inf"):
        raise invalid("overhang", f"overhang must be >= 0, is {overhang}")
    if not 0 <= checks.real(edge_distance, "edge_distance") < float("inf"):
        raise invalid("edge_distance", f"edge_distance must be >= 0, is {edge_distance}")
    diameter = diameter_of(laths, hole)
    beyond = edge_distance * diameter if overhang is None else overhang
    return tuple(_longer(lath, beyond) for lath in laths), diameter, min(edge_distance, beyond / diameter)


def _longer(lath: Lath, beyond: float) -> Lath:
    if not lath.holes:
        return lath
    drawn = lath.holes[0].at, lath.length - lath.holes[-1].at
    before, after = (max(0.0, beyond - tail) for tail in drawn)
    cuts = (0.0, *(cut + before for cut in lath.cuts[1:-1]), lath.length + before + after)
    return replace(lath, length=cuts[-1], cuts=cuts, holes=tuple(replace(hole, at=hole.at + before) for hole in lath.holes))


def walk(part: int, entered: int, follows: "dict[tuple[int, int], tuple[int, int]]") -> "list[tuple[int, int]]":
    """Parts of one piece from this one on, each with the end (0 or 1) at which it is entered. `follows`: the end of the part that
    continues an end of a part."""
    run, seen = [(part, entered)], {part}
    while (after := follows.get((run[-1][0], 1 - run[-1][1]))) is not None and after[0] not in seen:
        run.append(after)
        seen.add(after[0])
    return run


def runs(parts: int, follows: "dict[tuple[int, int], tuple[int, int]]") -> "list[tuple[list[tuple[int, int]], bool]]":
    """All pieces, as walk() has them, and whether they are rings; each begins at the end with the smaller part."""
    made, done = [], set()
    for part in range(parts):
        if part in done:
            continue
        begin, entered = walk(part, 1, follows)[-1]
        closed = follows.get((begin, 1 - entered)) == (part, 1)
        run = walk(part, 0, follows) if closed else walk(begin, 1 - entered, follows)
        if not closed and run[-1][0] < run[0][0]:
            run = [(other, 1 - end) for other, end in reversed(run)]
        done.update(other for other, _ in run)
        made.append((run, closed))
    return made


def crossed(laths: "Sequence[Lath]") -> "tuple[Lath, ...]":
    """With which laths each hole is shared."""
    at_joint: "dict[int, set[int]]" = {}
    for lath in laths:
        for hole in lath.holes:
            at_joint.setdefault(hole.joint, set()).add(lath.number)
    return tuple(replace(lath, holes=tuple(replace(hole, crosses=tuple(sorted(at_joint[hole.joint] - {lath.number})))
                                           for hole in lath.holes)) for lath in laths)


def _short(value: float) -> str:
    return "" if value != value else f"{value:.7g}"


def _written(target: Path, text: str) -> Path:
    try:
        target.write_text(text, encoding="utf-8")
    except OSError as error:
        raise of_file(error, f"{target} cannot be written", "path") from error
    return target
