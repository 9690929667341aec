#!/usr/bin/env python3
"""Designs the sample dome for a bowl that is nearly twice as deep: rest lengths with which it deploys onto it."""
import sys

import limber
import numpy as np


def main(picture: str = "bowl.svg") -> None:
    with limber.launch() as server:
        dome = server.open(sample="dome")
        dome.deploy(60)
        dome.wait()
        middle = (start := dome.shape()).joints.mean(axis=0)
        x, y, z = (start.joints - middle).T
        depth, height = np.polyfit(x ** 2 + y ** 2, z, 1)  # of the paraboloid nearest to the dome
        x, y = np.meshgrid(np.linspace(x.min(), x.max(), 17), np.linspace(y.min(), y.max(), 17), indexing="ij")
        bowl = np.stack([x, y, height + 1.8 * depth * (x ** 2 + y ** 2)], axis=-1) + middle
        design = dome.design(surface=bowl, flat_height=0.1, max_iterations=60)
        for info in design.steps():
            print(f"step {info.iteration}: {1000 * info.now.surface_rms:.1f} mm from the bowl")
        info = design.wait()
        told = f"{1000 * info.start.surface_rms:.1f} mm before, {1000 * info.best.surface_rms:.1f} mm now"
        print(f"{info.message}\n{info.end}: {told}")
        limber.picture(picture, {"start": start, "target": None, "result": dome.shape()}, surface=bowl, unit="m")


if __name__ == "__main__":
    main(*sys.argv[1:])
