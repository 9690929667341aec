#!/usr/bin/env python3
"""Designs a linkage for a hill, from the hill alone: rods that lie flat, and deploy onto it as they are opened."""
import sys

import limber
import numpy as np


def main(picture: str = "hill.svg") -> None:
    x, y = np.meshgrid(np.linspace(-1, 1, 25), np.linspace(-0.7, 0.7, 25), indexing="ij")
    hill = np.stack([x, y, 0.3 * (1 - x ** 2 - y ** 2) * (1 + 0.4 * x)], axis=-1)
    with limber.launch() as server:
        design = server.design_surface(hill, columns=8, rows=6, section={"rectangle": (0.02, 0.004)}, max_iterations=100)
        for info in design.steps():
            print(f"step {info.iteration}: {1000 * info.now.surface_rms:.1f} mm from the hill")
        info, linkage, shapes = design.wait(), design.session, {}
        for title, act in (("result", lambda: None), ("flat", lambda: linkage.deploy(info.flat_angle)),
                           ("start", lambda: (linkage.undo(), linkage.undo()))):
            act()
            linkage.wait()
            shapes[title] = linkage.shape()
        order = {"flat": shapes["flat"], "start": shapes["start"], "target": None, "result": shapes["result"]}
        limber.picture(picture, order, info.placement.apply(hill), unit="m", view=(110, 45), apart=("flat",))
        print(f"{info.message}\n{info.end}: {1000 * info.start.surface_rms:.1f} mm before, "
              f"{1000 * info.best.surface_rms:.1f} mm now")


if __name__ == "__main__":
    main(*sys.argv[1:])
