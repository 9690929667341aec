#!/usr/bin/python3
"""Draws the page of `limber-bench report` from its raw data.

usage: make_page.py FOLDER    reads FOLDER/raw, writes FOLDER/README.md, index.html and plots/*.svg
       make_page.py --check   only says whether it could; exit code 2 where matplotlib is missing
"""

from __future__ import annotations

import sys
from pathlib import Path

import figures
import fits
import goals
import rows
import tables
from goals import Outcome
from page import Block, Cell, Heading, Paragraph, Picture, Table, to_html, to_markdown

TITLE = "limber: speed against error"


def number(value: float) -> str:
    """Three digits, or as many as an integer has."""
    if value != 0 and (abs(value) >= 1e5 or abs(value) < 1e-3):
        return f"{value:.2e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")
    if abs(value) >= 100:
        return f"{value:.0f}"
    return f"{value:.3g}"


def machine_blocks(raw: rows.Raw) -> "list[Block]":
    report, machine = raw.report, raw.report["machine"]
    loads = [report.get("load_before"), report.get("load_after")]
    shown = [number(load) if load is not None else "not known" for load in loads]
    blocks: "list[Block]" = [Table(["machine", ""], [
        ["CPU", str(machine["cpu"])], ["cores", str(machine["cores"])], ["SIMD level", str(machine["simd"])],
        ["compiler", str(machine["compiler"])], ["build type", str(machine["build_type"])],
        ["commit", str(report["commit"])],
        ["load of the last minute, before and after", ", ".join(shown)],
        ["duration", f"{report['seconds'] / 60:.1f} minutes, {report['cpu_seconds'] / 60:.1f} of CPU time"]])]
    busy = max([load for load in loads if load is not None], default=0)
    if (loads[0] or 0) > 0.5:
        blocks.append(Paragraph("Something else was running when this began: times are longer than on an idle machine, and "
                                "differ from run to run. Ratios of times of one run differ less."))
    if busy > 1.5 * machine["cores"]:
        blocks.append(Paragraph("Much else was running: each process had a part of a core, so that wall times are several "
                                "times those of an idle machine. Errors, bytes and counts are as good as ever; times, goals "
                                "of times and exponents are worth measuring again."))
    if not report.get("has_public_data", True):
        blocks.append(Paragraph("Without the public data: what needs it is not measured."))
    if raw.failed:
        blocks.append(Table(["failed"], [[Cell(name, missed=True)] for name in raw.failed]))
    return blocks


def goal_blocks(raw: rows.Raw) -> "list[Block]":
    judged = [goals.judge(goal, raw) for goal in goals.load()]
    counts = {outcome: sum(one.outcome is outcome for one in judged) for outcome in Outcome}
    table = []
    for one in judged:
        goal = one.goal
        measured = number(one.measured) if one.measured is not None else one.why
        table.append([goal["text"], f"{goal['direction']} {number(goal['target'])} {goal['unit']}".rstrip(), measured,
                      Cell(one.outcome.value, one.outcome is Outcome.MISSED), goal["claimed"], goal["key"]])
    return [
        Heading(2, "Goals"),
        Paragraph(f"Each figure that the project claims or wants, from bench/report/goals.json, against this run: "
                  f"{counts[Outcome.MET]} met, {counts[Outcome.MISSED]} missed, {counts[Outcome.NOT_MEASURED]} not measured "
                  f"here. \"here\": this row is the claim; \"goal\": the project wants it and does not claim to have it."),
        Table(["what", "target", "measured", "", "claimed in", "key"], table)]


def trade_off_blocks(raw: rows.Raw, plots: Path) -> "list[Block]":
    import plots as drawing
    blocks: "list[Block]" = [
        Heading(2, "Time against error"),
        Paragraph("Curves are limber's, along the knob that is named; points are the alternatives, measured in the same run "
                  "unless the text says otherwise. Down and to the left is better.")]
    for figure in figures.trade_offs():
        lines = figures.points_of(figure, raw)
        if not lines:
            continue
        drawing.draw_trade_off(figure, lines, plots / f"{figure.key}.svg")
        blocks += [Heading(3, figure.title), Paragraph(figure.text), Picture(f"plots/{figure.key}.svg", figure.title)]
    return blocks


def growth_blocks(raw: rows.Raw, plots: Path) -> "list[Block]":
    import plots as drawing
    blocks: "list[Block]" = [
        Heading(2, "Growth"),
        Paragraph("What happens to times as one size grows. Exponents are of power laws fitted to all points by least squares of "
                  "logarithms; \"last\" is the exponent between the two largest sizes, \"off\" the largest factor by which a "
                  "point lies off the law, \"not converged\" counts solves that did not end at an optimum.")]
    table = []
    for growth in figures.GROWTHS:
        lines = growth.points(raw)
        if not lines:
            continue
        drawing.draw_growth(growth.title, growth.x_label, lines, plots / f"{growth.key}.svg")
        blocks += [Heading(3, growth.title), Picture(f"plots/{growth.key}.svg", growth.title)]
        for points in lines:
            chosen = rows.select(raw.cases[growth.run], points.line.where)
            lost = sum(row["not_converged"] for row in chosen)
            try:
                law = fits.fit(points.x, points.y)
                fitted = [f"{law.exponent:.2f}", f"{law.last:.2f}", f"{law.spread:.2f}"]
            except ValueError as error:
                fitted = [str(error), "", ""]
            table.append([growth.x_label, points.line.name, f"{number(points.x[0])} to {number(points.x[-1])}",
                          f"{number(points.y[0])} to {number(points.y[-1])}", *fitted, Cell(str(lost), lost > 0)])
    blocks.append(Table(["size", "what", "range", "time [ms]", "exponent", "last", "off", "not converged"], table))
    return blocks


def cell_of(row: rows.Row, column: tuple) -> str:
    value = row.get(column[1])
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, float)) and len(column) > 2:
        value *= column[2]
    if isinstance(value, float):
        return number(value)
    return str(value)


def table_blocks(raw: rows.Raw) -> "list[Block]":
    blocks: "list[Block]" = [Heading(2, "Tables"), Paragraph("Rows of the raw data, the fields that matter most.")]
    for table in tables.TABLES:
        chosen = tables.rows_of(table, raw)
        if not chosen:
            continue
        blocks.append(Heading(3, table.title))
        if table.text:
            blocks.append(Paragraph(table.text))
        blocks.append(Table([column[0] for column in table.columns],
                            [[cell_of(row, column) for column in table.columns] for row in chosen]))
    return blocks


def run_blocks(raw: rows.Raw) -> "list[Block]":
    table = []
    for run in raw.report["runs"]:
        words = ["limber-bench", run["suite"], *(["--quick"] if run["quick"] else []), "--repeats", str(run["repeats"])]
        only = f"LIMBER_BENCH_ONLY='{run['only']}' " if run["only"] else ""
        count = str(len(raw.cases[run["id"]])) if run["id"] in raw.cases else "failed"
        table.append([run["id"], only + " ".join(words), f"{run['seconds']:.1f}", f"{run['cpu_seconds']:.1f}",
                      count])
    return [Heading(2, "Runs"), Paragraph("What was run, in this order; raw/ID.json has the rows."),
            Table(["ID", "command", "seconds", "of CPU", "rows"], table)]


def blocks_of(raw: rows.Raw, plots: Path) -> "list[Block]":
    how = "limber-bench report" + (" --quick" if raw.report.get("quick") else "")
    figures.add_derived(raw)
    return [Heading(1, TITLE), Paragraph(f"Written by `{how}`; all numbers are from its raw data in raw/."),
            *machine_blocks(raw), *goal_blocks(raw), *trade_off_blocks(raw, plots), *growth_blocks(raw, plots), *table_blocks(raw),
            *run_blocks(raw)]


def check() -> int:
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        print(f"make_page.py: the page needs matplotlib ({error}): apt-get install python3-matplotlib", file=sys.stderr)
        return 2
    goals.load()
    return 0


def main(words: "list[str]") -> int:
    if words == ["--check"]:
        return check()
    if len(words) != 1 or words[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    code = check()
    if code:
        return code
    folder = Path(words[0])
    try:
        raw = rows.load(folder / "raw")
    except (OSError, ValueError) as error:
        print(f"make_page.py: {error}", file=sys.stderr)
        return 1
    plots = folder / "plots"
    plots.mkdir(exist_ok=True)
    blocks = blocks_of(raw, plots)
    (folder / "README.md").write_text(to_markdown(blocks))
    (folder / "index.html").write_text(to_html(blocks, TITLE))
    print(f"{folder / 'index.html'}, {folder / 'README.md'}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
