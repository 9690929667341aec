"""Recovers the material of a swinging beam: `recover_material.py [FRAMES]` prints its modes and how well they foretell the
second half of the motion."""

import sys

import limber
import numpy as np

frames = int(sys.argv[1]) if len(sys.argv) > 1 else 120
cells = np.array([(i, j, k) for i in range(12) for j in range(2) for k in range(2)])
nodes = (0.1, 0.07, 0.1) * np.array([(i, j, k) for i in range(13) for j in range(3) for k in range(3)])
corners = cells[:, None] + [[b & 1, b >> 1 & 1, b >> 2] for b in range(8)]
cube = corners @ [9, 3, 1]
tets = np.concatenate([cube[:, [0, a, b, 7]] for a, b in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))])

with limber.launch() as server:
    scene = limber.scene_from_arrays(nodes, tets, frames=frames, fixed_nodes=range(9), modes=3, youngs_modulus=2e6)
    made = server.simulate(scene, limber.simulation(modes=[0.15, 0, 0.02], steps_per_frame=2, relaxation_time=0.002))
    scene.base_motion.CopyFrom(limber.base_motion(made.positions))
    found = server.recover(scene, recovered_frames=frames // 2)
for mode in found.modes:
    print(f"{mode.frequency:8.3f} Hz  {100 * mode.damping_ratio:6.2f} % of critical damping")
print(f"frames {found.recovered_frames} to {frames} off by {100 * found.continued_error:.2f} %, "
      f"the last by {100 * found.final_frame_error:.2f} %")
