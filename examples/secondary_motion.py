"""A rod is shaken at its lower end: pins that follow a path in a loop, inertia, and a hold on top.

usage: examples/secondary_motion.py [OUT.glb]     OUT.glb: one turn of the loop, to be looked at in any viewer
"""

import sys

import limber
import numpy as np

FRAMES, CELLS, SIDE = 48, 12, 0.05


def rod():
    """Nodes and tets of CELLS cubes on top of each other, each of side SIDE."""
    nodes = np.array([(x, y, z) for y in range(CELLS + 1) for x in range(2) for z in range(2)], dtype=float) * SIDE
    corner = {(x, z): 2 * x + z for x in range(2) for z in range(2)}
    tets = []
    for cell in range(CELLS):
        at = lambda x, y, z: 4 * (cell + y) + corner[x, z]
        for second, third in (((1, 0, 0), (1, 1, 0)), ((1, 0, 0), (1, 0, 1)), ((0, 1, 0), (1, 1, 0)),
                              ((0, 1, 0), (0, 1, 1)), ((0, 0, 1), (1, 0, 1)), ((0, 0, 1), (0, 1, 1))):
            tet = [at(0, 0, 0), at(*second), at(*third), at(1, 1, 1)]
            if np.linalg.det(nodes[tet[1:]] - nodes[tet[0]]) < 0:
                tet[1], tet[2] = tet[2], tet[1]
            tets.append(tet)
    return nodes, np.array(tets)


def main():
    nodes, tets = rod()
    pins = np.flatnonzero(nodes[:, 1] == 0)
    tip = int(np.flatnonzero(nodes[:, 1] == nodes[:, 1].max())[0])
    turns = 2 * np.pi * np.arange(FRAMES) / FRAMES
    paths = nodes[pins] + 0.1 * np.sin(turns)[:, None, None] * (1, 0, 0)
    with limber.launch() as server:
        scene = limber.scene_from_arrays(nodes, tets, fixed_nodes=pins, frames=FRAMES, first_end="cyclic", last_end="cyclic",
                                         base_motion=limber.animated_pins(paths), period_frames=20, damping_ratio=0.1)
        body = server.open(scene, progress=False)
        base = paths[:, 0, 0] - nodes[pins[0], 0]
        for inertia in (0, 1):
            body.dynamics(inertia=inertia)
            body.wait()
            swing = body.frames()[:, tip, 0] - nodes[tip, 0]
            late = -np.angle(np.fft.rfft(swing)[1] / np.fft.rfft(base)[1]) / (2 * np.pi) * FRAMES
            print(f"inertia {inertia}: the pins swing by {np.ptp(base):.3f}, the tip by {np.ptp(swing):.3f}, {late:.1f} frames later")
        body.add(node=tip, frame=30, until=40, displacement=(0, 0, 0), exact=True)
        body.wait()
        held = body.frames()[30:41, tip] - nodes[tip]
        print(f"held from frame 30 to 40: the tip is within {np.abs(held).max():.1e} of its place")
        if len(sys.argv) > 1:
            body.save(sys.argv[1])


if __name__ == "__main__":
    main()
