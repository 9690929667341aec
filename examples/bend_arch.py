"""A rod that is hardly bent becomes an arch: its right end is pushed inwards."""

import math
import sys

import limber

COUNT = 40
HELD = {"fix_x": True, "fix_y": True, "fix_z": True, "fix_rotation_x": True, "fix_rotation_z": True}
arch = {
    "name": "arch",
    "nodes": [{"position": {"x": 4 * i / COUNT, "z": 0.05 * math.sin(math.pi * i / COUNT)}} for i in range(COUNT + 1)],
    "sections": [{"tube": {"outer_radius": 0.01}, "young": 40e9, "poisson": 0.3, "density": 2000, "yield_stress": 900e6}],
    "elements": [{"start": i, "finish": i + 1} for i in range(COUNT)],
    "supports": [{"node": 0, **HELD}, {"node": COUNT, **HELD, "fix_x": False}],
    "motions": [{"node": COUNT, "x": -0.8}],
    "gravity": {"z": -9.81},
}
with limber.launch() as server:
    answer = server.solve_beams(arch, files=("vtu", "csv"), stem="arch")
    print(f"{answer.status.lower()} by {answer.method}: rise {answer.positions[:, 2].max():.3f} m, "
          f"thrust {abs(answer.reaction_forces[0, 0]):.1f} N, utilisation {answer.utilisations.max():.2f}")
    for path in answer.write(sys.argv[1] if len(sys.argv) > 1 else "out/arch"):
        print(path)
