#!/usr/bin/env python3
"""Draws what animators have beside keys: a path, a loop, a local edit and inertia, of one rod.

usage: bench/animation_sheet.py OUT.png     $LIMBER_BIN: folder with limberd
"""

import pathlib
import sys

import limber
import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "examples"))
from secondary_motion import rod  # noqa: E402

FRAMES, SIDE, CELLS = 96, 0.05, 12
KEY, SHOWN, BESIDE = "#b3261e", "#1f77c9", "#9a9a9a"


def rod_scene(**options):
    nodes, tets = rod()
    pins = np.flatnonzero(nodes[:, 1] == 0)
    return limber.scene_from_arrays(nodes, tets, fixed_nodes=pins, frames=FRAMES, **options)


def tip_of(body):
    return int(body.geometry().rest[:, 1].argmax())


def curve(body):
    """Path of the tip along x, in lengths of the rod."""
    tip = tip_of(body)
    return (body.frames()[:, tip, 0] - body.geometry().rest[tip, 0]) / (SIDE * CELLS)


def opened(server, *edits, **options):
    body = server.open(rod_scene(**options), progress=False)
    for what in edits:
        body.add(node=tip_of(body), **{**what, "displacement": (what["displacement"] * SIDE * CELLS, 0, 0)})
    body.wait()
    return body


def draw_path(server, axes):
    body = opened(server, {"frame": 20, "displacement": 0.2, "exact": True,
                           "path": [(40, None), (60, (-0.1 * SIDE * CELLS, 0, 0)), (75, (0.1 * SIDE * CELLS, 0, 0))]})
    axes.plot(curve(body), color=SHOWN)
    axes.plot([20, 40, 60, 75], [0.2, 0.2, -0.1, 0.1], "o", color=KEY)
    axes.set_title("one constraint: a hold and a path")


def draw_loop(server, axes):
    keys = ({"frame": 4, "displacement": 0.2, "exact": True}, {"frame": 50, "displacement": -0.1, "exact": True})
    for ends, colour in (("position_velocity", BESIDE), ("cyclic", SHOWN)):
        once = curve(opened(server, *keys, first_end=ends, last_end=ends))
        axes.plot(np.concatenate([once, once]), color=colour, label="loop" if ends == "cyclic" else "ends at rest")
    axes.plot([4, 50, 4 + FRAMES, 50 + FRAMES], [0.2, -0.1] * 2, "o", color=KEY)
    axes.axvline(FRAMES, color=BESIDE, linewidth=0.5)
    axes.legend(frameon=False, fontsize=8)
    axes.set_title("a loop, two turns")


def draw_local(server, axes):
    body = opened(server, {"frame": 20, "displacement": 0.2}, {"frame": 80, "displacement": 0.15})
    before = curve(body)
    body.add(node=tip_of(body), frame=50, displacement=(-0.15 * SIDE * CELLS, 0, 0), exact=True, reach=0.5)
    body.wait()
    axes.axvspan(35, 65, color="#eeeeee")
    axes.plot(before, color=BESIDE, label="before")
    axes.plot(curve(body), color=SHOWN, label="with a reach of 0.5 s")
    axes.plot([50], [-0.15], "o", color=KEY)
    axes.legend(frameon=False, fontsize=8)
    axes.set_title("a local edit")


def draw_inertia(server, axes):
    nodes, _ = rod()
    pins = nodes[nodes[:, 1] == 0]
    share = np.clip((np.arange(FRAMES) - 10) / 20, 0, 1)
    way = 0.3 * SIDE * CELLS * share ** 2 * (3 - 2 * share)
    paths = pins + way[:, None, None] * (1, 0, 0)
    body = server.open(rod_scene(base_motion=limber.animated_pins(paths), first_end="free", last_end="free", period_frames=20,
                                 damping_ratio=0.1), progress=False)
    for inertia, colour in ((0, BESIDE), (1, SHOWN), (3, KEY)):
        body.dynamics(inertia=inertia)
        body.wait()
        axes.plot(curve(body), color=colour, label=f"inertia {inertia}")
    axes.legend(frameon=False, fontsize=8)
    axes.set_title("pins that are moved, and what lags behind")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    figure, panels = pyplot.subplots(2, 2, figsize=(9, 5.5), layout="constrained")
    with limber.launch() as server:
        for draw, axes in zip((draw_path, draw_loop, draw_local, draw_inertia), panels.flat):
            draw(server, axes)
            axes.set_xlabel("frame")
            axes.set_ylabel("tip [lengths]")
    figure.savefig(sys.argv[1], dpi=110)


if __name__ == "__main__":
    main()
