"""Draws figures as SVG with matplotlib: small files, the same bytes for the same numbers, fonts as text."""

from __future__ import annotations

from pathlib import Path
from typing import Callable

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot  # noqa: E402

import fits  # noqa: E402
from figures import Figure, Points, Style  # noqa: E402

matplotlib.rcParams.update({
    "svg.hashsalt": "limber", "svg.fonttype": "none", "font.size": 9, "axes.grid": True, "grid.color": "#dddddd",
    "grid.linewidth": 0.6, "axes.titlesize": 10, "legend.fontsize": 7.5, "legend.frameon": False, "lines.linewidth": 1.4,
    "lines.markersize": 4.5, "figure.figsize": (6.4, 3.6), "font.family": "sans-serif", "mathtext.fontset": "dejavusans",
})
CURVE_COLOURS = ["#1f4e9c", "#2a9d8f", "#7b3fa0", "#5a8f29", "#00779e"]
POINT_COLOURS = ["#c1440e", "#d98e04", "#8a5a44", "#b03a6b", "#6b6b6b", "#222222"]
POINT_MARKERS = ["s", "^", "D", "v", "P", "X"]


def _draw(path: Path, title: str, x_label: str, y_label: str, draw: "Callable[[pyplot.Axes], None]") -> None:
    figure, axes = pyplot.subplots()
    axes.set_xscale("log")
    axes.set_yscale("log")
    draw(axes)
    axes.set_title(title)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    # Beside the axes: lines are where they are.
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0)
    figure.savefig(path, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None})
    pyplot.close(figure)


def _line(axes: "pyplot.Axes", points: Points, number: int) -> None:
    if points.line.style is Style.CURVE:
        colour = CURVE_COLOURS[number % len(CURVE_COLOURS)]
        axes.plot(points.x, points.y, "o-", color=colour, label=points.line.name)
    else:
        which = number % len(POINT_COLOURS)
        axes.plot(points.x, points.y, POINT_MARKERS[which], color=POINT_COLOURS[which], label=points.line.name)


def draw_trade_off(figure: Figure, lines: "list[Points]", path: Path) -> None:
    """Curves of ours and points of the alternatives on logarithmic axes."""
    def draw(axes: "pyplot.Axes") -> None:
        numbers = {style: 0 for style in Style}
        for points in lines:
            _line(axes, points, numbers[points.line.style])
            numbers[points.line.style] += 1
    _draw(path, figure.title, figure.x_label, figure.y_label, draw)


def draw_growth(title: str, x_label: str, lines: "list[Points]", path: Path) -> None:
    """Times over a size, each with the power law that fits it, dashed, and its exponent in the legend."""
    def draw(axes: "pyplot.Axes") -> None:
        for number, points in enumerate(lines):
            colour = (CURVE_COLOURS + POINT_COLOURS)[number % (len(CURVE_COLOURS) + len(POINT_COLOURS))]
            label = points.line.name
            try:
                law = fits.fit(points.x, points.y)
            except ValueError:
                law = None
            if law:
                label += f": {law.exponent:.2f}"
                ends = [points.x[0], points.x[-1]]
                axes.plot(ends, [law.at(x) for x in ends], "--", color=colour, linewidth=0.8)
            axes.plot(points.x, points.y, "o-", color=colour, label=label)
    _draw(path, title, x_label, "time [ms]", draw)
