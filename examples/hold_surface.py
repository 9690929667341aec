"""Points of an artist's mesh are held where they are shown: a vertex, a point of a triangle, and the feet as a group.

usage: examples/hold_surface.py SURFACE.obj     closed, with y up; it is filled with tets
"""

import sys

import limber
import numpy as np

FRAME = 60

if len(sys.argv) != 2:
    sys.exit(f"usage: {sys.argv[0]} SURFACE.obj, closed, with y up")

with limber.launch() as server:
    body = server.open(sys.argv[1], timeout=300)
    surface = body.carried_surface()
    rest = surface.vertices.astype(float)
    low, high = rest.min(axis=0), rest.max(axis=0)
    size = np.linalg.norm(high - low)

    top = int(rest[:, 1].argmax())
    body.add(surface_vertex=top, frame=FRAME, position=rest[top] + (0.1 * size, 0, 0), exact=True)
    front = body.nearest_surface_point(((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]))
    body.add(surface_point=front, frame=FRAME, displacement=(0, 0.05 * size, 0), exact=True)
    feet = body.nodes_in_box(low - size, (high[0] + size, low[1] + 0.1 * (high[1] - low[1]), high[2] + size))
    body.add(nodes=feet, frame=FRAME, displacement=(0, 0, 0))
    body.wait(timeout=300)

    shown = body.frames(FRAME, 1, encoding="surface")[0]
    corners = surface.triangles[front.triangle]
    at = np.array(front.weights) @ shown[corners]
    for what, moved in ((f"vertex {top}", shown[top] - rest[top]), (f"point of triangle {front.triangle}", at - front.position)):
        print(f"{what} moved by {np.round(moved / size, 4)} of the size")
    print(f"{len(feet)} nodes are held as a group")
