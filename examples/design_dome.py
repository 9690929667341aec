#!/usr/bin/env python3
"""Designs the sample dome for a deeper bowl: rest lengths with which it lies nearly flat, and opens towards the bowl."""
import sys

import limber
import numpy as np


def main(picture: str = "bowl.svg") -> None:
    with limber.launch() as server:
        dome = server.open(sample="dome")
        dome.deploy(60)
        dome.wait()
        start = dome.shape()
        middle = start.joints.mean(axis=0)
        bowl = (start.joints - middle) * (1, 1, 1.3) + middle  # points of the surface that is wanted
        design = dome.design(surface=bowl, flat_height=0.05, max_iterations=60)
        for info in design.steps():
            print(f"step {info.iteration}: {1000 * info.now.surface_rms:.1f} mm from the bowl")
        info = design.wait()
        print(f"{info.end}: {1000 * info.start.surface_rms:.1f} mm before, {1000 * info.best.surface_rms:.1f} mm now")
        limber.picture(picture, {"start": start, "target": None, "result": dome.shape()}, surface=bowl)


if __name__ == "__main__":
    main(*sys.argv[1:])
