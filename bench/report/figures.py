"""Which figures the page has, and from which rows their lines are drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import rows
from rows import Raw


class Style(Enum):
    CURVE = "curve"  # ours: the values along its knob
    POINTS = "points"  # an alternative


@dataclass
class Line:
    """A line of a figure: the rows of a run that have these values. y: a field in place of the figure's."""

    name: str
    run: str
    where: "dict[str, Any]"
    style: Style = Style.CURVE
    y: str = ""


@dataclass
class Figure:
    """key: name of the file. floor: smaller values (or zero) are drawn there, since axes are logarithmic."""

    key: str
    title: str
    text: str
    x: str
    y: str
    x_label: str
    y_label: str
    lines: "list[Line]"
    floor: float = 1e-16


@dataclass
class Points:
    """A line with its numbers, in the order of the rows, which is that of the knob."""

    line: Line
    x: "list[float]" = field(default_factory=list)
    y: "list[float]" = field(default_factory=list)


def points_of(figure: Figure, raw: Raw) -> "list[Points]":
    """The lines that have rows in this report."""
    found = []
    for line in figure.lines:
        y = line.y or figure.y
        chosen = rows.select(raw.cases.get(line.run, []), line.where)
        pairs = [(float(row[figure.x]), max(float(row[y]), figure.floor)) for row in chosen
                 if row.get(figure.x) is not None and row.get(y) is not None and row[figure.x] > 0]
        if pairs:
            found.append(Points(line, [x for x, _ in pairs], [y for _, y in pairs]))
    return found


CURVE, POINTS = Style.CURVE, Style.POINTS


def _reconstruction() -> "list[Figure]":
    run = "reconstruct_sweep"
    lines = [Line(f"fitted maps, h = {h}", run, {"cubature": "fitted maps", "basis": h}) for h in (40, 80, 120)]
    lines.append(Line("fitted maps, 1 % asked", run, {"cubature": "fitted maps, 1 % asked"}))
    lines.append(Line("weights (paper), h = 80", run, {"cubature": "weights"}, POINTS))
    for name in ("linear modes", "modal warping", "full"):
        lines.append(Line(name + (" RS, exact by definition" if name == "full" else ""), run, {"cubature": name}, POINTS))
    return [Figure(
        "reconstruction", "Reconstruction of frames",
        "Dino, 30 modes, poses held out of the training. Knobs: columns h and tets of the cubature. Linear modes, modal "
        "warping and full RS make whole shapes; ours make the coordinates that are streamed.",
        "batch_us_per_frame", "error_mean", "time [us/frame]", "mean error, relative", lines, 1e-5),
        Figure(
            "cubature", "Cubature",
            "Flower, h = 80: error against the number of tets. The published curve is of the paper's author, of another "
            "flower and on training poses.",
            "cubature_tets", "fitted_error", "tets of the cubature", "error, relative",
            [Line("fitted maps, held out", "cubature", {}),
             Line("weights, held out", "cubature", {}, POINTS, "weights_error"),
             Line("published, training", "cubature", {}, POINTS, "published_error"),
             Line("the basis alone", "cubature", {}, POINTS, "basis_error")]),
        Figure(
            "basis", "What a basis is made from",
            "Dino, 30 modes: what h columns leave of held-out poses. The default takes the better of the first two.",
            "basis", "snapshots_error", "columns h", "mean error, relative",
            [Line("snapshots", "basis", {"scene": "dino"}, CURVE, "snapshots_error"),
             Line("derivatives of the map", "basis", {"scene": "dino"}, CURVE, "map_derivatives_error"),
             Line("StVK modal derivatives (paper)", "basis", {"scene": "dino"}, POINTS, "modal_derivatives_error")])]


def _spacetime() -> "list[Figure]":
    figures = []
    for scene in ("flower", "tyrannosaurus"):
        run = "spacetime_error"
        figures.append(Figure(
            f"spacetime_{scene}", f"Space-time solve, {scene}",
            "From nothing to an energy. Knob: the tolerance on the gradient. The alternatives are the paper's method, "
            "written plainly, at tolerances of 0.1 to 1e-4.",
            "ms", "error", "time [ms]", "energy above the least, relative",
            [Line("limber", run, {"scene": scene, "method": "limber"}),
             Line("paper, from zero", run, {"scene": scene, "method": "paper, from zero"}, POINTS),
             Line("paper, rising weights", run, {"scene": scene, "method": "paper, rising weights"}, POINTS)]))
    figures.append(Figure(
        "exact", "Exact optimum",
        "Energies against the full rotation-strain optimum, three or four soft constraints a body. The reduced optimum "
        "is that of the model; the exact step begins there; errors below 1e-12 are drawn there.",
        "ms", "error", "time [ms]", "error of the energy, relative",
        [Line("reduced optimum", "exact_points", {"method": "reduced"}, POINTS),
         Line("with the exact step", "exact_points", {"method": "exact"}, POINTS),
         Line("plain full-space solver", "exact_points", {"method": "judge"}, POINTS)], 1e-12))
    return figures


def _material() -> "list[Figure]":
    figures = []
    for mode, title in (("z_lambda_d", "z, Lambda and D"), ("all", "z, Lambda, D and S")):
        figures.append(Figure(
            f"material_{mode}", f"Material optimisation, {title}",
            "The flower's own targets. Knob: when to stop. The alternative is the paper's alternation, written plainly, "
            "after each of its rounds beyond the slow ones.",
            "ms", "error", "time [ms]", "energy above the least found, relative",
            [Line("limber, joint steps", "material_error", {"mode": mode, "method": "limber"}),
             Line("paper, alternation", "material_error", {"mode": mode, "method": "paper"}, POINTS)], 1e-8))
    run = "recovery"
    lines = [Line("all, gamma = " + ("1" if gamma == 1 else f"{gamma:g}"), run,
                  {"scene": scene, "variables": "all", "start": "principal"})
             for gamma, scene in ((1, "beam"), (1e-2, "beam (gamma 1e-2)"), (1e-4, "beam (gamma 1e-4)"))]
    lines += [Line("z alone", run, {"scene": "beam", "variables": "z"}, POINTS),
              Line("z, Lambda and D", run, {"scene": "beam", "variables": "z_lambda_d"}, POINTS),
              Line("paper's start", run, {"scene": "beam (paper's start)"}, POINTS)]
    figures.append(Figure(
        "recovery", "Recovery of material",
        "The beam of the public data, half of a simulated motion recovered with 2 and 10 modes (our knob); how far the "
        "free continuation is from the simulation in the last frame.",
        "ms", "final_frame_error", "time [ms]", "error of the last frame, relative", lines))
    return figures


def _rods_and_beams() -> "list[Figure]":
    figures = []
    for key, problem in (("cantilever", "cantilever, alpha 10"), ("clamped", "elastica, clamped, span .3"),
                         ("bend", "45 degree bend, F 600, J 1/6")):
        figures.append(Figure(
            f"rods_{key}", f"Single rods: {problem}",
            "Against the known answer. Knob: edges, 5 to 80.", "ms", "error_percent", "time [ms]", "error [%]",
            [Line("2008 (default)", "rods", {"problem": problem, "form": "2008"}),
             Line("turning angle", "rods", {"problem": problem, "form": "turning angle"}),
             Line("averaged frames (2010)", "rods", {"problem": problem, "form": "2010"}, POINTS)], 1e-4))
    figures.append(Figure(
        "linkages", "Linkages: burd deployed",
        "Energy of the deployed shape. Knob: edges a segment, 5 to 40. The public code's point is its own figure, at 10 "
        "edges and from another machine.",
        "ms", "error", "time [ms]", "error of the energy, relative",
        [Line("2008 (default)", "linkage_error", {"method": "limber, 2008"}),
         Line("turning angle", "linkage_error", {"method": "limber, turning angle"}),
         Line("public code", "linkage_error", {"method": "public code"}, POINTS)]))
    figures.append(Figure(
        "designs", "Designs: burd towards a known design",
        "Distance of the joints from the target, in parts of where the search began, by CPU time of one thread. Knob: "
        "when to stop.",
        "cpu_ms", "distance", "CPU time [ms]", "distance, relative",
        [Line("limber", "design_error", {"method": "limber"}),
         Line("without the guard against buckling", "design_error", {"method": "limber, no guard"}, POINTS)]))
    for key, case in (("cantilever", "cantilever, alpha 10.0"), ("bend", "45 degree bend, F 600, J 1/6")):
        paper = case if key == "cantilever" else "45 degree bend, F 600, J 1/6, lengths over 100"
        figures.append(Figure(
            f"beams_{key}", f"Beams: {case}",
            "Against the known answer, which has five digits. Knob: elements, 10 to 40.", "wall_s", "error", "time [s]",
            "error, relative to the length",
            [Line("Newton", "beams", {"case": case, "method": "Newton"}),
             Line("relaxation", "beams", {"case": case, "method": "relaxation"}),
             Line("paper's relaxation", "beams", {"case": paper, "method": "the paper's chart"}, POINTS)]))
    return figures


def _streams() -> "list[Figure]":
    run = "streams"
    where = {"scene": "flower"}
    others = ("positions, single", "positions, quantised", "full shapes, single", "linear modes")
    return [Figure(
        "streams", "Streams: bytes against error, flower",
        "Bytes of a frame on the wire. Knob: the tolerance that the model is built to, 10 to 0.1 %. Who receives "
        "coordinates fetches a basis once (`bytes_once` in the raw data).",
        "bytes_per_frame", "error", "bytes a frame", "mean error, relative",
        [Line("limber, coordinates", run, {**where, "method": "limber, coordinates"}),
         *(Line(name, run, {**where, "method": name}, POINTS) for name in others)], 1e-7)]


def trade_offs() -> "list[Figure]":
    """Time (or bytes) against error."""
    return [*_reconstruction(), *_spacetime(), *_material(), *_rods_and_beams(), *_streams()]


@dataclass
class Growth:
    """A figure of times over a size: a line for each `what` of the run's rows of that growth."""

    key: str
    run: str
    growth: str
    title: str
    x_label: str

    def points(self, raw: Raw) -> "list[Points]":
        chosen = rows.select(raw.cases.get(self.run, []), {"growth": self.growth})
        names = list(dict.fromkeys(row["what"] for row in chosen))
        found = []
        for name in names:
            own = sorted((row["size"], row["ms"]) for row in chosen if row["what"] == name)
            found.append(Points(Line(name, self.run, {"growth": self.growth, "what": name}), [x for x, _ in own],
                                [y for _, y in own]))
        return found


GROWTHS = [
    Growth("growth_tets", "growth_bodies", "tets", "Tets", "tets"),
    Growth("growth_frames", "growth_bodies", "frames", "Frames, the solver alone", "frames"),
    Growth("growth_sessions", "growth_sessions", "frames of a session", "Frames of a session, over sockets", "frames"),
    Growth("growth_modes", "growth_bodies", "modes", "Modes", "modes"),
    Growth("growth_constraints", "growth_bodies", "constraints", "Constraints", "constraints"),
    Growth("growth_joints", "growth_linkages", "joints", "Joints of a linkage", "joints"),
    Growth("growth_edges", "growth_linkages", "edges", "Edges a segment", "edges a segment"),
    Growth("growth_elements", "growth_beams", "elements", "Elements of a structure", "elements"),
    Growth("growth_subscribers", "growth_subscribers", "subscribers", "Subscribers", "subscribers"),
]


def add_derived(raw: Raw) -> None:
    """Rows that figures need in another form: of `exact` a row for each method, with time and error of its energy."""
    if "exact" not in raw.cases:
        return
    points = []
    for row in raw.cases["exact"]:
        if not row.get("judge_settled"):
            continue  # nothing to compare with
        times = {"reduced": row["reduced_ms"], "exact": row["reduced_ms"] + row["polish_ms"],
                 "judge": row["reduced_ms"] + row["judge_ms"]}
        errors = {"reduced": abs(row["energy_error_reduced"]), "exact": abs(row["energy_error_exact"]), "judge": 0.0}
        points += [{"scene": row["scene"], "method": method, "ms": times[method], "error": errors[method]}
                   for method in times]
    raw.cases["exact_points"] = points
